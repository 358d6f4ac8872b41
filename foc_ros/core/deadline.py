# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The time by which a prediction has to end: looked at in the search for each class, and before each iteration of the solver."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass
from mmap import mmap
from typing import Any


@dataclass
class StepTimes:
    """The longest step of a computation so far [s], and when the present one began."""

    longest_s: float = 0.0
    began_at: float = math.inf

    def add(self) -> None:
        """Begin a step, which ends the one before."""
        now = time.perf_counter()
        self.longest_s, self.began_at = max(self.longest_s, now - self.began_at), now


class Deadline:
    """A moment to be checked against the clock. A result that is ready in time does not depend on it.

    Parameters
    ----------
    seconds
        Time allowed from now on [s]; None for no limit.
    whole
        A deadline that holds as well, and with which this one shares its steps.
    goes_on
        Whether a later prediction continues this one, so that what hardly matters may wait for it.
    """

    def __init__(self, seconds: float | None = None, whole: Deadline | None = None, *, goes_on: bool = False) -> None:
        self.at = None if seconds is None else time.perf_counter() + seconds
        self._whole, self.goes_on = whole, goes_on
        self._is_cancelled: bytearray | mmap = bytearray(1)
        self.step_times: StepTimes = StepTimes() if whole is None else whole.step_times

    @property
    def left_s(self) -> float:
        """Time that is left [s], negative after the deadline."""
        if self._is_cancelled[0]:
            return -math.inf
        left_s = math.inf if self.at is None else self.at - time.perf_counter()
        return left_s if self._whole is None else min(left_s, self._whole.left_s)

    @property
    def has_passed(self) -> bool:
        """Whether the deadline has passed."""
        return self.left_s < 0.0

    def cancel(self) -> None:
        """Let the time end now, also for a computation in another thread, and for the deadlines taken from this one."""
        self._is_cancelled[0] = 1

    def share(self, is_cancelled: bytearray | mmap) -> None:
        """Store the cancellation in one byte of given memory, which another process may read."""
        before, self._is_cancelled = self._is_cancelled, is_cancelled
        is_cancelled[0] |= before[0]

    def __getstate__(self) -> dict[str, Any]:
        return vars(self) | {'_is_cancelled': bytearray(1)}

    def allows(self) -> bool:
        """Tell whether there is time for a step as long as the longest so far."""
        return self.left_s >= self.step_times.longest_s

    def take_share(self, share: float) -> Deadline:
        """Return an earlier deadline, at a share of the time that is left."""
        return Deadline(None if self.at is None else share * self.left_s, whole=self)


NEVER = Deadline()
