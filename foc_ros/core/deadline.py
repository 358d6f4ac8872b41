"""A time by which a solve has to end: looked at before every QP."""

from __future__ import annotations

import time


class OutOfTimeError(Exception):
    """The deadline has passed. Never leaves the numeric core: it becomes a status."""


class Deadline:
    """Passes `seconds` after it is made, or after `began`; never for None. A result that comes in time does not depend on it.

    began: by time.perf_counter() [s].
    """

    def __init__(self, seconds: float | None = None, began: float | None = None) -> None:
        self.at = None if seconds is None else (time.perf_counter() if began is None else began) + seconds

    def check(self) -> None:
        """Raise OutOfTimeError once the deadline has passed."""
        if self.at is not None and time.perf_counter() > self.at:
            raise OutOfTimeError


NEVER = Deadline()
