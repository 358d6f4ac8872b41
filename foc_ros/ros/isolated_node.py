"""An isolated ROS graph on this host, and the node as a process in it."""

from __future__ import annotations

import ctypes
import os
import signal
import socket
import subprocess
import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from importlib import import_module
from pathlib import Path
from types import TracebackType

import foc_ros
from foc_ros.core.errors import FocError

DOMAINS = range(1, 102)
"""Domains whose ports are below the ephemeral ports of Linux."""
STOP_S = 5.0
"""Seconds after SIGTERM at which a node that is still running is killed."""
_PR_SET_PDEATHSIG = 1
_PRCTL = ctypes.CDLL(None).prctl if sys.platform == 'linux' else None
"""Loaded here: between fork and exec of a process with threads, a library must not be loaded."""


class NodeDiedError(FocError):
    """The node ended unexpectedly or did not connect."""


def private_environment(domain: int, log_directory: Path) -> dict[str, str]:
    """Return environment variables of a ROS graph in a domain on this host only, with its logs in a directory."""
    removed = ('ROS_LOCALHOST_ONLY', 'ROS_STATIC_PEERS', 'ROS_DISCOVERY_SERVER')
    inherited = {name: value for name, value in os.environ.items() if name not in removed}
    package = str(Path(foc_ros.__file__).parents[1])
    return inherited | {
        'ROS_DOMAIN_ID': str(domain),
        'ROS_AUTOMATIC_DISCOVERY_RANGE': 'LOCALHOST',
        'ROS_LOG_DIR': str(log_directory),
        'PYTHONPATH': os.pathsep.join(filter(None, [package, os.environ.get('PYTHONPATH')])),
        'PYTHONUNBUFFERED': '1',
    }


def free_domain() -> int:
    """Return a domain without participants on this host: one in which the first ports that DDS uses are free."""
    start = os.getpid()
    candidates = [DOMAINS[(start + turn) % len(DOMAINS)] for turn in range(len(DOMAINS))]
    return next((domain for domain in candidates if _is_free(domain)), candidates[0])


def _is_free(domain: int) -> bool:
    base = 7400 + 250 * domain
    for port in (base, base + 10):
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
            try:
                probe.bind(('', port))
            except OSError:
                return False
    return True


@contextmanager
def set_environment(values: Mapping[str, str]) -> Iterator[None]:
    """Set environment variables within a context."""
    before = dict(os.environ)
    os.environ.update(values)
    try:
        yield
    finally:
        os.environ.clear()
        os.environ.update(before)


class NodeProcess:
    """The node as a process that starts on entering the context and has ended on leaving it.

    It also ends with the thread that started it.

    environment: variables of the process; log: file for its output.
    """

    def __init__(self, environment: dict[str, str], log: Path) -> None:
        self._environment = environment
        self._log = log

    def __enter__(self) -> NodeProcess:
        import_module('foc_ros.core.pipeline')  # compiles the kernels before a node has to answer in time
        with self._log.open('wb') as log:
            self._process = subprocess.Popen(
                [sys.executable, '-m', 'foc_ros', 'node'],
                env=self._environment,
                stdin=subprocess.DEVNULL,
                stdout=log,
                stderr=subprocess.STDOUT,
                start_new_session=True,  # Ctrl-C does not reach the node: __exit__ ends it
                preexec_fn=_end_with_parent,  # noqa: PLW1509 (one system call, without a lock)
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
        """Raise NodeDiedError with the last lines of output if the node has ended."""
        code = self._process.poll()
        if code is not None:
            lines = self._log.read_text(encoding='utf-8', errors='replace').strip().splitlines()[-5:]
            raise NodeDiedError(f'the node ended with exit code {code}: {" | ".join(lines) or "it printed nothing"}')


def _end_with_parent() -> None:
    """Let Linux end the node if this process is killed and cannot do so."""
    if _PRCTL is not None:
        _PRCTL(_PR_SET_PDEATHSIG, signal.SIGTERM)
