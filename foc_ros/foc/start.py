"""Where the search for a solution begins: at a guess, or at the last tick's solution moved on in time."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from .problem import Problem
from .records import Array, Solution
from .solver import Row, WorkingSet, rows_of


@dataclass(frozen=True, eq=False)
class Start:
    """Positions (N, 2) at steps 1..N [m] to linearise at.

    From an earlier solution also its stacked control (2N,), its active rows with their multipliers, and its lambda; lam is
    None for a cold start, which has none of these.
    """

    positions: Array
    control: Array | None = None
    active: WorkingSet = field(default_factory=WorkingSet)
    multipliers: Array = field(default_factory=lambda: np.zeros(0))
    lam: float | None = None


def cold(guess: Array) -> Start:
    """Start at a guess (N + 1, 2) [m] at steps 0..N."""
    return Start(np.asarray(guess, dtype=float)[1:])


def warm(previous: Solution, problem: Problem) -> Start:
    """Start at an earlier solution, read off at the new steps so that both reach their goal at the same time.

    Before its beginning the hand is where it began, after its end it rests at its goal.
    """
    steps, dt = problem.horizon.steps, problem.horizon.dt
    elapsed_s = previous.dt * len(previous.control) - dt * steps
    times = elapsed_s + dt * np.arange(1, steps + 1)
    positions = np.stack([np.interp(times, previous.times, axis) for axis in previous.path.T], axis=1)
    held = np.floor((times - dt / 2) / previous.dt).astype(np.intp)
    inside = (held >= 0) & (held < len(previous.control))
    control = np.where(inside, previous.control[np.where(inside, held, 0)].T, 0.0)
    row = {identity: index for index, identity in enumerate(problem.obstacles.ids)}
    kept: dict[Row, float] = {}
    for identity, step, value in previous.multipliers:
        moved = round((step * previous.dt - elapsed_s) / dt)
        if identity in row and 1 <= moved <= steps:
            kept[row[identity], moved - 1] = kept.get((row[identity], moved - 1), 0.0) + value
    return Start(positions, control.ravel(), *rows_of(kept), previous.lam)
