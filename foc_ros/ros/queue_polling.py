"""Polling of a subscription whose messages arrive so often that the executor would do little else than wake up for them."""

from __future__ import annotations

from collections.abc import Callable
from time import monotonic
from typing import Any

from rclpy.callback_groups import MutuallyExclusiveCallbackGroup
from rclpy.clock import Clock, ClockType
from rclpy.node import Node

POLL_S = 0.005
"""Time between two polls, and between two messages below which polling begins [s]."""


class QueuePolling(MutuallyExclusiveCallbackGroup):
    """A callback group whose subscription wakes the executor up while its messages are rare, and is polled while they are not.

    One wake-up of the executor costs more than the processing of several messages. Polling ends with the first poll without a
    message, because a message waits for up to `POLL_S`.

    Parameters
    ----------
    node
        The node of the subscription.
    poll
        Takes the messages that wait, and returns whether there were any.
    """

    def __init__(self, node: Node, poll: Callable[[], bool]) -> None:
        super().__init__()
        self._poll = poll
        self._last_s = float('-inf')
        self._timer = node.create_timer(POLL_S, self._tick, clock=Clock(clock_type=ClockType.STEADY_TIME))
        self._timer.cancel()

    def can_execute(self, entity: Any) -> bool:
        """Return whether the executor waits for the subscription."""
        return self._timer.is_canceled() and bool(super().can_execute(entity))

    def note_message(self) -> None:
        """Begin to poll if the message before arrived just now."""
        now_s = monotonic()
        if now_s - self._last_s < POLL_S and self._timer.is_canceled():
            self._timer.reset()
        self._last_s = now_s

    def _tick(self) -> None:
        if not self._poll():
            self._timer.cancel()
