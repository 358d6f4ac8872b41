# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Plays a recording over DDS in real time to a node, and passes on what the node publishes."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial

import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from rclpy.signals import SignalHandlerOptions

from foc_ros.core.types import NANOSECONDS
from foc_ros.io import topics
from foc_ros.io.bags import Item

from .isolated_node import NodeDiedError
from .messages.types import find_message_class

CONNECT_S = 30.0
"""Timeout of the connection to the node, which starts in about one second."""
QUIET_S, LAST_ANSWER_S = 0.5, 5.0
"""After the last input the player ends once nothing has arrived for QUIET_S, and at the latest after LAST_ANSWER_S."""
DEPTH = 200
"""Depth of every queue: outputs of several seconds, so that none is lost while a display is drawn."""


class Player:
    """A ROS node, as a context, that publishes the raw messages of a recording and subscribes to the outputs of another node.

    tick: called all the time, returns False where the player is to end.
    """

    def __init__(
        self, items: Sequence[Item], outputs: Mapping[str, str], receive: Callable[[str, bytes], None], tick: Callable[[], bool]
    ) -> None:
        self._items, self._outputs, self._receive, self._tick = items, outputs, receive, tick
        self._last_received = 0.0

    def __enter__(self) -> Player:
        self._context = rclpy.Context()
        rclpy.init(context=self._context, args=[], signal_handler_options=SignalHandlerOptions.NO)
        self._node = Node('foc_player', context=self._context, enable_rosout=False, start_parameter_services=False)
        self._executor = SingleThreadedExecutor(context=self._context)
        self._executor.add_node(self._node)
        # The node may ask for transient local inputs; only the stream of hand poses does without.
        latched = QoSProfile(depth=DEPTH, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        kinds = {role: find_message_class(topics.TYPES[role]) for role in sorted({item.role for item in self._items})}
        self._publishers = {
            role: self._node.create_publisher(kind, role, DEPTH if role == topics.HAND else latched)
            for role, kind in kinds.items()
        }
        for topic, kind in self._outputs.items():
            self._node.create_subscription(find_message_class(kind), topic, partial(self._note, topic), DEPTH, raw=True)
        return self

    def __exit__(self, *_: object) -> None:
        self._executor.shutdown()
        self._node.destroy_node()
        self._context.try_shutdown()
        self._context.destroy()

    def connect(self, is_ready: Callable[[], bool]) -> bool:
        """Wait until all topics are connected and the other node is ready; return False if tick returns False before.

        A message that is sent before both ends of a topic have discovered each other is lost. So the first message of every input
        except the hand is repeated until the node has the scene. Raises NodeDiedError after CONNECT_S.
        """
        deadline = time.monotonic() + CONNECT_S
        first = {item.role: item for item in reversed(self._items) if item.role != topics.HAND}
        while (missing := self._find_unconnected()) or not is_ready():
            if time.monotonic() > deadline:
                raise NodeDiedError(f'the node did not connect within {CONNECT_S:g} s: {", ".join(missing) or "no scene"}')
            for item in () if missing else first.values():
                self._publishers[item.role].publish(bytes(item.raw))
            self._spin(0.2)
            if not self._tick():
                return False
        return True

    def play(self) -> Iterator[Item]:
        """Publish every message at its time, yield it, and wait for the last answer; end early if tick returns False."""
        began = time.monotonic()
        for item in self._items:
            due = began + (item.log_ns - self._items[0].log_ns) / NANOSECONDS
            while True:
                left = due - time.monotonic()
                self._executor.spin_once(timeout_sec=max(left, 0.0))
                if not self._tick():
                    return
                if left <= 0.0:
                    break
            self._publishers[item.role].publish(bytes(item.raw))
            yield item
        self._last_received = time.monotonic()
        deadline = self._last_received + LAST_ANSWER_S
        while time.monotonic() < min(deadline, self._last_received + QUIET_S) and self._tick():
            self._spin(0.05)

    def _note(self, topic: str, raw: bytes) -> None:
        self._last_received = time.monotonic()
        self._receive(topic, raw)

    def _spin(self, seconds: float) -> None:
        end = time.monotonic() + seconds
        while (left := end - time.monotonic()) > 0.0:
            self._executor.spin_once(timeout_sec=left)

    def _find_unconnected(self) -> list[str]:
        inputs = [f'/{role}' for role, publisher in self._publishers.items() if not publisher.get_subscription_count()]
        return inputs + [topic for topic in self._outputs if not self._node.count_publishers(topic)]
