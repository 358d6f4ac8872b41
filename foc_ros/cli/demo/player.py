"""Plays a recording to a node over DDS in real time, and keeps and writes down what comes back."""

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
from foc_ros.ros.messages.outputs import OUTPUTS

from .node_process import NodeDiedError
from .recorder import Recorder

NODE = '/foc'
READ = ('prediction', 'likelihoods', 'diagnostics')
"""Outputs that the ledger is told of; all are written down."""
CONNECT_S = 30.0
"""Seconds within which the node has to be there: it starts in about one."""
AGAIN_S = 0.2
"""Seconds between two attempts to tell the node of the scene."""
QUIET_S = 0.5
"""Seconds of silence after which the last answer has come."""
LAST_ANSWER_S = 5.0
DEPTH = 200
"""Of every queue: seconds of outputs, so that none is lost while we draw."""


class Player:
    """A node of ours in a given domain that publishes a recording's raw messages and subscribes to the outputs.

    items: the recording, in order; bag: where inputs and outputs are written, at the time in the recording at which they were
    sent and received; ledger: told of all that passes. Use as a context manager.
    """

    def __init__(self, items: Sequence[Item], bag: BagWriter, ledger: Recorder, domain: int) -> None:
        self._items, self._bag, self._ledger, self._domain = items, bag, ledger, domain
        self._began: float | None = None
        self._heard = 0.0
        self._outputs: list[str] = []

    def __enter__(self) -> Player:
        self._context = rclpy.Context()
        rclpy.init(context=self._context, args=[], domain_id=self._domain, signal_handler_options=SignalHandlerOptions.NO)
        self._node = Node('foc_demo', context=self._context, enable_rosout=False, start_parameter_services=False)
        self._executor = SingleThreadedExecutor(context=self._context)
        self._executor.add_node(self._node)
        # offered for whatever the node asks for
        lasting = QoSProfile(depth=DEPTH, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        roles = sorted({item.role for item in self._items})
        self._publishers = {
            role: self._node.create_publisher(_message_class(topics.TYPES[role]), role, DEPTH if role == topics.HAND else lasting)
            for role in roles
        }
        for name, (kind, _) in OUTPUTS.items():
            self._listen(f'{NODE}/{name}', kind)
        self._listen('/diagnostics', 'diagnostic_msgs/msg/DiagnosticArray')
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self._executor.shutdown()
        self._node.destroy_node()
        self._context.try_shutdown()
        self._context.destroy()

    def connect(self, tick: Callable[[], bool]) -> bool:
        """Wait until the node hears us and has the scene; False where tick ends it, NodeDiedError when it takes too long.

        Both ends of a topic match at their own time, and what is sent in between is lost. So the first message of every input but
        the hand is sent until the node's diagnostics count the obstacles and the goals.
        """
        deadline = time.monotonic() + CONNECT_S
        first = {item.role: item for item in reversed(self._items) if item.role != topics.HAND}
        while (missing := self._unmatched()) or not self._ledger.scene_known:
            if time.monotonic() > deadline:
                raise NodeDiedError(f'the node did not connect within {CONNECT_S:g} s: {", ".join(missing) or "no scene"}')
            if not missing:
                for item in first.values():
                    self._publishers[item.role].publish(bytes(item.raw))
            self._listen_for(AGAIN_S)
            if not tick():
                return False
        return True

    def play(self, tick: Callable[[], bool]) -> None:
        """Publish every message when its time has come, and listen until the last answer; ends early where tick says so."""
        self._began = time.monotonic()
        for item in self._items:
            left_ns = 1
            while left_ns > 0:
                left_ns = item.log_ns - self._now_ns(time.monotonic())
                self._executor.spin_once(timeout_sec=max(left_ns / NANOSECONDS, 0.0))
                if not tick():
                    return
            self._send(item)
        self._heard = time.monotonic()
        until = self._heard + LAST_ANSWER_S
        while time.monotonic() < min(until, self._heard + QUIET_S) and tick():
            self._listen_for(0.05)

    def _listen_for(self, seconds: float) -> None:
        until = time.monotonic() + seconds
        while (left := until - time.monotonic()) > 0.0:
            self._executor.spin_once(timeout_sec=left)

    def _now_ns(self, now: float) -> int:
        """Return the time in the recording."""
        assert self._began is not None
        return self._items[0].log_ns + int((now - self._began) * NANOSECONDS)

    def _send(self, item: Item) -> None:
        self._publishers[item.role].publish(bytes(item.raw))
        now = time.monotonic()
        self._ledger.sent(item, now)
        self._bag.write_raw(f'/{item.role}', topics.TYPES[item.role], item.raw, self._now_ns(now))

    def _listen(self, topic: str, kind: str) -> None:
        name = topic.rpartition('/')[2]

        def receive(raw: bytes) -> None:
            now = time.monotonic()
            if self._began is not None:
                self._bag.write_raw(topic, kind, raw, self._now_ns(now))
            if name in READ:
                self._ledger.received(name, TYPESTORE.deserialize_cdr(raw, kind), now)
            if name == 'prediction':
                self._heard = now

        self._node.create_subscription(_message_class(kind), topic, receive, DEPTH, raw=True)
        self._outputs.append(topic)

    def _unmatched(self) -> list[str]:
        waiting = [f'/{role}' for role, publisher in self._publishers.items() if not publisher.get_subscription_count()]
        return waiting + [topic for topic in self._outputs if not self._node.count_publishers(topic)]


def _message_class(kind: str) -> Any:
    package, _, name = kind.split('/')
    return getattr(import_module(f'{package}.msg'), name)
