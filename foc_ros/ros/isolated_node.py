# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""An isolated ROS graph on this host, and the node as a process in it."""

from __future__ import annotations

import ctypes
import os
import signal
import socket
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from itertools import count, islice
from pathlib import Path

import foc_ros
from foc_ros.core.errors import FocError

DOMAINS = range(1, 102)
"""Domains whose ports are below the ephemeral ports of Linux."""
_turns = count(37 * os.getpid())
"""The domains are taken in turn, and processes that start one after another begin far from each other."""
_PRCTL = ctypes.CDLL(None).prctl if sys.platform == 'linux' else None
"""Loaded here: between fork and exec of a process with threads, a library must not be loaded."""


class NodeDiedError(FocError):
    """The node ended unexpectedly or did not connect."""


@contextmanager
def reserve_domain() -> Iterator[int]:
    """Yield a domain in which no other program of this host has a participant, and reserve it within the context.

    The ports for the discovery of all participants and of each of the first ten have to be free (DDSI-RTPS, 9.6.1). The
    reservation is a port of the domain that DDS does not use.
    """
    for turn in islice(_turns, len(DOMAINS)):
        domain = DOMAINS[turn % len(DOMAINS)]
        base = 7400 + 250 * domain
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as reserved:
            try:
                reserved.bind(('', base + 5))
                for port in (0, *range(10, 30, 2)):
                    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
                        probe.bind(('', base + port))
            except OSError:
                continue
            yield domain
            return
    raise FocError(f'each of the {len(DOMAINS)} domains that can be used on this host has a participant')


@contextmanager
def isolated_graph() -> Iterator[Path]:
    """Join a ROS graph of its own within the context, also with new processes; yield the folder for its logs."""
    before, package = dict(os.environ), str(Path(foc_ros.__file__).parents[1])
    with tempfile.TemporaryDirectory(prefix='foc_ros_graph_') as logs, reserve_domain() as domain:
        try:
            for name in ('ROS_LOCALHOST_ONLY', 'ROS_STATIC_PEERS', 'ROS_DISCOVERY_SERVER'):
                os.environ.pop(name, None)
            os.environ |= {
                'ROS_DOMAIN_ID': str(domain),
                'ROS_AUTOMATIC_DISCOVERY_RANGE': 'LOCALHOST',
                'ROS_LOG_DIR': logs,
                'PYTHONPATH': os.pathsep.join(filter(None, [package, os.environ.get('PYTHONPATH')])),
                'PYTHONUNBUFFERED': '1',
            }
            yield Path(logs)
        finally:
            os.environ.clear()
            os.environ.update(before)


class NodeProcess:
    """The node as a process that starts on entering the context, and has ended on leaving it or with the thread that started it.

    log: file for its output; arguments: those of ROS. Attributes: pid; is_clean, whether it has ended, without an error.
    """

    def __init__(self, log: Path, *arguments: str) -> None:
        self._log, self._arguments = log, arguments

    def __enter__(self) -> NodeProcess:
        with self._log.open('wb') as log:
            self._process = subprocess.Popen(  # noqa: S603  the arguments are those of the program
                [sys.executable, '-m', 'foc_ros', 'node', *self._arguments],
                stdin=subprocess.DEVNULL,
                stdout=log,
                stderr=subprocess.STDOUT,
                start_new_session=True,  # Ctrl-C does not reach the node: __exit__ ends it
                # Linux ends the node (PR_SET_PDEATHSIG) if this process is killed and cannot do so: one call, without a lock
                preexec_fn=_PRCTL and (lambda: _PRCTL(1, signal.SIGTERM)),  # noqa: PLW1509
            )
        self.pid, self.is_clean = self._process.pid, False
        return self

    def __exit__(self, *_: object) -> None:
        self._process.terminate()
        try:
            self._process.wait(5.0)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        self.is_clean = self._process.returncode == 0 and 'Traceback' not in self._log.read_text(errors='replace')

    def check(self) -> None:
        """Raise NodeDiedError with the last lines of output if the node has ended."""
        code = self._process.poll()
        if code is not None:
            lines = self._log.read_text(encoding='utf-8', errors='replace').strip().splitlines()[-5:]
            raise NodeDiedError(f'the node ended with exit code {code}: {" | ".join(lines) or "it printed nothing"}')
