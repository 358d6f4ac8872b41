"""The node as a process of its own in a ROS graph of its own, gone when we are."""

from __future__ import annotations

import ctypes
import signal
import subprocess
import sys
from importlib import import_module
from pathlib import Path
from types import TracebackType

from foc_ros.core.errors import FocError

STOP_S = 5.0
"""Seconds the node is given to end by itself."""
_PR_SET_PDEATHSIG = 1


class NodeDiedError(FocError):
    """The node ended before it was told to, or does not answer."""


class NodeProcess:
    """The node, started on entering and ended on leaving the context, however that happens.

    environment: of the process; log: file for what it prints. Raises NodeDiedError from :meth:`check`.
    """

    def __init__(self, environment: dict[str, str], log: Path) -> None:
        self._environment = environment
        self._log = log

    def __enter__(self) -> NodeProcess:
        import_module('foc_ros.core.pipeline')  # compiles the kernels where nobody waits for a node to answer
        with self._log.open('wb') as log:
            self._process = subprocess.Popen(
                [sys.executable, '-m', 'foc_ros', 'node'],
                env=self._environment,
                stdin=subprocess.DEVNULL,
                stdout=log,
                stderr=subprocess.STDOUT,
                start_new_session=True,  # Ctrl-C is ours to handle: the node is ended below
                preexec_fn=_end_with_parent,  # noqa: PLW1509 (no other thread runs yet)
            )
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self._process.terminate()
        try:
            self._process.wait(STOP_S)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()

    @property
    def pid(self) -> int:
        """The process id."""
        return self._process.pid

    def check(self) -> None:
        """Raise NodeDiedError, with the last lines it printed, if the node has ended."""
        code = self._process.poll()
        if code is not None:
            lines = self._log.read_text(encoding='utf-8', errors='replace').strip().splitlines()[-5:]
            raise NodeDiedError(f'the node ended with exit code {code}: {" | ".join(lines) or "it printed nothing"}')


def _end_with_parent() -> None:
    """Have Linux end the node when we are killed in a way that leaves us no time to do so."""
    if sys.platform == 'linux':
        ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGTERM)
