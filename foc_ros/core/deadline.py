"""The time by which a solve has to end. It is checked before every QP."""

from __future__ import annotations

import time


class OutOfTimeError(Exception):
    """The deadline has passed. This exception stays inside the numeric core, which turns it into a status."""


class Deadline:
    """A moment to be checked against the clock. A result that is ready in time does not depend on it.

    Parameters
    ----------
    seconds
        Time allowed [s]; None for no limit.
    began
        When that time began, by `time.perf_counter()` [s]; None for now.
    """

    def __init__(self, seconds: float | None = None, began: float | None = None) -> None:
        self.at = None if seconds is None else (time.perf_counter() if began is None else began) + seconds

    def check(self) -> None:
        """Raise OutOfTimeError if the deadline has passed."""
        if self.at is not None and time.perf_counter() > self.at:
            raise OutOfTimeError


NEVER = Deadline()
