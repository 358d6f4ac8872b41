# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The program `foc_ros`, also as `python -m foc_ros COMMAND`.

An interrupt ends it with a line and the exit code 130, as in a shell, even in an import. The node needs ROS and a numeric library
or two; the other commands need more. What of it is missing is said in one sentence.
"""

from __future__ import annotations

import os
import signal
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from importlib.util import find_spec
from types import FrameType
from typing import Any

COMMANDS_NEED = ('cyclopts', 'joblib', 'mcap', 'pydantic', 'rich', 'rosbags')
"""Packages of the commands that the node does without."""
INTERRUPTED = 130


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command and return the exit code; arguments: those of the process by default, without its name."""
    try:
        with handle_interrupts():
            return _run(arguments)
    except KeyboardInterrupt:
        return _say_interrupted()


def _say_interrupted() -> int:
    """Print that the program was interrupted, below Python's streams, which may be in use, and return the exit code."""
    with suppress(OSError):
        os.write(2, b'foc_ros: stopped\n')
    return INTERRUPTED


def _run(arguments: Sequence[str] | None) -> int:
    missing = [name for name in COMMANDS_NEED if find_spec(name) is None]
    if not missing:
        from .cli.main import main as run

        return run(arguments)
    given = list(sys.argv[1:] if arguments is None else arguments)
    if given[:1] == ['node'] and find_spec('rclpy') is not None:
        from .ros.main import main as run_node

        return run_node(given[1:])
    names = ' '.join(missing)
    print(f'foc_ros: this command needs packages that are not installed: pip install {names}', file=sys.stderr)
    return 2


@contextmanager
def handle_interrupts() -> Iterator[None]:
    """Raise KeyboardInterrupt on SIGINT within the context; during an import, end the process at once with `INTERRUPTED`.

    Some extension modules lose an exception that is raised while they import another one. An import has nothing to clean up.
    """
    before: Callable[..., Any] | int | None = signal.getsignal(signal.SIGINT)
    if before is not signal.default_int_handler:
        yield
        return

    def interrupt(_: int, frame: FrameType | None) -> None:
        while frame is not None:
            if frame.f_globals.get('__name__') == 'importlib._bootstrap':
                os._exit(_say_interrupted())
            frame = frame.f_back
        raise KeyboardInterrupt

    signal.signal(signal.SIGINT, interrupt)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, signal.default_int_handler)


if __name__ == '__main__':
    sys.exit(main())
