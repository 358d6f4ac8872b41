# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""A process that computes predictions, so that the threads of the node, such as guidance, need not wait for Python's lock."""

from __future__ import annotations

import multiprocessing
import signal
import sys
import traceback
from collections.abc import Callable
from mmap import mmap
from multiprocessing.connection import Connection
from typing import Any

from foc_ros.core.pipeline import PredictionTask
from foc_ros.core.prediction import Prediction
from foc_ros.core.tracks import Tracks


class Worker:
    """Computes one prediction at a time in a process that is forked from this one, and so knows all parts registered so far.

    Begin it while this process has one thread. Outside of Linux, where some libraries cannot be forked, predictions are computed
    in this process. The same happens once the other process is gone; `warn` is then called with a text.
    """

    def __init__(self, warn: Callable[[str], object]) -> None:
        self._warn, self._is_stopped = warn, False
        self._process: Any = None
        self._is_cancelled = mmap(-1, 1)  # memory that both processes share
        if sys.platform != 'linux':
            return
        context = multiprocessing.get_context('fork')
        self._end, far_end = context.Pipe()
        arguments = self._end, far_end, self._is_cancelled
        self._process = context.Process(target=_serve, args=arguments, name='prediction', daemon=True)
        self._process.start()
        far_end.close()

    def run(self, task: PredictionTask) -> tuple[Prediction, Tracks]:
        """Return or raise what `task.run` does; to be called in one thread."""
        if self._process is None:
            return task.run()
        self._is_cancelled[0] = 0
        task.deadline.share(self._is_cancelled)
        try:
            self._end.send(task)
            result: tuple[Prediction, Tracks] | Exception = self._end.recv()
        except (EOFError, OSError):
            if self._is_stopped:
                raise
            self._process.join()
            text = f'the process of the predictions ended with exit code {self._process.exitcode}'
            self._warn(f'{text}: the node computes them itself now, and guidance may be less even')
            self._process = None
            return task.run()
        if isinstance(result, Exception):
            raise result
        return result

    def stop(self) -> None:
        """End the process; a prediction that it computes ends with an EOFError."""
        self._is_stopped = True
        if self._process is not None:
            self._process.kill()
            self._process.join()


def _serve(near_end: Connection, end: Connection, is_cancelled: mmap) -> None:
    """Answer with a result for each task, until the other process closes its end or is gone."""
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, signal.SIG_IGN)  # of a group of processes; the other one decides
    near_end.close()
    while True:
        try:
            task = end.recv()
        except EOFError:
            return
        task.deadline.share(is_cancelled)
        try:
            result = task.run()
        except Exception as error:
            error.add_note(f'in the process of the predictions: {traceback.format_exc()}')
            result = error
        end.send(result)
