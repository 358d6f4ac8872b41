"""Times of several tasks, taken in turn so that whatever else the machine does falls on all of them alike."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from typing import Any

Times = dict[str, list[float]]


def interleaved(tasks: Mapping[str, Callable[[], object]], repetitions: int) -> Times:
    """Return the times [s] of each task, run one after the other, `repetitions` times over; once before that, untimed."""
    times: Times = {name: [] for name in tasks}
    for task in tasks.values():
        task()
    for _ in range(repetitions):
        for name, task in tasks.items():
            began = time.perf_counter()
            task()
            times[name].append(time.perf_counter() - began)
    return times


def median_ms(times: list[float]) -> float:
    """Return the median of times [s] in milliseconds."""
    return 1e3 * statistics.median(times)


class Stopwatch:
    """Time spent inside of wrapped functions [s], summed."""

    def __init__(self) -> None:
        self.seconds = 0.0

    def around(self, function: Callable[..., Any]) -> Callable[..., Any]:
        """Return the function with its time added to `seconds`."""

        def timed(*arguments: Any, **named: Any) -> Any:
            began = time.perf_counter()
            try:
                return function(*arguments, **named)
            finally:
                self.seconds += time.perf_counter() - began

        return timed


@contextmanager
def watched(module: object, name: str) -> Iterator[Stopwatch]:
    """Time every call of `module.name` while the context lasts."""
    watch = Stopwatch()
    with replaced(module, name, watch.around(getattr(module, name))):
        yield watch


@contextmanager
def replaced(module: object, name: str, value: object) -> Iterator[None]:
    """Have another value under `module.name` while the context lasts."""
    original = getattr(module, name)
    setattr(module, name, value)
    try:
        yield
    finally:
        setattr(module, name, original)
