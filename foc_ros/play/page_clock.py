"""The clock of the page, and the stamps of what it sends."""

from __future__ import annotations

from foc_ros.core.errors import InputError

AHEAD_MS = 1000.0
"""Time by which a message may be ahead of the clock of the page, as it is known from the messages before [ms]."""
NANOSECONDS_PER_MS = 1_000_000


class PageClock:
    """Gives times of the page's clock stamps of the clock of this computer.

    A message can only be late. So the difference of the two clocks is that of the message that took the shortest time, which is
    about that of the network: nothing on one computer, some milliseconds on a wireless network.
    """

    def __init__(self) -> None:
        self._offset_ns: int | None = None
        self._last_ms = -1.0
        self._last_ns = 0

    def stamp(self, t_ms: float, received_ns: int) -> int | None:
        """Return the stamp [ns] of a time [ms], which is not after received_ns; raises InputError for a time out of order.

        The first messages may have taken long. When a quicker one shows it, the stamps would step back: they are None until they
        have passed the last one again.
        """
        offset_ns = received_ns - round(t_ms * NANOSECONDS_PER_MS)
        if t_ms <= self._last_ms:
            raise InputError('hand.t', f'a time after the last one, {self._last_ms:.1f} ms', t_ms)
        if self._offset_ns is not None and self._offset_ns - offset_ns > AHEAD_MS * NANOSECONDS_PER_MS:
            latest = (received_ns - self._offset_ns) / NANOSECONDS_PER_MS + AHEAD_MS
            raise InputError('hand.t', f'a time before {latest:.1f} ms', t_ms)
        self._offset_ns = offset_ns if self._offset_ns is None else min(offset_ns, self._offset_ns)
        self._last_ms = t_ms
        stamp_ns = round(t_ms * NANOSECONDS_PER_MS) + self._offset_ns
        if stamp_ns <= self._last_ns:
            return None
        self._last_ns = stamp_ns
        return stamp_ns
