# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The time by which a prediction has to end. It is checked before every QP, every graph and every path search."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass


class OutOfTimeError(Exception):
    """The deadline has passed. This exception stays inside the numeric core, which turns it into a status."""


@dataclass
class StepTimes:
    """The longest time between two checks of a deadline, or of those taken from it [s], and the moment of the last one."""

    longest_s: float = 0.0
    checked_at: float = math.inf

    def add(self) -> None:
        """Add the time since the last check."""
        now = time.perf_counter()
        self.longest_s, self.checked_at = max(self.longest_s, now - self.checked_at), now


class Deadline:
    """A moment to be checked against the clock. A result that is ready in time does not depend on it.

    Parameters
    ----------
    seconds
        Time allowed [s]; None for no limit.
    began
        When that time began, by `time.perf_counter()` [s]; None for now.
    whole
        A deadline that holds as well.
    goes_on
        Whether a later prediction continues this one, so that what hardly matters may wait for it.
    """

    def __init__(
        self,
        seconds: float | None = None,
        began: float | None = None,
        whole: Deadline | None = None,
        *,
        goes_on: bool = False,
    ) -> None:
        self.at = None if seconds is None else (time.perf_counter() if began is None else began) + seconds
        self._whole, self.goes_on = whole, goes_on
        self.step_times: StepTimes = StepTimes() if whole is None else whole.step_times

    @property
    def left_s(self) -> float:
        """Time that is left [s], negative after the deadline."""
        left_s = math.inf if self.at is None else self.at - time.perf_counter()
        return left_s if self._whole is None else min(left_s, self._whole.left_s)

    @property
    def has_passed(self) -> bool:
        """Whether the deadline has passed."""
        return self.left_s < 0.0

    def cancel(self) -> None:
        """Let the time end now, also for a computation in another thread, and for the deadlines taken from this one."""
        self.at = -math.inf

    def allows(self, seconds: float = 0.0) -> bool:
        """Tell whether there is time for a step of so many seconds, and for one as long as the longest so far."""
        is_whole = self._whole is None or self._whole.allows(seconds)
        return is_whole and self.left_s >= max(seconds, self.step_times.longest_s)

    def check(self, seconds: float = 0.0) -> None:
        """Raise OutOfTimeError if the deadline does not allow the next step, which takes some seconds if that is known.

        The steps so far are the times between two checks, also of deadlines taken from the same one.
        """
        self.step_times.add()
        if not self.allows(seconds):
            raise OutOfTimeError

    def take_share(self, share: float, reserve_s: float = 0.0) -> Deadline:
        """Return an earlier deadline, at a share of the time that is left, less a reserve [s]."""
        return Deadline(None if self.at is None else share * self.left_s - reserve_s, whole=self)


NEVER = Deadline()
