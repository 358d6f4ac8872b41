"""The real-time priority of a thread, under the scheduling policy SCHED_FIFO of Linux."""

from __future__ import annotations

import os
from collections.abc import Callable

REMEDY = 'allow it with `rtprio` in /etc/security/limits.d, or set guidance.realtime_priority to 0'


class ThreadPriority:
    """Sets the real-time priority of the thread that calls it. Threads started by that thread have an ordinary priority.

    A thread with such a priority runs before all ordinary threads of the machine, so it must do little and sleep often.

    Attributes: priority, in effect: 1 to 99, or 0 for an ordinary thread.

    Parameters
    ----------
    warn
        Called with a text the first time that a priority is not permitted.
    """

    def __init__(self, warn: Callable[[str], None]) -> None:
        self.priority = 0
        self._wanted = 0
        self._warn: Callable[[str], None] | None = warn

    def set(self, priority: int) -> None:
        """Set the priority if it differs from the one that was wanted last; 0: ordinary."""
        if priority == self._wanted:
            return
        self._wanted = priority
        try:
            policy = (os.SCHED_FIFO if priority else os.SCHED_OTHER) | os.SCHED_RESET_ON_FORK
            os.sched_setscheduler(0, policy, os.sched_param(priority))
        except (OSError, AttributeError) as error:  # Python has these on Linux only
            if self._warn is not None:
                self._warn(f'the real-time priority {priority} of guidance is not permitted ({error}): {REMEDY}')
                self._warn = None
            return
        self.priority = priority
