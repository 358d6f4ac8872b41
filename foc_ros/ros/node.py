"""The ROS 2 node: messages in, predictions out whenever a hand pose is due, health once a second.

The node holds no model and no memory of its own: the pipeline does, driven by the stamps of the messages. So it answers as a
replay of the same messages does. What it adds are clocks: an input that has fallen silent is no input.

It is a managed node. From its configuration on it listens and keeps the scene; it predicts only while it is active, from the
first hand pose after its activation. With `autostart`, the default, it is active at once.

A player that wants every one of its messages heard waits until each of its publishers has a subscription
(`Publisher.get_subscription_count()`) and its own subscriptions a publisher, sends the scene, and sends the hand only when
`/diagnostics` counts the obstacles and goals: what is sent on the hand's best-effort topic before both sides know of each other
is lost.
"""

from __future__ import annotations

import traceback
from time import monotonic
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray
from rclpy.clock import Clock, ClockType
from rclpy.lifecycle import LifecycleNode, LifecycleState, TransitionCallbackReturn
from std_srvs.srv import SetBool, Trigger

from foc_ros.core.config import Config
from foc_ros.core.errors import FocError
from foc_ros.core.pipeline import Pipeline, SampleStatus
from foc_ros.core.predictor import warm_up
from foc_ros.io.class_library import load_library
from foc_ros.io.topics import CLOUD, GOAL, GOALS, HAND, MARKERS

from .endpoints import INPUTS, advertise, subscribe, waiting
from .freshness import Freshness
from .health import Monitor
from .intake import Intake
from .lifecycle import answer_refused_transitions
from .live_parameters import LiveParameters
from .messages.diagnostics import diagnostic_array
from .messages.outputs import output_messages
from .messages.types import RclpyTypes
from .parameters import autostart, declare_all
from .transforms import Frames

THROTTLE_S = 5.0
"""Between two log lines of one kind [s]."""
WHOLE = (GOALS, GOAL, CLOUD)
"""Inputs of which each message says everything: of several waiting, the newest good one holds."""
SUCCESS, FAILURE = TransitionCallbackReturn.SUCCESS, TransitionCallbackReturn.FAILURE


