# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The thread in which predictions are computed, so that the node answers services and publishes diagnostics meanwhile.

A running computation cannot be stopped from another thread. If its result is no longer wanted, its deadline is cancelled, it
ends when it next checks its deadline, and the result is ignored.
"""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor, wait
from dataclasses import dataclass

from rclpy.node import Node

from foc_ros.core.pipeline import PredictionTask
from foc_ros.core.prediction import Prediction
from foc_ros.core.tracks import Tracks


@dataclass(frozen=True)
class Computation:
    """A task, when its hand pose arrived and it began [s, steady clock], and its result: the prediction and the tracks."""

    task: PredictionTask
    received_s: float
    start_s: float
    result: Future[tuple[Prediction, Tracks]]


class Worker:
    """A thread that computes one task at a time. Attributes: present, the computation whose result was not taken yet, or None.

    node: in whose executor `notify` is called after the end of each computation. `notify` has to call `take`.
    """

    def __init__(self, node: Node, notify: Callable[[], None]) -> None:
        self.present: Computation | None = None
        self._node, self._notify, self._is_stopped = node, notify, False
        self._threads = ThreadPoolExecutor(1, 'prediction')

    def start(self, task: PredictionTask, received_s: float, start_s: float) -> None:
        """Begin to compute a task. The result of the task before must have been taken."""
        self.present = Computation(task, received_s, start_s, self._threads.submit(task.run))

        def announce(_: object) -> None:  # in the thread of the computation
            executor = self._node.executor
            if executor is not None and not self._is_stopped:
                executor.create_task(self._notify)

        self.present.result.add_done_callback(announce)

    def take(self) -> Computation | None:
        """Return the present computation and forget it, if it has ended; otherwise return None."""
        if self.present is None or not self.present.result.done():
            return None
        ended, self.present = self.present, None
        return ended

    def is_busy_after(self, seconds: float) -> bool:
        """Wait for the end of the present computation, at most for some seconds; return whether it still runs then."""
        return self.present is not None and bool(wait([self.present.result], seconds).not_done)

    def stop(self) -> None:
        """Accept no more tasks, and let the present one end when it next checks its deadline; its end is not announced."""
        self._is_stopped = True
        if self.present is not None:
            self.present.task.deadline.cancel()
        self._threads.shutdown(wait=False)  # a cancelled future that no thread has taken would never count as done
