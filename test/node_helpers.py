# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""A FocNode and publishers of its inputs, in one private graph."""

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
from message_helpers import SECOND, cloud, obstacle_table, pose_array, pose_stamped
from ros_helpers import Graph

from foc_ros.io import topics
from foc_ros.ros.messages.encode_prediction import OTHER, OUTPUTS, UNKNOWN
from foc_ros.ros.messages.types import RclpyTypes, find_message_class

TYPES = RclpyTypes()
OK, WARN, ERROR = b'\x00', b'\x01', b'\x02'
"""Levels of diagnostics."""
ROWS = [(0.15, 0.02, 0.0, 0.03)]
CROWD = [(0.01 * (i % 100) - 0.35, 0.05 + 0.01 * (i // 100), 0.0, 0.004) for i in range(10_000)]
GOALS = [(0.3, 0.0, 0.0)]
QUICK = {'foc.steps': 20, 'homotopy.max_candidates': 2, 'scene.timeout_s': 0.0, 'estimator.hand_timeout_s': 0.0, 'budget_s': 0.0}
"""Parameters for quick predictions, without time limits that a slow machine would exceed."""
RELIABLE = {f'qos_overrides./{name}.subscription.reliability': 'reliable' for name in ('hand_pose', 'obstacles')}
"""Reliable inputs, so that a test can wait until all of them are received."""
INPUTS = {name: kind for name, kind in topics.TYPES.items() if name not in topics.OPTIONAL}


def hand_path(count: int, rate_hz: float = 100.0, start_s: float = 10.0) -> list[Any]:
    """Return hand poses that speed up towards the goal."""
    times = np.arange(count) / rate_hz
    return [pose_stamped(TYPES, (0.15 * t**2, 0.0, 0.1), round((start_s + t) * SECOND)) for t in times]


class Player:
    """`player`: publishes the inputs by `publishers`; `received`: the outputs by name, `diagnostics`: all that were heard.

    topics: other names of inputs.
    """

    def __init__(self, ros: Graph, outputs: Iterable[str], namespace: str = '', **topics: str) -> None:
        self.ros = ros
        self.player = ros.node(f'player{namespace.replace("/", "_")}', namespace=namespace)
        self.publishers = {
            name: self.player.create_publisher(find_message_class(kind), topics.get(name, name), 1000)
            for name, kind in INPUTS.items()
        }
        self.received = {name: ros.collect(self.player, find_message_class(OUTPUTS[name][0]), f'foc/{name}') for name in outputs}
        # subscriptions are announced in order: a node whose diagnostics are received knows those above
        self.diagnostics = ros.collect(self.player, find_message_class('diagnostic_msgs/msg/DiagnosticArray'), '/diagnostics')


class Bench(Player):
    """A player and its node. Unless `ticking`, the timers of the node are stopped, since they would publish in between."""

    def __init__(
        self,
        ros: Graph,
        outputs: Iterable[str] = ('prediction', 'likelihoods', 'path', 'markers'),
        *,
        ticking: bool = False,
        connected: bool = True,
        **parameters: Any,
    ) -> None:
        from rclpy.parameter import Parameter

        from foc_ros.ros.node import FocNode

        namespace = parameters.pop('namespace', '')
        given = QUICK | RELIABLE | {name.replace('__', '.'): value for name, value in parameters.items()}
        overrides = [Parameter(name, value=value) for name, value in given.items()]
        self.node = ros.add(FocNode(context=ros.context, parameter_overrides=overrides, namespace=namespace))
        if not ticking:
            for timer in self.node.timers:
                timer.cancel()
        super().__init__(ros, outputs, namespace)
        if connected:
            self.connect()

    def connect(self) -> None:
        """Spin until all publishers and subscriptions are matched."""
        self.ros.spin_until(self._connected, 'publishers and subscriptions')

    def _connected(self) -> bool:
        if set(self.received) - set(self.node._outputs):
            return False
        ends = [*self.publishers.values(), *(self.node._outputs[name] for name in self.received)]
        return all(each.get_subscription_count() for each in ends)

    def send(self, name: str, *messages: Any) -> None:
        """Publish, and return when the node has every message in its queue, before it takes any."""
        from rclpy.duration import Duration

        for message in messages:
            self.publishers[name].publish(message)
        assert self.publishers[name].wait_for_all_acked(Duration(seconds=20)), f'{name} was not received'

    def take(self, name: str, *messages: Any) -> None:
        """Publish, and spin until the node has taken every message."""
        entry = self.node._freshness.inputs[name]
        wanted = entry.received + len(messages)
        self.send(name, *messages)
        self.ros.spin_until(lambda: entry.received >= wanted, f'{name} is taken')

    def deliver(self, name: str, *messages: Any) -> None:
        """Publish, and spin until the node has taken every message, and has published what it predicts from them."""
        self.take(name, *messages)
        self.ros.spin_until(lambda: not self.node.is_busy, 'the end of a prediction')

    def publish_scene(
        self, rows: Sequence[tuple[float, ...]] = ROWS, goals: Sequence[Sequence[float]] = GOALS, stamp_s: float = 10.0
    ) -> None:
        self.deliver('obstacles', cloud(TYPES, obstacle_table(rows), round(stamp_s * SECOND)))
        self.deliver('goals', pose_array(TYPES, goals))

    def move(self, poses: Iterable[Any]) -> None:
        """Publish hand poses one by one, each after the node has taken the one before."""
        for pose in poses:
            self.deliver('hand_pose', pose)

    def wait_for(self, name: str, count: int) -> list[Any]:
        self.ros.spin_until(lambda: len(self.received[name]) >= count, f'{count} messages of {name}')
        return self.received[name]

    def health(self) -> Any:
        """Return the status since the last one."""
        before = len(self._statuses())
        self.node._publish_health()
        self.ros.spin_until(lambda: len(self._statuses()) > before, 'diagnostics')
        return self._statuses()[-1]

    def _statuses(self) -> list[Any]:
        own = self.node.get_fully_qualified_name()
        return [array.status[0] for array in self.diagnostics if array.status[0].hardware_id == own]

    def call(self, kind: Any, name: str, **fields: Any) -> Any:
        return self.ros.call(self.player, kind, f'foc/{name}', kind.Request(**fields))

    def change(self, *transitions: str | int) -> bool:
        """Ask for transitions of the managed node, by label or number, until one is refused; return whether none was."""
        from lifecycle_msgs.msg import Transition
        from lifecycle_msgs.srv import ChangeState

        asked = [Transition(**{'label' if isinstance(each, str) else 'id': each}) for each in transitions]
        return all(self.call(ChangeState, 'change_state', transition=each).success for each in asked)

    @property
    def state(self) -> str:
        from lifecycle_msgs.srv import GetState

        return str(self.call(GetState, 'get_state').current_state.label)

    def set(self, **values: Any) -> Any:
        """Set parameters, whose names have `__` in place of a dot, together."""
        from rcl_interfaces.srv import SetParametersAtomically
        from rclpy.parameter import Parameter

        given = [Parameter(name.replace('__', '.'), value=value).to_parameter_msg() for name, value in values.items()]
        return self.call(SetParametersAtomically, 'set_parameters_atomically', parameters=given).result


def begin(ros: Graph, poses: int = 0, **options: Any) -> Bench:
    """Return a bench whose node has the scene and has taken so many hand poses."""
    bench = Bench(ros, **options)
    bench.publish_scene()
    bench.move(hand_path(poses))
    return bench


def list_labels(table: Any) -> list[str]:
    """Return the labels of the candidates in a table of likelihoods, without the shares that none has."""
    return [label for label in table.layout.dim[0].label.split(';') if label not in ('', UNKNOWN, OTHER)]


def figures(status: Any) -> dict[str, str]:
    return {entry.key: entry.value for entry in status.values}


def stamps(messages: Iterable[Any]) -> list[int]:
    return [message.header.stamp.sec * SECOND + message.header.stamp.nanosec for message in messages]
