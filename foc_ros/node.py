"""The ROS 2 node: messages in, predictions out whenever a hand pose is due, health once a second.

The node holds no model and no memory of its own: the pipeline does, driven by the stamps of the messages. So it answers as a
replay of the same messages does. A player that wants every one of its messages heard waits until each of its publishers has a
subscription (`Publisher.get_subscription_count()`) and its own subscriptions a publisher, sends the scene, and sends the hand
only when `/diagnostics` counts the obstacles and goals: what is sent on the hand's best-effort topic before both sides know of
each other is lost.
"""

from __future__ import annotations

import traceback
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray
from rcl_interfaces.msg import SetParametersResult
from rclpy.clock import Clock, ClockType
from rclpy.exceptions import ParameterNotDeclaredException
from rclpy.node import Node
from rclpy.parameter import Parameter
from std_srvs.srv import SetBool, Trigger

from .conversions.diagnostics import diagnostic_array
from .conversions.outputs import output_messages
from .conversions.types import RclpyTypes
from .endpoints import INPUTS, advertise, subscribe, waiting
from .foc.config import Config, updated
from .foc.errors import ParameterError
from .foc.pipeline import Pipeline
from .intake import Intake
from .monitor import Monitor
from .parameters import KNOWN, config_of, declare_all
from .topics import CLOUD, GOAL, GOALS, HAND

THROTTLE_S = 5.0
"""Between two log lines of one kind [s]."""
WHOLE = (GOALS, GOAL, CLOUD)
"""Inputs of which each message says everything: of several waiting, the newest good one holds."""


class FocNode(Node):
    """Node `foc`. Raises ParameterError where it is started with a parameter out of bounds."""

    def __init__(self, **options: Any) -> None:
        super().__init__('foc', automatically_declare_parameters_from_overrides=True, **options)
        self.pipeline = Pipeline(declare_all(self, Config()))
        self.intake = Intake(self.pipeline)
        self._steady = Clock(clock_type=ClockType.STEADY_TIME)
        self._monitor = Monitor(self._now_s())
        self._types = RclpyTypes()
        # A logger throttles each of its lines by itself: one per input, so that none silences another.
        self._loggers = {role: self.get_logger().get_child(role) for role in INPUTS}
        self.add_pre_set_parameters_callback(self._prepare_parameters)
        self.add_on_set_parameters_callback(self._check_parameters)
        self.add_post_set_parameters_callback(self._apply_parameters)
        self._outputs = advertise(self)
        self._diagnostics = self.create_publisher(DiagnosticArray, '/diagnostics', 10)
        self.create_service(SetBool, '~/engage', self._engage)
        self.create_service(Trigger, '~/reset', self._reset)
        self._inputs = subscribe(self, self._receive)
        self.create_timer(1.0, self._publish_health, clock=self._steady)

    def _receive(self, role: str, message: Any) -> None:
        """Take a message and all that wait behind it; predict once, from the newest hand pose."""
        messages = [message, *waiting(self._inputs[role])]
        taken = False
        for each in reversed(messages) if role in WHOLE else messages:
            taken = self._take(role, each) or taken
            if taken and role in WHOLE:
                break
        if taken and role == HAND and self.pipeline.due:
            self._predict()

    def _take(self, role: str, message: Any) -> bool:
        verdict = self.intake.take(role, message)
        taken = verdict is not None and verdict.taken
        refused, received = self._monitor.received(role, self._now_s(), taken=taken)
        if not taken:
            text = f'{self.intake.last_refusal} ({refused} of {received} refused so far)'
            self._loggers[role].warning(text, throttle_duration_sec=THROTTLE_S)
        return taken

    def _predict(self) -> None:
        began_s = self._now_s()
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
        self._monitor.predicted(prediction, began_s, self._now_s())

    def report(self, error: Exception) -> None:
        """Count and log an error that should not happen."""
        self._monitor.failed(error)
        text = ''.join(traceback.format_exception(error))
        self.get_logger().error(f'internal error: {text}', throttle_duration_sec=THROTTLE_S)

    def _publish_health(self) -> None:
        health = self._monitor.health(self._now_s(), self.intake)
        name = self.get_fully_qualified_name()
        stamp_ns = self.get_clock().now().nanoseconds
        self._publish(self._diagnostics, diagnostic_array(health, f'{name[1:]}: prediction', name, stamp_ns, self._types))

    def _publish(self, publisher: Any, message: Any) -> None:
        if self.context.ok():
            publisher.publish(message)

    def _engage(self, request: SetBool.Request, response: SetBool.Response) -> SetBool.Response:
        self.pipeline.engage(request.data)
        response.success, response.message = True, 'engaged' if request.data else 'disengaged'
        return response

    def _reset(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        self.pipeline.reset()
        response.success, response.message = True, 'the movement is forgotten, the scene is kept'
        return response

    def _prepare_parameters(self, changed: list[Parameter]) -> list[Parameter]:
        """Name the unknown ones, as rclpy does not; read a whole number as a real one where that is wanted."""
        unknown = [each.name for each in changed if not self.has_parameter(each.name)]
        if unknown:
            raise ParameterNotDeclaredException(unknown)
        return [
            Parameter(each.name, value=float(each.value))
            if each.type_ == Parameter.Type.INTEGER and each.name in KNOWN and isinstance(KNOWN[each.name].default, float)
            else each
            for each in changed
        ]

    def _check_parameters(self, changed: list[Parameter]) -> SetParametersResult:
        try:
            updated(self.pipeline.config, {each.name: each.value for each in changed if each.name in KNOWN})
        except ParameterError as error:
            return SetParametersResult(successful=False, reason=str(error))
        return SetParametersResult(successful=True)

    def _apply_parameters(self, changed: list[Parameter]) -> None:
        if any(each.name in KNOWN for each in changed):
            self.pipeline.reconfigure(config_of(self))

    def _now_s(self) -> float:
        return float(self._steady.now().nanoseconds) * 1e-9