class FocNode(LifecycleNode):
    """Node `foc`. Raises ParameterError where it is started with a parameter out of bounds, FocError where it cannot start."""

    def __init__(self, **options: Any) -> None:
        super().__init__('foc', automatically_declare_parameters_from_overrides=True, **options)
        self._live = LiveParameters(self, declare_all(self, Config()), self._reconfigure)
        self._library = load_library(self._live.config.homotopy.library)
        at_once = autostart(self)
        self._types = RclpyTypes()
        # A logger throttles each of its lines by itself: one per input, so that none silences another.
        self._loggers = {role: self.get_logger().get_child(role) for role in INPUTS}
        self._state, self._engaged, self._obstacle_to_start = 'unconfigured', True, ''
        self._inputs: dict[str, Any] = {}
        self._outputs: dict[str, Any] = {}
        self._frames = Frames(self)
        self._begin()
        self._diagnostics = self.create_publisher(DiagnosticArray, '/diagnostics', 10)
        self.create_service(SetBool, '~/engage', self._engage)
        self.create_service(Trigger, '~/reset', self._reset)
        self.create_timer(1.0, self._publish_health, clock=Clock(clock_type=ClockType.STEADY_TIME))
        answer_refused_transitions(self)
        if at_once and (self.trigger_configure() != SUCCESS or self.trigger_activate() != SUCCESS):
            raise FocError(self._obstacle_to_start)

    def on_configure(self, _: LifecycleState) -> TransitionCallbackReturn:
        """Begin to listen."""
        self._begin()
        try:
            warm_up(self._live.config)
            self._outputs = advertise(self)
            self._inputs = subscribe(self, self._receive)
        except Exception as error:
            self._release()
            self._obstacle_to_start = ' '.join(str(error).split())
            self.get_logger().error(f'cannot be configured: {self._obstacle_to_start}')
            return FAILURE
        return self._enter('inactive')

    def on_activate(self, _: LifecycleState) -> TransitionCallbackReturn:
        """Predict from the next hand pose on."""
        return self._enter('active')

    def on_deactivate(self, _: LifecycleState) -> TransitionCallbackReturn:
        """Predict no more, but go on listening."""
        return self._enter('inactive')

    def on_cleanup(self, _: LifecycleState) -> TransitionCallbackReturn:
        """Forget everything but the parameters."""
        self._release()
        self._begin()
        return self._enter('unconfigured')

    def on_shutdown(self, _: LifecycleState) -> TransitionCallbackReturn:
        """Let go of the topics, for good."""
        self._release()
        return self._enter('finalized')

    def on_error(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Start from the beginning."""
        return self.on_cleanup(state)

    def _begin(self) -> None:
        self.pipeline = Pipeline(self._live.config, self._library)
        self.intake, self._freshness, self._monitor = Intake(self.pipeline), Freshness(), Monitor(monotonic())

    def _release(self) -> None:
        for subscription in self._inputs.values():
            self.destroy_subscription(subscription)
        for publisher in self._outputs.values():
            self.destroy_publisher(publisher)
        self._inputs, self._outputs = {}, {}

    def _enter(self, state: str) -> TransitionCallbackReturn:
        self._state = state
        self._close_or_open()
        return SUCCESS

    def _close_or_open(self) -> None:
        self.pipeline.engage(self._engaged and self._state == 'active')

    def _reconfigure(self, config: Config) -> None:
        self.pipeline.reconfigure(config)

    def _receive(self, role: str, message: Any) -> None:
        """Take a message and all that wait behind it; predict once, from the newest hand pose.

        Markers are taken one message at a time, each counts and takes its time: the hand is looked at in between.
        """
        messages = [message] if role == MARKERS else [message, *waiting(self._inputs[role])]
        taken = False
        for each in reversed(messages) if role in WHOLE else messages:
            taken = self._take(role, each) or taken
            if taken and role in WHOLE:
                break
        if taken and role == HAND and self.pipeline.due:
            self._predict()

    def _take(self, role: str, message: Any) -> bool:
        moved = self._frames.moved(role, message, self.pipeline.frame_id)
        verdict, now_s = self.intake.take(role, moved), monotonic()
        taken = verdict is not None and verdict.taken
        refused, received = self._monitor.received(role, now_s, taken=taken)
        if taken:
            self._freshness.heard(role, now_s)
        if verdict is not None and taken and role == HAND:
            self._note_pose(verdict)
        if not taken:
            reasons = '; '.join(filter(None, [self.intake.last_refusal, self._frames.last_error]))
            text = f'{reasons} ({refused} of {received} refused so far)'
            self._loggers[role].warning(text, throttle_duration_sec=THROTTLE_S)
        return taken

    def _note_pose(self, verdict: SampleStatus) -> None:
        sample, clock_ns = self.intake.sample, self.get_clock().now().nanoseconds
        assert sample is not None
        timeout_s = self.pipeline.config.estimator.hand_timeout_s
        self._freshness.pose(sample.stamp_ns, clock_ns, timeout_s, restarted=verdict.restarted)

    def _not_ready_reason(self) -> tuple[str, str] | None:
        return self._freshness.not_ready_reason(monotonic(), self.pipeline.config, self.pipeline.scene.parts)

    def _predict(self) -> None:
        began_s = monotonic()
        not_ready_reason = self._not_ready_reason()
        if not_ready_reason is not None:
            self._monitor.withheld(not_ready_reason[0])
            return
        try:
            prediction = self.pipeline.predict()
            if prediction is None:
                return
            obstacles = self.pipeline.scene.obstacles(prediction.stamp_ns)
            heard = [name for name, publisher in self._outputs.items() if publisher.get_subscription_count()]
            messages = output_messages(prediction, obstacles, self.pipeline.config.plane, self._types, heard)
        except Exception as error:
            self.report(error)
            self.pipeline.reset()
            return
        for name, message in messages.items():
            self._publish(self._outputs[name], message)
        self._monitor.predicted(prediction, began_s, monotonic())

    def report(self, error: Exception) -> None:
        """Count and log an error that should not happen."""
        self._monitor.failed(error)
        text = ''.join(traceback.format_exception(error))
        self.get_logger().error(f'internal error: {text}', throttle_duration_sec=THROTTLE_S)

    def _publish_health(self) -> None:
        not_ready_reason = self._not_ready_reason()
        words = None if not_ready_reason is None else not_ready_reason[1]
        health = self._monitor.health(monotonic(), self.intake, self._state, words)
        name = self.get_fully_qualified_name()
        stamp_ns = self.get_clock().now().nanoseconds
        self._publish(self._diagnostics, diagnostic_array(health, f'{name[1:]}: prediction', name, stamp_ns, self._types))

    def _publish(self, publisher: Any, message: Any) -> None:
        if self.context.ok():
            publisher.publish(message)

    def _engage(self, request: SetBool.Request, response: SetBool.Response) -> SetBool.Response:
        self._engaged = bool(request.data)
        self._close_or_open()
        words = 'engaged' if self._engaged else 'disengaged'
        response.success, response.message = True, words if self._state == 'active' else f'{words}, but {self._state}'
        return response

    def _reset(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        self.pipeline.reset()
        self._freshness.forget()
        response.success, response.message = True, 'the movement is forgotten, the scene is kept'
        return response
