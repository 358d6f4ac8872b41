"""Plays a recording over DDS in real time to a node, and records the node's outputs."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from importlib import import_module
from types import TracebackType
from typing import Any

import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from rclpy.signals import SignalHandlerOptions

from foc_ros.core.types import NANOSECONDS
from foc_ros.io import topics
from foc_ros.io.bags import TYPESTORE, BagWriter, Item
from foc_ros.ros.isolated_node import NodeDiedError
from foc_ros.ros.messages.encode_prediction import OUTPUTS

from .recorder import Recorder

NODE = '/foc'
DECODED = ('prediction', 'likelihoods', 'diagnostics')
"""Outputs that the recorder receives; the bag holds all."""
CONNECT_S = 30.0
"""Timeout of the connection to the node, which starts in about one second."""
RETRY_S = 0.2
"""Seconds between two attempts to send the scene to the node."""
QUIET_S, LAST_ANSWER_S = 0.5, 5.0
"""After the last input the player ends once no prediction has arrived for QUIET_S, and at the latest after LAST_ANSWER_S."""
DEPTH = 200
"""Depth of every queue: outputs of several seconds, so that none is lost while the display is drawn."""


class Player:
    """A ROS node that publishes the raw messages of a recording and subscribes to the outputs of the predicting node.

    items: the recording, in order; bag: receives inputs and outputs at their times in the recording; recorder: receives the same
    messages decoded; domain: of the ROS graph. Use as a context manager.
    """

    def __init__(self, items: Sequence[Item], bag: BagWriter, recorder: Recorder, domain: int) -> None:
        self._items, self._bag, self._recorder, self._domain = items, bag, recorder, domain
        self._began: float | None = None
        self._last_received = 0.0
        self._outputs: list[str] = []

    def __enter__(self) -> Player:
        self._context = rclpy.Context()
        rclpy.init(context=self._context, args=[], domain_id=self._domain, signal_handler_options=SignalHandlerOptions.NO)
        self._node = Node('foc_demo', context=self._context, enable_rosout=False, start_parameter_services=False)
        self._executor = SingleThreadedExecutor(context=self._context)
        self._executor.add_node(self._node)
        # The node may ask for transient local inputs; only the stream of hand poses does without.
        latched = QoSProfile(depth=DEPTH, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        self._publishers = {
            role: self._node.create_publisher(_load_message(topics.TYPES[role]), role, DEPTH if role == topics.HAND else latched)
            for role in sorted({item.role for item in self._items})
        }
        for name, (kind, _) in OUTPUTS.items():
            self._subscribe(f'{NODE}/{name}', kind)
        self._subscribe('/diagnostics', 'diagnostic_msgs/msg/DiagnosticArray')
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self._executor.shutdown()
        self._node.destroy_node()
        self._context.try_shutdown()
        self._context.destroy()

    def connect(self, tick: Callable[[], bool]) -> bool:
        """Wait until all topics are connected and the node has the scene; return False if tick returns False before.

        The two ends of a topic discover each other at different times, and a message sent between is lost. So the first message
        of every input except the hand is repeated until the node's diagnostics count obstacles and goals. Raises NodeDiedError
        after CONNECT_S.
        """
        deadline = time.monotonic() + CONNECT_S
        first = {item.role: item for item in reversed(self._items) if item.role != topics.HAND}
        while (missing := self._find_unconnected()) or not self._recorder.is_scene_known:
            if time.monotonic() > deadline:
                raise NodeDiedError(f'the node did not connect within {CONNECT_S:g} s: {", ".join(missing) or "no scene"}')
            if not missing:
                for item in first.values():
                    self._publishers[item.role].publish(bytes(item.raw))
            self._spin(RETRY_S)
            if not tick():
                return False
        return True

    def play(self, tick: Callable[[], bool]) -> None:
        """Publish every message at its time and wait for the last prediction; end early if tick returns False."""
        self._began = time.monotonic()
        for item in self._items:
            left_ns = 1
            while left_ns > 0:
                left_ns = item.log_ns - self._recording_time_ns(time.monotonic())
                self._executor.spin_once(timeout_sec=max(left_ns / NANOSECONDS, 0.0))
                if not tick():
                    return
            self._send(item)
        self._last_received = time.monotonic()
        deadline = self._last_received + LAST_ANSWER_S
        while time.monotonic() < min(deadline, self._last_received + QUIET_S) and tick():
            self._spin(0.05)

    def _spin(self, seconds: float) -> None:
        end = time.monotonic() + seconds
        while (left := end - time.monotonic()) > 0.0:
            self._executor.spin_once(timeout_sec=left)

    def _recording_time_ns(self, now: float) -> int:
        assert self._began is not None
        return self._items[0].log_ns + int((now - self._began) * NANOSECONDS)

    def _send(self, item: Item) -> None:
        self._publishers[item.role].publish(bytes(item.raw))
        now = time.monotonic()
        self._recorder.add_sent(item, now)
        self._bag.write_raw(f'/{item.role}', topics.TYPES[item.role], item.raw, self._recording_time_ns(now))

    def _subscribe(self, topic: str, kind: str) -> None:
        name = topic.rpartition('/')[2]

        def receive(raw: bytes) -> None:
            now = time.monotonic()
            if self._began is not None:
                self._bag.write_raw(topic, kind, raw, self._recording_time_ns(now))
            if name in DECODED:
                self._recorder.add_received(name, TYPESTORE.deserialize_cdr(raw, kind), now)
            if name == 'prediction':
                self._last_received = now

        self._node.create_subscription(_load_message(kind), topic, receive, DEPTH, raw=True)
        self._outputs.append(topic)

    def _find_unconnected(self) -> list[str]:
        inputs = [f'/{role}' for role, publisher in self._publishers.items() if not publisher.get_subscription_count()]
        return inputs + [topic for topic in self._outputs if not self._node.count_publishers(topic)]


def _load_message(kind: str) -> Any:
    package, _, name = kind.split('/')
    return getattr(import_module(f'{package}.msg'), name)
