# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""One sequential QP for all strategies, and for all candidates of a prediction at once.

For each problem it finds a control u and a safety factor k with the least loss (`objective`)

    ln J(u) + rate max(0, k_wanted - k)    subject to    E u = e,  G_i(u; k) >= 0,

with the margins G_i where the obstacles hold the mean off (`margin`). In the logarithm, costs are compared as likelihoods compare
them, and the rate is what a unit of safety is worth: a class gives up as much of it as costs more. In each iteration the margins
are linearised where they are least, a QP is solved (`qp`), and a step is taken along its solution that does not pass an obstacle
on another side. Rows are added where the solution of the QP breaks margins, so that few are enough.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from foc_ros.core.deadline import NEVER, Deadline
from foc_ros.core.types import Array

from .iterates import Evaluation, Iterates
from .margin import Contacts, Indices, Margins
from .minima import find_minima
from .objective import Objective
from .planner import FREE, Plan, Planner

MOST_ITERATIONS = 150
"""Iterations after which a problem counts as not settled; ten are usual from a guess, three from an earlier solution."""
NEAR = 0.01
"""An obstacle has a row in the QP where its margin relative to the scene is below this, or its safety factor too small."""
LARGEST_RATE, GENTLE_RATE = 1e3, 5.0
"""Worth of a unit of safety in logarithms of cost where the wanted safety is a condition, and the one with which the search
begins where it is larger: at a guess, margins tell little of what they cost."""
ROUGH_GAIN = 1e-3
"""Gain, as a logarithm of cost, at which the search with the gentle worth ends."""
SMALL_GAIN, SMALL_FACTOR = 2e-8, 1e-9
"""Gain that a QP promises below which a problem is solved, and relative difference of a safety factor that is rounding."""
LAST_GAIN, LAST_MISS = 1e-4, 1e-3
"""Gain, as a logarithm of cost, that may remain when a problem counts as solved. A step that fails although its QP promised less
fails by rounding. In a later prediction, the last step may miss by the second number what its QP foretold."""
CLOSE, CLOSE_FOR_NOW = 3e-5, 1e-3
"""Relative excess over the wanted safety factor that is aimed at. With the first number, a step that misses its aim by rounding
meets the wanted factor. The second one holds where a later prediction goes on: a step may then miss by the error of its QP, and
is not repeated for that."""
UNLIKELY, SMALL_PART = 4.0, 0.1
"""A class can wait for the next prediction if it stays less likely than the best one to its goal by more than the first number,
as a logarithm, with all that its QP promises. At a guess QPs promise too little: there it waits only if that is less than the
second number as a part of what it is behind."""
TRUSTED = 3.0
"""Promised gain, as a logarithm of likelihood, above which no class waits: from a bad start, QPs promise too little."""
LARGEST_TOLERANCE = 5e-3
"""Gain of its last whole step up to which a class without the wanted eta counts as settled."""
MOST_TRIALS, SHORTER = 5, 0.35
"""Steps that are tried: the whole one, and a part of the last one each."""
SUFFICIENT = 1e-4
"""Share of the promised gain that a step has to bring."""
ROUNDING = 1e-11


