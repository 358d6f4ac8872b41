"""Rejected input and failures: counted by kind, with the last rejection in words."""

from __future__ import annotations

from collections import Counter

from .errors import InputError
from .types import NANOSECONDS


class Rejections:
    """Attributes: counts, by kind; refused, number of rejections; last, the text of the last one, None before the first."""

    def __init__(self) -> None:
        self.counts: Counter[str] = Counter()
        self.refused = 0
        self.last: str | None = None

    def count(self, kind: str) -> None:
        """Count an event that is no rejection."""
        self.counts[kind] += 1

    def reject(self, kind: str, message: str) -> None:
        """Count a rejection and keep its text."""
        self.counts[kind] += 1
        self.refused += 1
        self.last = message

    def reject_stamp(self, kind: str, topic: str, stamp_ns: int, newest_ns: int) -> None:
        """Reject a stamp [ns] that is not after the newest one."""
        if stamp_ns == newest_ns:
            self.reject(kind, f'{topic}: stamps repeat: {stamp_ns} ns is that of the message before')
            return
        seconds = (newest_ns - stamp_ns) / NANOSECONDS
        self.reject(kind, f'{topic}: the stamp {stamp_ns} ns is {seconds:g} s behind the newest one, {newest_ns} ns')

    def accept_frame(self, kind: str, topic: str, frame_id: str, working: str | None) -> bool:
        """Return whether a frame is the working one, or none is fixed yet; otherwise reject it and name both."""
        if working is None or frame_id == working:
            return True
        self.reject(kind, str(InputError(f'{topic}.header.frame_id', f"the working frame '{working}'", f"'{frame_id}'")))
        return False
