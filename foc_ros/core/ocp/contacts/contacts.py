"""Contacts of the mean with obstacles, as data."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from foc_ros.core.kernels import Indices, Vector, compiled, freeze
from foc_ros.core.ocp.working_set import WorkingSet
from foc_ros.core.types import Array

MERGE_DISTANCE = 1.5
"""Distance in steps up to which neighbouring contacts with one obstacle become one: rows at steps straddle a contact."""


class Contacts(NamedTuple):
    """k contacts, with frozen arrays.

    obstacle (k,): row of the obstacle; time (k,): in steps from now, fractions allowed; multiplier (k,): how much the cost grows
    with each metre more of distance to keep [m/s^6].
    """

    obstacle: Indices
    time: Vector
    multiplier: Vector

    @staticmethod
    def at_steps(rows: WorkingSet, multipliers: Array) -> Contacts:
        """Return the contacts of obstacle rows, which hold at steps, with their multipliers (k,)."""
        return freeze(Contacts(rows.obstacle, rows.step.astype(np.float64) + 1.0, multipliers))

    def rows(self, steps: int) -> tuple[WorkingSet, Array]:
        """Return the rows at the nearest steps, each once, in order, and the multiplier of each."""
        step = np.clip(np.rint(self.time).astype(np.intp), 1, steps) - 1
        flat, which = np.unique(self.obstacle * steps + step, return_inverse=True)
        multiplier = np.zeros(len(flat))
        np.add.at(multiplier, which, self.multiplier)
        return WorkingSet(*np.divmod(flat, steps)), multiplier

    def merge(self, first_alike: Indices) -> Contacts:
        """Return one contact for each place, where these come from rows at steps or another problem: see `merge_contacts`."""
        return freeze(merge_contacts(self, first_alike))


NO_CONTACTS = freeze(Contacts(np.zeros(0, dtype=np.intp), np.zeros(0), np.zeros(0)))


@compiled
def merge_contacts(contacts: Contacts, first_alike: Indices) -> Contacts:
    """Return contacts in order, with neighbours on the same obstacle as one: at the centre of their multipliers, with their sum.

    first_alike (m,): for each obstacle the first that is the same. Unknown multipliers, as after a full QP, count as 1.
    """
    k, count = len(contacts.time), 0
    obstacle, time, weight = np.empty(k, np.intp), np.empty(k), np.empty(k)
    for i in range(k):
        j, place, multiplier = first_alike[contacts.obstacle[i]], i, contacts.multiplier[i]
        while place > 0 and (obstacle[place - 1] > j or (obstacle[place - 1] == j and time[place - 1] > contacts.time[i])):
            obstacle[place], time[place], weight[place] = obstacle[place - 1], time[place - 1], weight[place - 1]
            place -= 1
        obstacle[place], time[place] = j, contacts.time[i]
        weight[place] = multiplier if np.isfinite(multiplier) and multiplier > 0.0 else 1.0
    total, moment, last = np.zeros(k), np.zeros(k), -np.inf
    for i in range(k):
        if i == 0 or obstacle[i] != obstacle[count - 1] or time[i] - last > MERGE_DISTANCE:
            obstacle[count] = obstacle[i]
            count += 1
        last = time[i]
        total[count - 1] += weight[i]
        moment[count - 1] += weight[i] * time[i]
    return Contacts(obstacle[:count].copy(), moment[:count] / total[:count], total[:count].copy())
