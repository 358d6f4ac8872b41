"""Polling of a subscription whose messages arrive so often that the executor would do little else than wake up for them."""

from __future__ import annotations

from collections.abc import Callable
from time import monotonic
from typing import Any

from rclpy.callback_groups import MutuallyExclusiveCallbackGroup
from rclpy.executors import Executor

POLL_S = 0.005
"""Shortest wait for a poll, and time between two messages below which polling goes on [s]."""
LONGEST_S = 0.02
"""Longest wait for a poll [s]."""


class QueuePolling(MutuallyExclusiveCallbackGroup):
    """A callback group whose subscription wakes the executor up while its messages are rare, and is polled while they are not.

    One wake-up of the executor costs more than the processing of several messages. A poll is no callback, because the executor
    prepares to wait twice after each callback. There are no polls unless :meth:`spin_once` is called in place of the executor's.
    Polling ends when the messages since the last poll were not more frequent than one in `POLL_S`, because the messages of a slow
    hand would wait for the polls.

    Parameters
    ----------
    poll
        Takes the messages that wait, and returns their number.
    find_unneeded_s
        Returns for how long no message is needed [s].
    """

    def __init__(self, poll: Callable[[], int], find_unneeded_s: Callable[[], float]) -> None:
        super().__init__()
        self._poll, self._find_unneeded_s = poll, find_unneeded_s
        self._last_s = float('-inf')
        self._is_allowed = False
        self._waiting = 0
        self.is_polling = False

    def can_execute(self, entity: Any) -> bool:
        """Return whether the executor waits for the subscription."""
        return not self.is_polling and bool(super().can_execute(entity))

    def note_message(self) -> None:
        """Begin to poll if the message before arrived just now."""
        now_s = monotonic()
        self.is_polling = self._is_allowed and now_s - self._last_s < POLL_S
        self._last_s = now_s

    def spin_once(self, executor: Executor, timeout_s: float) -> None:
        """Spin once, for a time at most [s], and poll after it if the messages come so often."""
        self._is_allowed = True
        wait_s = min(max(self._find_unneeded_s(), POLL_S), LONGEST_S) if self.is_polling else timeout_s
        executor.spin_once(timeout_sec=min(wait_s, timeout_s))
        if not self.is_polling:
            return
        number, now_s = self._waiting + self._poll(), monotonic()
        self.is_polling, self._waiting = now_s - self._last_s < POLL_S * max(number, 1), 0
        if number and self.is_polling:
            self._last_s = now_s

    def take(self) -> None:
        """Take the messages that wait, between two polls. The next poll counts them as its own."""
        self._waiting += self._poll()
