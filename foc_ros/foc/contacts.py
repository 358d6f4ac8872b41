"""Where the mean is held off circles: obstacle, time and force of each contact."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from .records import Array
from .solver import Index, WorkingSet

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

    def merged(self) -> Contacts:
        """Return the contacts in order, neighbours with the same circle as one: at the centre of their forces, with their sum."""
        order = np.lexsort((self.time, self.obstacle))
        obstacle, time, force = self.obstacle[order], self.time[order], self.force[order]
        first = np.flatnonzero(np.concatenate(([True], (np.diff(obstacle) != 0) | (np.diff(time) > MERGED)))[: len(self)])
        total: Array = np.add.reduceat(force, first) if len(first) else force
        turned: Array = np.add.reduceat(force * time, first) if len(first) else time
        return Contacts(obstacle[first], turned / total, total)
