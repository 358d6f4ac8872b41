"""How a row is timed, and what it reports."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any

Times = dict[str, list[float]]
"""Durations [s] of each task, by the name of the task."""

GAIN, COST = 'peer / ours', 'ours / peer'
"""The two ratios: a gain is to be large, a cost is to be small."""


@dataclass(frozen=True)
class Target:
    """Bound of a ratio: a lower one for a gain, an upper one for a cost."""

    bound: float
    is_lower: bool

    def is_met_by(self, ratio: float) -> bool:
        """Return whether the ratio is on the required side of the bound."""
        return ratio >= self.bound if self.is_lower else ratio <= self.bound

    def __str__(self) -> str:
        return f'{"≥" if self.is_lower else "≤"} {self.bound:g}'


def at_least(bound: float) -> Target:
    """Return a lower bound."""
    return Target(bound, is_lower=True)


def at_most(bound: float) -> Target:
    """Return an upper bound."""
    return Target(bound, is_lower=False)


@dataclass(frozen=True)
class Timing:
    """What was timed, in words, and the median of its times [ms]."""

    description: str
    median_ms: float


@dataclass(frozen=True)
class Agreement:
    """Whether the answers of both sides differ by no more than the tolerance, and the difference in words."""

    holds: bool
    description: str


@dataclass(frozen=True)
class Result:
    """Measurement of one row.

    `ratio_of` is GAIN or COST. `target` is None for a row that is measured for the record only. `details` are further numbers by
    name.
    """

    ours: Timing
    peer: Timing
    ratio_of: str
    agreement: Agreement
    repetitions: int
    target: Target | None = None
    details: dict[str, Any] = field(default_factory=dict)

    @property
    def ratio(self) -> float:
        """Ratio of the medians."""
        ours, peer = self.ours.median_ms, self.peer.median_ms
        return peer / ours if self.ratio_of == GAIN else ours / peer

    @property
    def is_met(self) -> bool | None:
        """Whether the answers agree and the ratio meets its target; None without a target."""
        return None if self.target is None else self.agreement.holds and self.target.is_met_by(self.ratio)

    def to_json(self) -> dict[str, Any]:
        """Return the result as a JSON object."""
        return {
            'ours': self.ours.description,
            'peer': self.peer.description,
            'ours_ms': self.ours.median_ms,
            'peer_ms': self.peer.median_ms,
            'ratio': self.ratio,
            'ratio_of': self.ratio_of,
            'agree': self.agreement.holds,
            'agreement': self.agreement.description,
            'repetitions': self.repetitions,
            'target': None if self.target is None else str(self.target),
            'met': self.is_met,
            'details': self.details,
        }


def time_in_turn(tasks: Mapping[str, Callable[[], object]], repetitions: int) -> Times:
    """Run all tasks once untimed, then one after the other `repetitions` times, and return the times.

    Because the tasks take turns, any other load of the machine slows all of them alike.
    """
    times: Times = {name: [] for name in tasks}
    for task in tasks.values():
        task()
    for _ in range(repetitions):
        for name, task in tasks.items():
            began = time.perf_counter()
            task()
            times[name].append(time.perf_counter() - began)
    return times


def compute_median_ms(times: list[float]) -> float:
    """Return the median of times [s] in milliseconds."""
    return 1e3 * statistics.median(times)


class Stopwatch:
    """Sum of the time [s] that wrapped functions take."""

    def __init__(self) -> None:
        self.seconds = 0.0

    def wrap(self, function: Callable[..., Any]) -> Callable[..., Any]:
        """Return the function; each call of it adds its duration to `seconds`."""

        def timed(*arguments: Any, **keywords: Any) -> Any:
            began = time.perf_counter()
            try:
                return function(*arguments, **keywords)
            finally:
                self.seconds += time.perf_counter() - began

        return timed


@contextmanager
def replace_attribute(module: object, name: str, value: object) -> Iterator[None]:
    """Replace `module.name` by another value inside the context."""
    original = getattr(module, name)
    setattr(module, name, value)
    try:
        yield
    finally:
        setattr(module, name, original)


@contextmanager
def time_calls(module: object, name: str) -> Iterator[Stopwatch]:
    """Time every call of `module.name` inside the context."""
    stopwatch = Stopwatch()
    with replace_attribute(module, name, stopwatch.wrap(getattr(module, name))):
        yield stopwatch
