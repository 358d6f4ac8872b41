"""What was refused, dropped or failed: counted by kind, and the last refusal in words, so that nothing passes silently."""

from __future__ import annotations

from collections import Counter

from .errors import InputError
from .types import NANOSECONDS


class Rejections:
    """Attributes: counts, by kind; refused, how many refusals; last, the text of the last one, None before the first."""

    def __init__(self) -> None:
        self.counts: Counter[str] = Counter()
        self.refused = 0
        self.last: str | None = None

    def count(self, kind: str) -> None:
        """Count what happened without a refusal."""
        self.counts[kind] += 1

    def refuse(self, kind: str, words: str) -> None:
        """Count a refusal and keep its text."""
        self.counts[kind] += 1
        self.refused += 1
        self.last = words

    def behind(self, kind: str, topic: str, stamp_ns: int, newest_ns: int) -> None:
        """Refuse a stamp [ns] that is not after the newest one."""
        seconds = (newest_ns - stamp_ns) / NANOSECONDS
        self.refuse(kind, f'{topic}: the stamp {stamp_ns} ns is {seconds:g} s behind the newest one, {newest_ns} ns')

    def in_frame(self, kind: str, topic: str, frame_id: str, working: str | None) -> bool:
        """Return whether a frame is the working one, or none is fixed yet; refuse it otherwise, naming both."""
        if working is None or frame_id == working:
            return True
        self.refuse(kind, str(InputError(f'{topic}.header.frame_id', f"the working frame '{working}'", f"'{frame_id}'")))
        return False
