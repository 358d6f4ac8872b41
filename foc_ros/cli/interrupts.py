"""An interrupt (Ctrl-C) always ends a command, and never with a traceback."""

from __future__ import annotations

import os
import signal
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

INTERRUPTED = 130
"""Exit code after an interrupt, as in a shell."""
DELAYED_S = 0.01
"""Time after which an interrupt is handled again if it arrived where an exception would be lost [s]."""
REPEATED_S = 2.0
"""Time after which an interrupt is repeated if the command has not ended, because a library may have caught it [s]."""
PATIENCE_S = 1.0
"""Longest time for which an interrupt waits for code in which an exception would be lost; after it the process is ended [s]."""

LOSING_MODULES = ('importlib._bootstrap', '_frozen_importlib')
"""Modules that native code calls without passing on an exception."""


@contextmanager
def handle_interrupts() -> Iterator[None]:
    """Raise KeyboardInterrupt on SIGINT within the context, and again until the context is left.

    Callbacks of the import system, and modules that an extension module imports, lose an exception. An interrupt that arrives
    there is delayed until this code has ended.
    """
    usual = signal.default_int_handler
    if signal.getsignal(signal.SIGINT) is not usual or threading.current_thread() is not threading.main_thread():
        yield
        return
    interrupt = _Interrupt()
    before = signal.signal(signal.SIGALRM, interrupt.handle)
    signal.signal(signal.SIGINT, interrupt.handle)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)
        signal.signal(signal.SIGINT, usual)


class _Interrupt:
    """The handler of SIGINT, and of the timer by which it is called again."""

    def __init__(self) -> None:
        self._began_s: float | None = None

    def handle(self, _number: int, frame: FrameType | None) -> None:
        """Raise KeyboardInterrupt, or set the timer if the exception would be lost in the present frame."""
        now_s = time.monotonic()
        self._began_s = now_s if self._began_s is None else self._began_s
        if not _loses_exceptions(frame):
            signal.setitimer(signal.ITIMER_REAL, REPEATED_S)
            raise KeyboardInterrupt
        if now_s - self._began_s > PATIENCE_S:
            os._exit(INTERRUPTED)
        signal.setitimer(signal.ITIMER_REAL, DELAYED_S)


def _loses_exceptions(frame: FrameType | None) -> bool:
    """Return whether an exception would be lost: in a frame without a file, as in a named tuple, or within `LOSING_MODULES`."""
    if frame is not None and frame.f_code.co_filename.startswith('<'):
        return True
    while frame is not None and not str(frame.f_globals.get('__name__')).startswith(LOSING_MODULES):
        frame = frame.f_back
    return frame is not None
