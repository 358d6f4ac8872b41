"""The node as a process of its own in a ROS graph of its own, gone when we are."""

from __future__ import annotations

import ctypes
import os
import signal
import socket
import subprocess
import sys
from pathlib import Path
from types import TracebackType

import foc_ros
from foc_ros.foc.errors import FocError

DOMAINS = range(1, 102)
"""Domains whose ports lie below the ephemeral ones of Linux."""
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


def private_environment(domain: int, log_directory: Path) -> dict[str, str]:
    """Return the environment of a ROS graph that stays on this host, in a domain of its own, and logs into a directory."""
    inherited = {
        name: value
        for name, value in os.environ.items()
        if name not in ('ROS_LOCALHOST_ONLY', 'ROS_STATIC_PEERS', 'ROS_DISCOVERY_SERVER')
    }
    package = str(Path(foc_ros.__file__).parents[1])
    return inherited | {
        'ROS_DOMAIN_ID': str(domain),
        'ROS_AUTOMATIC_DISCOVERY_RANGE': 'LOCALHOST',
        'ROS_LOG_DIR': str(log_directory),
        'PYTHONPATH': os.pathsep.join(filter(None, [package, os.environ.get('PYTHONPATH')])),
        'PYTHONUNBUFFERED': '1',
    }


def free_domain() -> int:
    """Return a domain that nobody on this host is in, told by the ports that DDS gives to its first participant."""
    start = os.getpid()
    candidates = [DOMAINS[(start + turn) % len(DOMAINS)] for turn in range(len(DOMAINS))]
    return next((domain for domain in candidates if _unused(domain)), candidates[0])


def _unused(domain: int) -> bool:
    base = 7400 + 250 * domain
    for port in (base, base + 10):
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
            try:
                probe.bind(('', port))
            except OSError:
                return False
    return True
