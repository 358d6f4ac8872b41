"""SIGINT and SIGTERM as a flag that a loop looks at.

rclpy's own handlers shut the context down in the middle of whatever is going on; a node then ends with an error in some of its
stops. A flag ends it between two callbacks, always in the same way.
"""

from __future__ import annotations

import signal
from types import FrameType


class StopSignals:
    """Sets :attr:`requested` when the process is asked to stop; stays in place until the process ends."""

    def __init__(self) -> None:
        self.requested = False
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, self._request)

    def _request(self, _number: int, _frame: FrameType | None) -> None:
        self.requested = True
