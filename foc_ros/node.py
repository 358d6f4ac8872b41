"""The ROS 2 node: messages in, predictions out whenever a hand pose is due, health once a second.

The node holds no model and no memory of its own: the pipeline does, driven by the stamps of the messages. So it answers as a
replay of the same messages does. A player that wants every one of its messages heard waits until each of its publishers has a
subscription (`Publisher.get_subscription_count()`) and its own subscriptions have a publisher, then sends the scene, waits for
`/diagnostics` to say that only the hand is missing, and then sends the hand.
"""

from __future__ import annotations

import traceback
from functools import partial
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PoseArray, PoseStamped
from nav_msgs.msg import Path
from rcl_interfaces.msg import SetParametersResult
from rclpy.clock import Clock, ClockType
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.qos import QoSDurabilityPolicy, QoSHistoryPolicy, QoSPolicyKind, QoSProfile, QoSReliabilityPolicy
from rclpy.qos_overriding_options import QoSOverridingOptions
from sensor_msgs.msg import PointCloud2
from std_msgs.msg import Float64MultiArray
from std_srvs.srv import SetBool, Trigger
from visualization_msgs.msg import MarkerArray

from .conversions.diagnostics import diagnostic_array
from .conversions.outputs import output_messages
from .conversions.types import RclpyTypes
from .foc.config import Config, updated
from .foc.errors import ParameterError
from .foc.pipeline import Pipeline
from .intake import Intake
from .monitor import Monitor
from .parameters import KNOWN, config_of, declare_all
from .topics import CLOUD, GOAL, GOALS, HAND, MARKERS

HAND_DEPTH, SCENE_DEPTH = 200, 10
"""Messages kept while a prediction is computed: 0.2 s of hand poses at 1 kHz."""
THROTTLE_S = 5.0

_INPUTS: dict[str, Any] = {GOALS: PoseArray, GOAL: PoseStamped, CLOUD: PointCloud2, MARKERS: MarkerArray, HAND: PoseStamped}
"""In the order in which the executor looks at them: the scene before the hand."""
_OUTPUTS: dict[str, Any] = {'prediction': PointCloud2, 'likelihoods': Float64MultiArray, 'path': Path, 'markers': MarkerArray}
_WHOLE = (GOALS, GOAL, CLOUD)
"""Inputs of which each message says everything: of several waiting, the newest good one holds."""


def _qos(reliability: QoSReliabilityPolicy, depth: int) -> QoSProfile:
    return QoSProfile(
        reliability=reliability, durability=QoSDurabilityPolicy.VOLATILE, history=QoSHistoryPolicy.KEEP_LAST, depth=depth
    )


def _overridable() -> QoSOverridingOptions:
    """Let `qos_overrides.<topic>.subscription.durability: transient_local` hear a scene that was published once."""
    kinds = QoSPolicyKind
    return QoSOverridingOptions((kinds.HISTORY, kinds.DEPTH, kinds.RELIABILITY, kinds.DURABILITY))


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
        self._loggers = {role: self.get_logger().get_child(role) for role in _INPUTS}
        self.add_pre_set_parameters_callback(_with_floats)
        self.add_on_set_parameters_callback(self._check_parameters)
        self.add_post_set_parameters_callback(self._apply_parameters)
        reliable, best_effort = QoSReliabilityPolicy.RELIABLE, QoSReliabilityPolicy.BEST_EFFORT
        self._outputs = {
            name: self.create_publisher(kind, f'~/{name}', _qos(reliable, 10), qos_overriding_options=_overridable())
            for name, kind in _OUTPUTS.items()
        }
        self._diagnostics = self.create_publisher(DiagnosticArray, '/diagnostics', 10)
        self.create_service(SetBool, '~/engage', self._engage)
        self.create_service(Trigger, '~/reset', self._reset)
        self._inputs = {
            role: self.create_subscription(
                kind,
                role,
                partial(self._receive, role),
                _qos(best_effort, HAND_DEPTH) if role == HAND else _qos(reliable, SCENE_DEPTH),
                qos_overriding_options=_overridable(),
            )
            for role, kind in _INPUTS.items()
        }
        self.create_timer(1.0, self._publish_health, clock=self._steady)

    def _receive(self, role: str, message: Any) -> None:
        """Take a message and all that wait behind it; predict once, from the newest hand pose."""
        waiting = [message, *self._waiting(role)]
        for each in reversed(waiting) if role in _WHOLE else waiting:
            if self._take(role, each) and role in _WHOLE:
                break
        if role == HAND and self.pipeline.due:
            self._predict()

    def _waiting(self, role: str) -> list[Any]:
        """Take what the subscription's queue holds, no more than fits into it."""
        subscription = self._inputs[role]
        messages: list[Any] = []
        with subscription.handle:
            while len(messages) < HAND_DEPTH:
                taken = subscription.handle.take_message(subscription.msg_type, False)
                if taken is None:
                    break
                messages.append(taken[0])
        return messages

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


def _with_floats(changed: list[Parameter]) -> list[Parameter]:
    """Read a whole number that is set on a parameter of real numbers as one."""
    return [
        Parameter(each.name, value=float(each.value))
        if each.type_ == Parameter.Type.INTEGER and each.name in KNOWN and isinstance(KNOWN[each.name].default, float)
        else each
        for each in changed
    ]
