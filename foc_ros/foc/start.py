"""Where the search for a solution begins: at a guess, or at the last tick's solution moved on in time."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from .contacts import Contacts
from .problem import Problem
from .qp import effort_cost, to_goal
from .records import Array, Solution


@dataclass(frozen=True, eq=False)
class Start:
    """Positions (N, 2) at steps 1..N [m] to linearise at.

    From an earlier solution also its stacked control (2N,), its contacts, its lambda and its slope (0 where not known); lam is
    None for a cold start, which has none of these.
    """

    positions: Array
    control: Array | None = None
    contacts: Contacts = field(default_factory=Contacts)
    lam: float | None = None
    slope: float = 0.0


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
    control = to_the_goal(problem, np.where(inside, previous.control[np.where(inside, held, 0)].T, 0.0).ravel(), previous.lam)
    row = {identity: index for index, identity in enumerate(problem.obstacles.ids)}
    kept = [
        (row[identity], moved, force)
        for identity, time, force in previous.multipliers
        if identity in row and 1 <= (moved := (time * previous.dt - elapsed_s) / dt) <= steps
    ]
    table = np.array(kept, dtype=float).reshape(-1, 3)
    contacts = Contacts(table[:, 0].astype(np.intp), table[:, 1].copy(), table[:, 2].copy())
    return Start(positions, control, contacts, previous.lam, previous.slope)


def to_the_goal(problem: Problem, control: Array, lam: float) -> Array:
    """Return a control (2N,) led to the goal again with least cost: the hand is never quite where it was to be."""
    _, root, factor = effort_cost(problem, lam).factors
    rows, targets, _ = problem.goal_rows
    led: Array = control + to_goal(root, factor, targets - rows @ control)
    return led