class Solver:
    """The sequential QP of b problems.

    Parameters
    ----------
    margins : Margins
        The margins of the problems.
    wanted_k, rate : Array
        Wanted safety factor, and the worth of a unit of it in logarithms of cost, (b,).
    lam : Array
        Weight of the summed variances, (b,).
    goes_on : bool
        Whether what hardly matters for likelihoods may wait for the next prediction.
    """

    def __init__(self, margins: Margins, wanted_k: Array, rate: Array, lam: Array, *, goes_on: bool = False) -> None:
        problems = margins.problems
        self.margins, self.wanted_k = margins, wanted_k * (1.0 + (CLOSE_FOR_NOW if goes_on else CLOSE))
        self.objective = Objective(problems, wanted_k, rate, lam)
        self.gain = np.array([each.horizon.gain for each in problems])
        self.most, self._small_gain, self._goes_on = MOST_ITERATIONS, SMALL_GAIN, goes_on
        self._is_condition = np.array([each.preference.is_hard for each in problems])
        self._planner = Planner(margins, self.objective, self.wanted_k)

    def begin(
        self, control: Array, contacts: Contacts, multipliers: Array, k: Array, angles: Array, is_cold: NDArray[np.bool_]
    ) -> Iterates:
        """Return the iterates at controls (b, 2N) moved to their goals, in the classes of some swept angles (b, m).

        is_cold (b,): whether there is no earlier solution to go on from: more than a likelihood asks for is wanted there.
        """
        control, rows = self.objective.meet_goal(control), np.arange(len(control))
        at = self.evaluate(rows, control, k)
        k = np.clip(at.factor, 0.0, self.wanted_k)
        gain = np.full(len(rows), np.inf)
        bound, is_exact = at.loss.copy(), is_cold | (not self._goes_on)
        count, no = np.zeros_like(rows), [np.zeros(len(rows), dtype=np.bool_) for _ in range(4)]
        return Iterates(control, k, at, contacts, multipliers, angles, no[0], no[1], gain, count, bound, is_exact, no[2], no[3])

    def evaluate(self, rows: Indices, control: Array, k: Array) -> Evaluation:
        """Return what the sequence has to know of controls (r, 2N) of some problems, linearised at safety factors (r,)."""
        margins, objective = self.margins, self.objective
        motion = margins.move(rows, control)
        grid = margins.measure_grid(rows, motion, k)
        is_near = grid.value < NEAR * margins.extent[rows, None, None]
        is_near |= grid.factor < self.wanted_k[rows, None, None]
        contacts, factors = find_minima(margins, rows, motion, k, grid, is_near)
        least = np.full(len(rows), np.inf)
        np.minimum.at(least, np.searchsorted(rows, contacts.problem), factors)
        cost, angles = objective.compute_cost(rows, control), margins.sweep(rows, margins.find_path(motion))
        normal = np.stack((grid.normal_x, grid.normal_y), axis=1)
        loss = objective.compute_loss(rows, cost, least)
        return Evaluation(cost, loss, least, angles, grid.value, normal, grid.factor, contacts)

    def run(self, now: Iterates, deadline: Deadline = NEVER, most: int = MOST_ITERATIONS) -> None:
        """Advance all problems together, an iteration at a time, until they are solved or the time is up."""
        self.most, rate = most, self.objective.rate
        if (rate > GENTLE_RATE).any():
            self._set_rate(now, np.minimum(rate, GENTLE_RATE))
            self._run(now, deadline, ROUGH_GAIN)
            self._set_rate(now, rate)
        self._run(now, deadline, SMALL_GAIN)

    def _set_rate(self, now: Iterates, rate: Array) -> None:
        """Set the worth of safety, and let the sequence begin again where it is."""
        self.objective.set_rate(rate)
        now.at.loss = self.objective.compute_loss(np.arange(len(rate)), now.at.cost, now.at.factor)
        now.bound = now.at.loss.copy()
        now.is_done[:], now.is_settled[:] = False, False

    def _run(self, now: Iterates, deadline: Deadline, small_gain: float) -> None:
        """Advance the problems until their QPs promise a small gain."""
        self._small_gain = small_gain
        for count in range(self.most):
            # the first iteration is for everybody: a class that is found has a cost
            if now.is_done.all() or (count and not deadline.allows()):
                break
            deadline.step_times.add()
            self.advance(now)
            if self._goes_on:
                self._postpone(now)

    def _postpone(self, now: Iterates) -> None:
        """Leave classes to the next prediction that stay unlikely with all that their QPs promise.

        A class whose loss has just risen goes on, because what its QP has promised was not there.
        Where the wanted eta is a condition, every class is solved to its end: whether it meets eta decides, not what it costs.
        """
        behind = self.objective.compare(now.at.loss)
        enough = np.minimum(np.where(now.is_exact, SMALL_PART * behind, behind - UNLIKELY), TRUSTED)
        is_enough = (behind > UNLIKELY) & (self.objective.beta * now.gain < enough) & (now.at.loss < now.bound)
        now.is_waiting |= ~now.is_done & is_enough & ~self._is_condition
        now.is_done |= now.is_waiting

    def advance(self, now: Iterates) -> None:
        """Advance all problems that are not done by one QP and one step along its solution."""
        plan = self._planner.plan(now)
        rows, before, share = plan.rows, now.at.loss[plan.rows].copy(), 1.0
        now.iterations[rows] += 1
        place = np.flatnonzero(~self._end(now, plan))
        for _ in range(MOST_TRIALS):
            if not len(place):
                break
            place = self._step(now, plan, place, share)
            # what rounding hides is not worth another trial
            is_stalled = plan.gain[place] < LAST_GAIN
            stalled, place = rows[place[is_stalled]], place[~is_stalled]
            now.is_done[stalled] = now.is_settled[stalled] = True
            share *= SHORTER
        now.bound[rows] = np.maximum(before, now.at.loss[rows])
        others = ~now.contacts.mark(rows)
        now.contacts = now.contacts.take(others).join(plan.contacts)
        now.multipliers = np.concatenate((now.multipliers[others], plan.multipliers))
        now.gain[rows] = plan.gain
        # the next QP has rows where the steps failed: if it fails too, there is no better place near
        failed = rows[place]
        now.is_done[failed[now.has_failed[failed]]] = True
        now.has_failed[rows] = False
        now.has_failed[failed] = True

    def _step(self, now: Iterates, plan: Plan, place: Indices, share: float) -> Indices:
        """Take a share of some steps of a plan where that brings enough in their class; return the places of the others.

        A whole step may be the last one of its problem.
        """
        rows, is_whole = plan.rows[place], share == 1.0
        control = now.control[rows] + share * plan.step[place]
        at = self.evaluate(rows, control, now.k[rows] + share * (plan.k[place] - now.k[rows]))
        bound = now.bound[rows] - SUFFICIENT * share * plan.gain[place] + ROUNDING
        is_good = (at.loss <= bound) & (np.abs(at.angles - now.angles[rows]) < np.pi).all(axis=1)
        if is_whole:
            # Newton steps converge quadratically: what is left is less than that by which this one missed what its QP foretold.
            # Rows at the steps alone creep from one to the next.
            missed = np.abs(now.at.loss[rows] - at.loss - plan.fall[place])
            is_free = plan.k[place] < self.wanted_k[rows] * (1.0 - FREE)
            is_exact = is_free | now.is_exact[rows]
            is_small = np.where(is_exact, plan.gain[place] < LAST_GAIN, missed < LAST_MISS)
            is_met = is_free | (at.factor >= self.objective.wanted_k[rows])
            is_last = is_good & is_small & is_met & self.margins.between
            now.is_done[rows[is_last]] = now.is_settled[rows[is_last]] = True
        good = rows[is_good]
        now.control[good] = control[is_good]
        now.k[good] = np.clip(at.factor[is_good], 0.0, self.wanted_k[good])
        now.at.put(good, at, is_good, rows)
        if is_whole:
            now.trial = at.contacts.take(at.contacts.mark(rows[~is_good]))
        return place[~is_good]

    def _end(self, now: Iterates, plan: Plan) -> NDArray[np.bool_]:
        """Mark the problems as solved that have nothing to gain any more; return which of the plan they are, (r,)."""
        rounding = SMALL_FACTOR * self.objective.rate[plan.rows] * (1.0 + self.wanted_k[plan.rows])
        is_small: NDArray[np.bool_] = plan.gain < self._small_gain + rounding
        now.is_done[plan.rows[is_small]] = now.is_settled[plan.rows[is_small]] = True
        return is_small
