"""Where the search for a solution begins: at a guess, or at the last tick's solution moved on in time."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from foc_ros.core.kernels import Matrix, Vector, compiled
from foc_ros.core.types import Array, Solution

from .contacts.contacts import Contacts
from .problem import Problem


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


def cold_start(guess: Array) -> Start:
    """Start at a guess (N + 1, 2) [m] at steps 0..N."""
    return Start(np.asarray(guess, dtype=float)[1:])


def warm_start(previous: Solution, problem: Problem) -> Start:
    """Start at an earlier solution, read off at the new steps so that both reach their goal at the same time.

    Before its beginning the hand is where it began, after its end it rests at its goal.
    """
    steps, dt = problem.horizon.steps, problem.horizon.dt
    elapsed_s = previous.dt * len(previous.control) - dt * steps
    positions, control = resample_solution(previous.mean, previous.control, previous.dt, elapsed_s, dt, steps)
    row = {identity: index for index, identity in enumerate(problem.obstacles.ids)}
    kept = [
        (row[identity], moved, force)
        for identity, time, force in previous.multipliers
        if identity in row and 1 <= (moved := (time * previous.dt - elapsed_s) / dt) <= steps
    ]
    table = np.array(kept, dtype=float).reshape(-1, 3)
    contacts = Contacts(table[:, 0].astype(np.intp), table[:, 1].copy(), table[:, 2].copy())
    return Start(positions, control, contacts, previous.lam, previous.slope)


@compiled
def resample_solution(
    mean: Matrix, control: Matrix, before: float, elapsed_s: float, dt: float, steps: int
) -> tuple[Matrix, Vector]:
    """Return positions (steps, 2) and the stacked control (2 steps,) at new steps of dt [s], the first elapsed_s later.

    mean (n + 1, states), its position first, and control (n, 2) at steps of `before` [s]; without control before they begin, and
    after they end.
    """
    n = len(control)
    positions, stacked = np.empty((steps, 2)), np.zeros(2 * steps)
    for t in range(steps):
        place = (elapsed_s + dt * (t + 1)) / before
        held = min(max(int(np.floor(place)), 0), n - 1)
        share = min(max(place - held, 0.0), 1.0)
        during = int(np.floor(place - 0.5 * dt / before))
        for axis in range(2):
            positions[t, axis] = (1.0 - share) * mean[held, axis] + share * mean[held + 1, axis]
            if 0 <= during < n:
                stacked[axis * steps + t] = control[during, axis]
    return positions, stacked


def correct_to_goal(problem: Problem, control: Array, path: Array) -> Array:
    """Lead a control (2N,) back to a path (N, 2) and to the goal: the hand is never quite where it was to be."""
    missing = problem.goal - problem.free[-1] - problem.horizon.last @ control
    led: Array = control + problem.horizon.returning(path - problem.positions(control), missing, problem.at_goal)
    return led
