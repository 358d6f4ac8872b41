# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The ROS 2 node: a prediction for every hand pose that is due, and diagnostics once a second.

The pipeline is driven by message stamps, so the node gives the same answers as a replay of the same messages, apart from
candidates that `budget_s` leaves to an estimate. The node adds the clocks: it makes no prediction from an input that has fallen
silent, and publishes none that has become too old.

A prediction is computed in another process (`worker`) for the program, or else in another thread, guidance in a third thread
(`guidance`), and all else in that of the executor. What is received or asked for meanwhile is done at once: after a reset, a
release of the clutch, a change of parameters or of the state of the managed node, nothing that was computed before is published.
A running computation cannot be stopped: its deadline is cancelled, it ends when it next checks that, and its result is ignored.

It is a managed node. Once configured it subscribes and keeps the scene; it predicts only while it is active. With `autostart`,
the default, it is active at once.
"""

from __future__ import annotations

import traceback
from collections.abc import Sequence
from concurrent.futures import Future, ThreadPoolExecutor, wait
from time import monotonic, sleep
from typing import Any, NamedTuple

from diagnostic_msgs.msg import DiagnosticArray
from rclpy.clock import Clock, ClockType
from rclpy.lifecycle import LifecycleNode, LifecycleState, TransitionCallbackReturn
from std_srvs.srv import SetBool, Trigger

from foc_ros.core.config import Config
from foc_ros.core.deadline import Deadline
from foc_ros.core.errors import FocError
from foc_ros.core.pipeline import Compute, Pipeline, PredictionTask
from foc_ros.core.prediction import Prediction
from foc_ros.core.tracks import Tracks
from foc_ros.core.types import NANOSECONDS
from foc_ros.io.class_library import load_library
from foc_ros.io.topics import COMMAND, HAND, MARKERS, REQUIRED

from . import endpoints
from .guidance import GuidanceTopics
from .health import SOURCE_TOPICS, THROTTLE_S, Freshness, Monitor
from .intake import Arrival, Intake
from .messages.encode_prediction import OUTPUTS, encode_outputs
from .messages.types import RclpyTypes
from .node_parameters import LiveParameters, declare_parameters
from .parameters import AUTOSTART
from .transforms import Transforms

REST_S, LONGEST_REST_S = 0.004, 0.02
"""Shortest and longest time for which the poses of a fast hand gather before they are taken together [s]."""
DRAWN_S = 0.035
"""Least time between the stamps of two arrays of markers [s]: of 50 predictions a second, every second one is drawn."""
DRAWING = 'markers'
"""The output that takes longer than all others; it is published last."""
SUCCESS, FAILURE = TransitionCallbackReturn.SUCCESS, TransitionCallbackReturn.FAILURE


class Computation(NamedTuple):
    """A task, when its hand pose arrived and it began [s, steady clock], and its result: the prediction and the tracks."""

    task: PredictionTask
    received_s: float
    start_s: float
    result: Future[tuple[Prediction, Tracks]]


class FocNode(LifecycleNode):
    """Node `foc`; compute: called in another thread for each prediction, for instance `Worker.run`.

    Raises ParameterError if it is started with a wrong parameter, FocError if it cannot start.
    """

    def __init__(self, compute: Compute = PredictionTask.run, **options: Any) -> None:
        super().__init__('foc', automatically_declare_parameters_from_overrides=True, **options)
        self._live_parameters = LiveParameters(self, declare_parameters(self), self._reconfigure)
        self._library = load_library(self._live_parameters.config.homotopy.library)
        self._types = RclpyTypes()
        # a logger throttles each line of code by itself: with one logger per input, no input suppresses the lines of another
        self._loggers = {role: self.get_logger().get_child(role) for role in endpoints.INPUTS}
        self._state, self._is_engaged, self._start_error = 'unconfigured', True, ''
        self._has_predicted, self._is_hand_fast, self._hand_s, self._drawn_ns = False, False, 0.0, -NANOSECONDS
        self._inputs: dict[str, Any] = {}
        self._outputs: dict[str, Any] = {}
        self._goal_topics = endpoints.GoalTopics(self)
        self._guidance = GuidanceTopics(self, self._outputs, self._live_parameters.config, self.report)
        try:
            self._tf: endpoints.TfListener | None = endpoints.TfListener(self, self._take_held)
        except ImportError:  # tf2 is optional
            self._tf = None
        steady = Clock(clock_type=ClockType.STEADY_TIME)
        self._retries = self.create_timer(0.01, self._take_held, clock=steady)  # of messages that wait for their transforms
        self._compute, self._thread, self._is_destroyed = compute, ThreadPoolExecutor(1, 'prediction'), False
        self._computation: Computation | None = None
        self._create_pipeline()
        self._diagnostics = self.create_publisher(DiagnosticArray, '/diagnostics', 10)
        self.create_service(SetBool, '~/engage', self._engage)
        self.create_service(Trigger, '~/reset', self._reset)
        self.create_timer(1.0, self._publish_health, clock=steady)
        endpoints.answer_refused_transitions(self._service_change_state, self.get_logger())  # rclpy has no public way to it
        if self.get_parameter(AUTOSTART).value and (self.trigger_configure() != SUCCESS or self.trigger_activate() != SUCCESS):
            raise FocError(self._start_error)

    def on_configure(self, _: LifecycleState) -> TransitionCallbackReturn:
        """Create the topics."""
        try:
            kinds = {name: kind for name, (kind, _) in OUTPUTS.items()} | self._guidance.list_kinds()
            self._outputs.update({name: endpoints.create_publisher(self, name, kind) for name, kind in kinds.items()})
            self._inputs.update(endpoints.create_subscriptions(self, self._receive))
            self._guidance.loop.start()
        except Exception as error:
            self._destroy_topics()
            self._start_error = ' '.join(str(error).split())
            self.get_logger().error(f'cannot be configured: {self._start_error}')
            return FAILURE
        return self._enter('inactive')

    def on_activate(self, _: LifecycleState) -> TransitionCallbackReturn:
        """Predict from the next hand pose on."""
        topics = {role: subscription.topic_name for role, subscription in self._inputs.items()}
        groups = [' or '.join(topics[role] for role in group if role in topics) for group in REQUIRED]
        self.get_logger().info(f'ready, waiting for {"; ".join(groups)}')
        self._has_predicted = False
        return self._enter('active')

    def on_deactivate(self, _: LifecycleState) -> TransitionCallbackReturn:
        """Stop predicting, and keep following the inputs."""
        return self._enter('inactive')

    def on_cleanup(self, _: LifecycleState) -> TransitionCallbackReturn:
        """Forget everything but the parameters."""
        self._destroy_topics()
        self._create_pipeline()
        return self._enter('unconfigured')

    on_error = on_cleanup

    def on_shutdown(self, _: LifecycleState) -> TransitionCallbackReturn:
        """Destroy the topics."""
        self._destroy_topics()
        return self._enter('finalized')

    def rest(self) -> None:
        """Wait after a pose of a fast hand, so that several are taken at once: to wake up for each costs more than to use it."""
        if self._is_hand_fast:
            self._is_hand_fast = False
            unneeded_s = 0.0 if self.pipeline.config.guidance.enabled else self.pipeline.until_due_s
            pause = self.is_busy_after if self.is_busy else sleep
            pause(min(max(unneeded_s, REST_S), LONGEST_REST_S))

    def report(self, error: Exception) -> None:
        """Count and log an internal error."""
        self._monitor.note_error(error)
        text = ''.join(traceback.format_exception(error))
        self.get_logger().error(f'internal error: {text}', throttle_duration_sec=THROTTLE_S)

    def destroy_node(self) -> None:
        """Destroy the node; a prediction that is being computed ends at the next check of its deadline."""
        self._is_destroyed = True
        self._destroy_topics()
        self._thread.shutdown(wait=False)  # a cancelled future that no thread has taken would never count as done
        super().destroy_node()

    @property
    def is_busy(self) -> bool:
        """Whether a prediction is being computed, or was and is not published yet."""
        return self._computation is not None

    def is_busy_after(self, seconds: float) -> bool:
        """Wait for the end of the present computation, at most for some seconds; return whether it still runs then."""
        return self._computation is not None and bool(wait([self._computation.result], seconds).not_done)

    def _create_pipeline(self) -> None:
        self.pipeline = Pipeline(self._live_parameters.config, self._library)
        self.intake, self._freshness = Intake(self.pipeline), Freshness(self.pipeline)
        self._monitor = Monitor(self.intake, self._freshness, monotonic())
        self._transforms = Transforms(self._tf, self.intake)

    def _destroy_topics(self) -> None:
        self.pipeline.reset()
        self._guidance.loop.stop()
        for subscription in self._inputs.values():
            self.destroy_subscription(subscription)
        for publisher in self._outputs.values():
            self.destroy_publisher(publisher)
        self._goal_topics.remove_absent(None)
        self._inputs.clear()
        self._outputs.clear()

    def _enter(self, state: str) -> TransitionCallbackReturn:
        self._state = state
        self.pipeline.set_engaged(self._is_engaged and state == 'active')
        self._guidance.loop.set_released(not self.pipeline.is_engaged)
        return SUCCESS

    def _reconfigure(self, config: Config) -> None:
        self.pipeline.reconfigure(config)
        self._guidance.loop.reconfigure(config)

    def _receive(self, role: str, *messages: Any) -> None:
        """Take messages and those queued behind them, markers one at a time, and predict once, from the newest hand pose."""
        if role not in self._inputs:
            return  # the executor still held messages when the node was cleaned up
        if role == COMMAND:
            if self._state == 'active':
                self._guidance.blend_command(messages[0], self._types)
            return
        waiting = [] if role == MARKERS else endpoints.take_queued(self._inputs[role])
        now_s = monotonic()
        for each in (*messages, *waiting):
            self._transforms.add(role, Arrival(each, now_s))
        if role == HAND and messages:
            self._is_hand_fast = bool(waiting) or now_s - self._hand_s < REST_S / 2.0
            self._hand_s = now_s
        self._take_released(role)

    def _take_held(self) -> None:
        for role in self._transforms.roles:
            self._take_released(role)
        if not self._transforms.roles:
            self._retries.cancel()

    def _take_released(self, role: str) -> None:
        """Take the messages of an input that are not held, and predict if a hand pose was used and a prediction is due."""
        is_taken = False
        for each in self._transforms.release(role, monotonic()):
            is_taken = self._take(role, each) or is_taken
        if self._retries.is_canceled() and self._transforms.roles:
            self._retries.reset()
        if is_taken and role == HAND:
            self._predict()

    def _take(self, role: str, arrival: Arrival) -> bool:
        status = self.intake.take_arrival(role, arrival)
        entry = self._freshness.note(role, status, arrival.received_s, self.intake.last_refusal)
        if status is None or status.is_refused:
            text = f'{self.intake.last_refusal} ({entry.refused} of {entry.received} refused so far)'
            self._loggers[role].warning(text, throttle_duration_sec=THROTTLE_S)
        if status is None or not status.is_taken:
            return False
        if role == HAND and (sample := self.intake.sample) is not None:
            self._guidance.loop.note_hand(self.pipeline.hand_state, arrival.received_s)
            self._freshness.note_pose(sample.stamp_ns, self.get_clock().now().nanoseconds, is_restart=status.is_restart)
        return True

    def _predict(self) -> None:
        if self.is_busy or not self.pipeline.is_due:
            return
        start_s = monotonic()
        if (clock_reason := self._freshness.find_not_ready_reason(start_s)) is not None:
            self._monitor.counts[f'predict_{clock_reason[0]}'] += 1
            return
        try:
            task = self.pipeline.begin(Deadline(self.pipeline.config.budget_s or None))
        except Exception as error:
            self.report(error)
            self._forget_movement()
            return
        if task is not None:
            result = self._thread.submit(self._compute, task)
            self._computation = Computation(task, self._freshness.used_s(HAND, start_s), start_s, result)
            result.add_done_callback(self._announce)

    def _announce(self, _: Future[Any]) -> None:
        """Have the executor publish a prediction; this happens in the thread in which it was computed."""
        executor = self.executor
        if executor is not None and not self._is_destroyed:
            executor.create_task(self._finish)

    def _finish(self) -> None:
        """Publish a prediction that was computed, unless it is too old or not wanted any more, and begin the next."""
        ended = self._computation
        if ended is None or not ended.result.done():
            return
        self._computation = None
        published = None
        try:
            published = self._publish_prediction(ended)
        except Exception as error:
            self.report(error)
            self._forget_movement()
        self._receive(HAND)  # the next prediction is made from the newest pose, though the executor had no time for it yet
        self._predict()
        if published is not None:
            self._draw(published)  # meanwhile the next prediction is computed

    def _publish_prediction(self, ended: Computation) -> Prediction | None:
        """Publish the result of a computation, but for the markers; return it if it is published."""
        prediction, config = self.pipeline.finish(ended.task, ended.result.result), ended.task.config
        if prediction is None:
            return None
        clock_ns = self.get_clock().now().nanoseconds
        late = self._freshness.find_late_reason(prediction.stamp_ns, ended.received_s, monotonic(), clock_ns)
        if late is None:
            self._guidance.loop.note_prediction(prediction, ended.received_s)
            for name in [name for name in OUTPUTS if name != DRAWING and self._outputs[name].get_subscription_count()]:
                self._publish_output(name, prediction, config.plane)
            self._goal_topics.publish(prediction, self._types)
        self._monitor.note_prediction(prediction, ended.start_s, monotonic(), config.budget_s, late)
        if late is None and not self._has_predicted:
            self._has_predicted = True
            self.get_logger().info(f'predicting in frame {self.pipeline.frame_id}, plane {config.plane}')
        return prediction if late is None else None

    def _publish_output(self, name: str, prediction: Prediction, plane: str, more: Sequence[Any] = ()) -> None:
        (message,) = encode_outputs(prediction, plane, self._types, [name]).values()
        if more:
            message.markers.extend(more)
        endpoints.publish(self, self._outputs[name], message)

    def _draw(self, prediction: Prediction) -> None:
        """Publish the markers, unless nobody looks or the last ones are hardly older."""
        is_new = abs(prediction.stamp_ns - self._drawn_ns) >= DRAWN_S * NANOSECONDS
        if is_new and DRAWING in self._outputs and self._outputs[DRAWING].get_subscription_count():
            self._drawn_ns = prediction.stamp_ns
            self._publish_output(DRAWING, prediction, self.pipeline.config.plane, self._guidance.encode_markers(self._types))

    def _forget_movement(self) -> None:
        self.pipeline.reset()
        self._guidance.loop.note_hand(None, monotonic())

    def _publish_health(self) -> None:
        self._receive(HAND)  # a hand whose poses wait here is not silent
        self._goal_topics.remove_absent(self.pipeline.scene.goals)
        if doubt := self.pipeline.library_doubt:
            self.get_logger().warning(f'{self.pipeline.config.homotopy.library}: {doubt}', once=True)
        now_s = monotonic()
        busy_s = 0.0 if self._computation is None else now_s - self._computation.start_s
        unheard = endpoints.report_unconnected(self, self._inputs, self._outputs.values(), self._loggers)
        health = self._monitor.report(now_s, self._state, busy_s, unheard)
        health.values.update(self._guidance.loop.describe())
        name, stamp_ns = self.get_fully_qualified_name(), self.get_clock().now().nanoseconds
        endpoints.publish(self, self._diagnostics, health.encode(name, stamp_ns, self._types))

    def _engage(self, request: SetBool.Request, response: SetBool.Response) -> SetBool.Response:
        self._is_engaged = bool(request.data)
        self._enter(self._state)
        text = 'engaged' if self._is_engaged else 'disengaged'
        response.success, response.message = True, text if self._state == 'active' else f'{text}, but {self._state}'
        return response

    def _reset(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        silent = self._freshness.find_silent_sources(monotonic())
        for source in silent:
            self.intake.remove_source(source)
        self._forget_movement()
        self._freshness.forget_clock()
        removed = ' and '.join(SOURCE_TOPICS[source] for source in silent)
        without = f' without the obstacles of {removed}, which fell silent' if silent else ''
        response.success, response.message = True, f'the movement is forgotten, the scene is kept{without}'
        return response
