"""Where the mean is held off circles: obstacle, time and force of each contact."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from foc_ros.core.kernels import Indices, Vector, compiled
from foc_ros.core.ocp.working_set import Index, WorkingSet
from foc_ros.core.types import Array

MERGED = 1.5
"""Distance in steps at which two contacts with one circle are one, that rows at steps have to straddle."""


@dataclass(frozen=True, eq=False)
class Contacts:
    """k contacts: obstacle (k,), its row; time (k,) in steps from now, fractions allowed; force (k,), the multiplier [m/s^6]."""

    obstacle: Index = field(default_factory=lambda: np.zeros(0, dtype=np.intp))
    time: Array = field(default_factory=lambda: np.zeros(0))
    force: Array = field(default_factory=lambda: np.zeros(0))

    def __len__(self) -> int:
        return len(self.obstacle)

    @property
    def columns(self) -> tuple[Index, Array, Array]:
        """Obstacles, times and forces."""
        return self.obstacle, self.time, self.force

    @staticmethod
    def at_steps(rows: WorkingSet, multipliers: Array) -> Contacts:
        """Return obstacle rows, which hold at steps, with their multipliers (k,) as contacts."""
        return Contacts(rows.obstacle, rows.step.astype(np.float64) + 1.0, multipliers)

    def rows(self, steps: int) -> tuple[WorkingSet, Array]:
        """Return the rows at the nearest steps, each once, in order, and the force on each."""
        step = np.clip(np.rint(self.time).astype(np.intp), 1, steps) - 1
        flat, which = np.unique(self.obstacle * steps + step, return_inverse=True)
        force = np.zeros(len(flat))
        np.add.at(force, which, self.force)
        return WorkingSet(*np.divmod(flat, steps)), force


@compiled
def merge(obstacle: Indices, time: Vector, force: Vector, first_alike: Indices) -> tuple[Indices, Vector, Vector]:
    """Return contacts (k,) in order, neighbours with the same circle as one: at the centre of their forces, with their sum.

    first_alike (m,): for each circle the first that is the same. Forces that are not known, as the full QP leaves them, count
    as 1.
    """
    k, count = len(obstacle), 0
    circle, at, push = np.empty(k, np.intp), np.empty(k), np.empty(k)
    for i in range(k):
        j, place = first_alike[obstacle[i]], i
        while place > 0 and (circle[place - 1] > j or (circle[place - 1] == j and at[place - 1] > time[i])):
            circle[place], at[place], push[place] = circle[place - 1], at[place - 1], push[place - 1]
            place -= 1
        circle[place], at[place], push[place] = j, time[i], force[i] if np.isfinite(force[i]) and force[i] > 0.0 else 1.0
    total, turned, last = np.zeros(k), np.zeros(k), -np.inf
    for i in range(k):
        if i == 0 or circle[i] != circle[count - 1] or at[i] - last > MERGED:
            circle[count] = circle[i]
            count += 1
        last = at[i]
        total[count - 1] += push[i]
        turned[count - 1] += push[i] * at[i]
    return circle[:count].copy(), turned[:count] / total[:count], total[:count].copy()
