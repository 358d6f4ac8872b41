# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""How a row is timed, and what it reports."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

Times = dict[str, list[float]]
"""Durations [s] of each task, by the name of the task."""


@dataclass(frozen=True)
class Result:
    """Measurement of one row.

    ours, peer: what was timed, in words; ours_ms, peer_ms: the medians of its times [ms]; agree: whether the answers differ by no
    more than the tolerance; agreement: the difference in words; details: further numbers by name.
    """

    ours: str
    ours_ms: float
    peer: str
    peer_ms: float
    agree: bool
    agreement: str
    repetitions: int
    details: dict[str, Any] = field(default_factory=dict)

    def to_json(self) -> dict[str, Any]:
        """Return the result as a JSON object; ratio: how many times as long the peer takes."""
        return {**vars(self), 'ratio': self.peer_ms / self.ours_ms}


def time_call(task: Callable[[], object]) -> float:
    """Return the time of a call [s]."""
    began = time.perf_counter()
    task()
    return time.perf_counter() - began


def time_in_turn(tasks: Mapping[str, Callable[[], object]], repetitions: int) -> Times:
    """Run all tasks once untimed, then one after the other `repetitions` times, and return the times.

    Because the tasks take turns, any other load of the machine slows all of them alike.
    """
    times: Times = {name: [] for name in tasks}
    for task in tasks.values():
        task()
    for _ in range(repetitions):
        for name, task in tasks.items():
            times[name].append(time_call(task))
    return times


def compute_median_ms(times: list[float]) -> float:
    """Return the median of times [s] in milliseconds."""
    return 1e3 * statistics.median(times)
