# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The planned steps of one iteration of the solver: the rows of the QPs, and what their solutions promise."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from foc_ros.core.registry import QP_BACKENDS
from foc_ros.core.types import Array

from .gradients import linearise
from .iterates import Iterates
from .margin import NO_CONTACTS, Contacts, Indices, Margins
from .minima import mark_lowest
from .objective import Objective
from .qp import ReducedQP, number_rows, solve_dual

BESIDE = 0.6
"""Time on both sides of a contact with a polygon at which there are rows too, because its margin may have a kink [steps].

These rows hold the mean where it is then, so that a contact slides by about as much in an iteration.
"""
APART = 0.25
"""Least time between other rows of an obstacle and one that is added, for a contact of the last QP or for a place over which a
path would leap [steps]. Along a side there may be two contacts; more rows keep them from sliding."""
SAME = 1e-3
"""Time between contacts that count as one [steps]."""
HELD = 1e-5
"""Multiplier, relative to the largest one and to one that changes ln J by 1 over the scene, from which a contact holds the mean
off: the QP gives a small one to every row."""
FREE = 1e-3
"""Part of the wanted safety factor that is missing where it is chosen with the control."""
ROUNDS = 3
"""Most times that rows are added to a QP for places at which its solution breaks margins."""
LEAP = 1e-3
"""Broken margin, relative to the scene, for which a row is added."""
CURVED = 1.0
"""Gain of a step below which second derivatives of the margins count: farther away they tell nothing."""
ACCURACY = 3e-10
"""Margin relative to the scene that counts as none: accuracy of a QP."""


@dataclass
class Plan:
    """The solutions of the QPs of r problems.

    rows (r,): the problems; step (r, 2N); k (r,): planned safety factors; gain, fall (r,): how much the loss falls to first
    order, and to second order; contacts and multipliers (q,): the rows of the QPs; further: those of them that were added.
    """

    rows: Indices
    step: Array
    k: Array
    gain: Array
    fall: Array
    contacts: Contacts
    multipliers: Array
    further: Contacts

    def replace(self, other: Plan) -> Plan:
        """Return the plans with those of some of the problems replaced."""
        place = np.searchsorted(self.rows, other.rows)
        for mine, new in ((self.step, other.step), (self.k, other.k), (self.gain, other.gain), (self.fall, other.fall)):
            mine[place] = new
        kept = ~self.contacts.mark(other.rows)
        contacts = self.contacts.take(kept).join(other.contacts)
        multipliers = np.concatenate((self.multipliers[kept], other.multipliers))
        return Plan(self.rows, self.step, self.k, self.gain, self.fall, contacts, multipliers, other.further)


class Planner:
    """Plans the steps of an iteration: it chooses the rows of the QPs and solves them.

    Parameters
    ----------
    margins : Margins
        The margins of b problems.
    objective : Objective
        Their objectives.
    wanted_k : Array
        Wanted safety factors, (b,); they may change between the iterations.
    """

    def __init__(self, margins: Margins, objective: Objective, wanted_k: Array) -> None:
        self.margins, self.objective, self.wanted_k = margins, objective, wanted_k
        self._backend = QP_BACKENDS.get(margins.problems[0].qp_backend)

    def plan(self, now: Iterates) -> Plan:
        """Return the solutions of the QPs of all problems that are not done.

        Far from a solution a path may leap over an obstacle that has no row: there are rows wherever a QP would break margins.
        """
        plan = self.solve(now, np.flatnonzero(~now.is_done), now.trial)
        for _ in range(ROUNDS):
            broken = self._find_broken(now, plan, now.is_exact[plan.rows])
            if not len(broken.time):
                break
            plan = plan.replace(self.solve(now, np.unique(broken.problem), plan.further.join(broken)))
        return plan

    def _find_broken(self, now: Iterates, plan: Plan, is_wanted: NDArray[np.bool_]) -> Contacts:
        """Return the places on the grid at which wanted ones of planned steps would break margins, as far as normals tell."""
        rows = plan.rows[is_wanted]
        if not len(rows):
            return NO_CONTACTS
        moved = self.margins.find_step(plan.step[is_wanted])[:, :, None]
        margin = now.at.margin[rows] + (now.at.normal[rows] * moved).sum(axis=1)
        row, obstacle, place = np.nonzero(mark_lowest(margin) & (margin < -LEAP * self.margins.extent[rows, None, None]))
        found = Contacts(rows[row], obstacle, self.margins.times[place])
        return found.take(~_is_known(found, plan.contacts, APART))

    def solve(self, now: Iterates, rows: Indices, further: Contacts) -> Plan:
        """Return the solutions of the QPs of some problems (r,); further: places that have rows besides the contacts."""
        margins, objective = self.margins, self.objective
        places, known = self._choose_places(now, rows, further)
        at, control, k_now = np.searchsorted(rows, places.problem), now.control[rows], now.k[rows]
        is_free = (k_now > 0.0) & (k_now < self.wanted_k[rows] * (1.0 - FREE))
        gradients = linearise(margins, places, control[at], k_now[at], known > 0.0, is_free[at])
        is_near = ~((now.gain >= CURVED) & np.isfinite(now.gain))[places.problem[known > 0.0]]
        gradients = gradients._replace(weights=gradients.weights * is_near[:, None, None])
        quadratic = objective.expand(rows, control, now.at.cost[rows])
        numbered, wanted = number_rows(at, len(rows)), self.wanted_k[rows]
        short = gradients.value - gradients.stddev_rate * (wanted - k_now)[at]
        qp = ReducedQP(quadratic, numbered, gradients, known)
        value, rate = numbered.spread(gradients.value), numbered.spread(gradients.stddev_rate)
        counts, multipliers = np.bincount(at, minlength=len(rows)).tolist(), np.zeros((len(rows), numbered.width))
        linear = numbered.spread(short) - qp.gram[:, :-1, -1]
        for row, (problem, n) in enumerate(zip(rows.tolist(), counts, strict=True)):
            if n:
                square = qp.gram[row, :n, :n] + np.diag(qp.soften[row, :n])
                worth = float(wanted[row]), float(objective.rate[problem]), float(objective.floor[problem])
                multipliers[row, :n] = solve_dual(self._backend, square, linear[row, :n], rate[row, :n], *worth)
        step = qp.find_step(multipliers)
        moved = (qp.contact_rows @ step[..., None])[..., 0]
        left = value + moved + ACCURACY * margins.extent[rows, None]
        is_there = np.arange(numbered.width) < np.array(counts)[:, None]
        reached = np.divide(left, rate, out=np.full_like(left, np.inf), where=is_there & (rate > 0.0))
        k = np.minimum(k_now + reached.min(axis=1, initial=np.inf), wanted)
        gain = objective.compute_penalty(rows, now.at.factor[rows]) - objective.compute_penalty(rows, k)
        slope = (quadratic.gradient * step).sum(axis=1)
        gain -= slope
        fall = gain - 0.5 * ((multipliers * moved).sum(axis=1) - slope)
        largest = np.maximum(multipliers.max(axis=1, initial=0.0), 1.0 / margins.extent[rows])
        multipliers[multipliers < HELD * largest[:, None]] = 0.0
        return Plan(rows, step, k, np.maximum(gain, 0.0), fall, places, multipliers[numbered.problem, numbered.slot], further)

    def _choose_places(self, now: Iterates, rows: Indices, further: Contacts) -> tuple[Contacts, Array]:
        """Return the places at which the QPs have rows, and what is known of their multipliers."""
        margins, last = self.margins, float(self.margins.steps)
        minima = now.at.contacts.take(now.at.contacts.mark(rows))
        kept = now.contacts.mark(rows) & (now.multipliers > 0.0)
        held, multipliers = now.contacts.take(kept), now.multipliers[kept]
        more = [(further.take(further.mark(rows)), SAME), (held, APART)]
        is_polygon = margins.is_polygon[minima.problem, minima.obstacle]
        if margins.between and is_polygon.any():
            kinks = minima.take(is_polygon)
            times = (np.clip(kinks.time + apart, 1.0, last) for apart in (-BESIDE, BESIDE))
            more += [(Contacts(kinks.problem, kinks.obstacle, time), SAME) for time in times]
        places = minima
        for others, apart in more:
            if len(others.time):
                places = places.join(others.take(~_is_known(others, places, apart)))
        return places, _move_multipliers(held, multipliers, places)


def _is_known(places: Contacts, known: Contacts, apart: float) -> NDArray[np.bool_]:
    """Return whether each place is less than a time [steps] apart from a known one, (q,)."""
    same = (places.problem[:, None] == known.problem) & (places.obstacle[:, None] == known.obstacle)
    found: NDArray[np.bool_] = (same & (np.abs(places.time[:, None] - known.time) < apart)).any(axis=1)
    return found


def _move_multipliers(held: Contacts, multipliers: Array, places: Contacts) -> Array:
    """Return the multipliers of contacts at the places to which they have moved: the nearest ones of the same obstacle, (q,)."""
    known = np.zeros(len(places.time))
    if not len(multipliers) or not len(known):
        return known
    apart = np.abs(held.time[:, None] - places.time)
    apart[(held.problem[:, None] != places.problem) | (held.obstacle[:, None] != places.obstacle)] = np.inf
    nearest = apart.argmin(axis=1)
    is_there = np.isfinite(apart[np.arange(len(nearest)), nearest])
    np.add.at(known, nearest[is_there], multipliers[is_there])
    return known
