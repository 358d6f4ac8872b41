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
from foc_ros.core.registry import QP_BACKENDS
from foc_ros.core.types import Array

from .gradients import Gradients, linearise
from .iterates import Evaluation, Iterates, Plan
from .margin import NO_CONTACTS, Contacts, Indices, Margins
from .minima import find_minima
from .objective import Objective
from .qp import ReducedQP, number_rows, solve_dual

MOST_ITERATIONS = 150
"""Iterations after which a problem counts as not settled; ten are usual from a guess, three from an earlier solution."""
NEAR, NEAR_FACTOR = 0.01, 1.5
"""Margin relative to the scene, and safety factor relative to the wanted one, below which an obstacle has a row in the QP."""
BESIDE = 0.3
"""Time on both sides of a contact with a polygon at which there are rows too: its margin may have a kink [steps]."""
APART = 0.05
"""Time from other contacts beyond which one that held the mean off is kept: along a side there may be two [steps]."""
SAME = 1e-3
"""Time between contacts that count as one [steps]."""
HELD = 1e-5
"""Multiplier, relative to the largest one and to one that changes ln J by 1 over the scene, from which a contact holds the mean
off: the QP gives a small one to every row."""
LARGEST_RATE, GENTLE_RATE = 1e3, 5.0
"""Worth of a unit of safety in logarithms of cost where the wanted safety is a condition, and the one with which the search
begins where it is larger: at a guess, margins tell little of what they cost."""
ROUGH_GAIN = 1e-3
"""Gain, as a logarithm of cost, at which the search with the gentle worth ends."""
FREE = 1e-3
"""Part of the wanted safety factor that is missing where it is chosen with the control."""
SMALL_GAIN, SMALL_FACTOR = 2e-8, 1e-9
"""Gain that a QP promises below which a problem is solved, and relative difference of a safety factor that is rounding."""
LAST_GAIN = 3e-4
"""Gain of a whole step after which a problem is solved: Newton steps converge quadratically."""
FORETOLD = 0.1
"""Part of the promised gain that may be left, if the step brought what was foretold."""
CLOSE = 3e-5
"""Relative excess over the wanted safety factor that is aimed at, so that a step that misses it by rounding still meets it."""
UNLIKELY, SMALL_PART = 6.0, 0.05
"""A class can wait for the next prediction if it is less likely than the best by more than the first number, as a logarithm, and
if its QP promises less than the second one as a part of that."""
LARGEST_TOLERANCE = 5e-3
"""Largest gain of such a step for classes that are unlikely."""
STALLED_GAIN = 2e-5
"""Gain below which a problem is solved that no step improves: rounding hides it."""
ROUNDS = 3
"""Most times that rows are added to a QP for places at which its solution breaks margins."""
VIOLATED, VIOLATED_APART = 1e-3, 0.25
"""Broken margin, relative to the scene, for which a row is added, and its least time from other rows [steps]."""
MOST_TRIALS, SHORTER = 5, 0.25
"""Steps that are tried besides corrected ones: the whole one, and a part of the last one each."""
CURVED = 1.0
"""Largest gain of a step that is corrected where it fails: farther away it is shortened."""
SUFFICIENT = 1e-4
"""Share of the promised gain that a step has to bring."""
GRACE = 0.02
"""Loss by which the first step from a guess or an earlier solution may rise; later ones may rise to the last but one."""
ROUNDING = 1e-11
ACCURACY = 3e-10
"""Margin relative to the scene that counts as none: accuracy of a QP."""


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
        self.margins, self.wanted_k = margins, wanted_k * (1.0 + CLOSE)
        self.objective = Objective(problems, wanted_k, rate, lam)
        self.gain = np.array([each.horizon.gain for each in problems])
        self.most, self._small_gain, self._goes_on = MOST_ITERATIONS, SMALL_GAIN, goes_on
        self._is_condition = np.array([each.preference.is_hard for each in problems])
        self._backend = QP_BACKENDS.get(problems[0].qp_backend)

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
        bound, is_exact = at.loss + GRACE, is_cold | (not self._goes_on)
        count, no = np.zeros_like(rows), [np.zeros(len(rows), dtype=np.bool_) for _ in range(3)]
        return Iterates(control, k, at, contacts, multipliers, angles, no[0], no[1], gain, count, bound, is_exact, no[2])

    def evaluate(self, rows: Indices, control: Array, k: Array) -> Evaluation:
        """Return what the sequence has to know of controls (r, 2N) of some problems, linearised at safety factors (r,)."""
        margins, objective = self.margins, self.objective
        motion = margins.move(rows, control)
        grid = margins.measure_grid(rows, motion, k)
        is_near = grid.value < NEAR * margins.extent[rows, None, None]
        is_near |= grid.factor < NEAR_FACTOR * self.wanted_k[rows, None, None]
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
        now.bound = now.at.loss + GRACE
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
        """Leave unlikely classes to the next prediction that stay so even if they gain several times what their QPs promise.

        Where the wanted eta is a condition, every class is solved to its end: whether it meets eta decides, not what it costs.
        """
        behind = self.objective.compare(now.at.loss)
        is_enough = (behind > UNLIKELY) & (self.objective.beta * now.gain < SMALL_PART * behind)
        now.is_waiting |= ~now.is_done & is_enough & ~self._is_condition
        now.is_done |= now.is_waiting

    def advance(self, now: Iterates) -> None:
        """Advance all problems that are not done by one QP and one step along its solution."""
        plan = self._plan(now)
        rows, before, share = plan.rows, now.at.loss[plan.rows].copy(), 1.0
        now.iterations[rows] += 1
        is_open = ~self._end(now, plan)
        for trial in range(MOST_TRIALS):
            if not is_open.any():
                break
            failed = self._step(now, plan, np.flatnonzero(is_open), share, may_end=share == 1.0)
            is_open[:] = False
            is_open[failed] = True
            # what rounding hides is not worth another trial
            stalled = is_open & (plan.gain < STALLED_GAIN * self._tolerate(now, rows))
            now.is_done[rows[stalled]] = now.is_settled[rows[stalled]] = True
            is_open &= ~stalled
            if not trial:
                plan = self._correct(now, plan, is_open)
            share *= SHORTER
        now.bound[rows] = np.maximum(before, now.at.loss[rows])
        others = ~np.isin(now.contacts.problem, rows)
        now.contacts = now.contacts.take(others).join(plan.contacts)
        now.multipliers = np.concatenate((now.multipliers[others], plan.multipliers))
        now.gain[rows] = plan.gain
        now.is_done[rows[is_open]] = True
        now.is_settled[rows[is_open]] = plan.gain[is_open] < STALLED_GAIN

    def _correct(self, now: Iterates, plan: Plan, is_open: NDArray[np.bool_]) -> Plan:
        """Take steps in place of whole ones that failed, with margins as they were found there; return the plan with these.

        A whole step along a curved obstacle hits it, because the margins that it was planned with hold to first order only. This
        is the second-order correction of sequential QPs (Nocedal and Wright, Numerical Optimization, section 18.3).
        """
        place = np.flatnonzero(is_open & (plan.gain < CURVED))
        if not len(place):
            return plan
        corrected = self._solve_qps(now, plan.rows[place], plan.further.join(now.trial), plan)
        corrected.gain[:], corrected.fall[:] = plan.gain[place], plan.fall[place]
        failed = self._step(now, corrected, np.arange(len(place)), 1.0, may_end=False)
        is_taken = np.ones(len(place), dtype=np.bool_)
        is_taken[failed] = False
        is_open[place[is_taken]] = False
        return plan.replace(corrected.take(is_taken))

    def _step(self, now: Iterates, plan: Plan, place: Indices, share: float, *, may_end: bool) -> Indices:
        """Take a share of some steps of a plan where that brings enough in their class; return the places of the others."""
        rows = plan.rows[place]
        control = now.control[rows] + share * plan.step[place]
        at = self.evaluate(rows, control, now.k[rows] + share * (plan.k[place] - now.k[rows]))
        bound = now.bound[rows] - SUFFICIENT * share * plan.gain[place] + ROUNDING
        is_good = (at.loss <= bound) & (np.abs(at.angles - now.angles[rows]) < np.pi).all(axis=1)
        if may_end:
            # Newton steps converge quadratically: what is left is less than that by which this one missed what its QP foretold.
            # Rows at the steps alone creep from one to the next.
            missed = np.abs(now.at.loss[rows] - at.loss - plan.fall[place])
            is_free = plan.k[place] < self.wanted_k[rows] * (1.0 - FREE)
            is_exact = is_free | now.is_exact[rows]
            left = np.where(is_exact, plan.gain[place], np.maximum(plan.gain[place] * FORETOLD, missed))
            is_small = left < LAST_GAIN * np.where(is_free, 1.0, self._tolerate(now, rows))
            is_met = is_free | (at.factor >= self.objective.wanted_k[rows])
            is_last = is_good & is_small & is_met & self.margins.between
            now.is_done[rows[is_last]] = now.is_settled[rows[is_last]] = True
        good = rows[is_good]
        now.control[good] = control[is_good]
        now.k[good] = np.clip(at.factor[is_good], 0.0, self.wanted_k[good])
        now.at.put(good, at, is_good, rows)
        now.trial = at.contacts.take(np.isin(at.contacts.problem, rows[~is_good]))
        return place[~is_good]

    def _end(self, now: Iterates, plan: Plan) -> NDArray[np.bool_]:
        """Mark the problems as solved that have nothing to gain any more; return which of the plan they are, (r,)."""
        rounding = SMALL_FACTOR * self.objective.rate[plan.rows] * (1.0 + self.wanted_k[plan.rows])
        is_small: NDArray[np.bool_] = plan.gain < self._small_gain + rounding
        now.is_done[plan.rows[is_small]] = now.is_settled[plan.rows[is_small]] = True
        return is_small

    def _tolerate(self, now: Iterates, rows: Indices) -> Array:
        """Return by how much more than that of the best class the loss of some classes may be inexact, (r,).

        A likelihood changes by a share of itself: a class that is a hundred times less likely may be a hundred times less exact.
        The points of a curve of tau and lambda are no answers yet, and have to be exact.
        """
        if not self._goes_on:
            return np.ones(len(rows))
        most = LARGEST_TOLERANCE / LAST_GAIN
        return np.exp(np.minimum(self.objective.compare(now.at.loss)[rows], np.log(most)))

    def _plan(self, now: Iterates) -> Plan:
        """Return the solutions of the QPs of all problems that are not done.

        Far from a solution a path may leap over an obstacle that has no row: there are rows wherever a QP would break margins.
        """
        plan = self._solve_qps(now, np.flatnonzero(~now.is_done), now.trial)
        for _ in range(ROUNDS):
            broken = self._find_broken(now, plan, now.is_exact[plan.rows])
            if not len(broken.time):
                break
            plan = plan.replace(self._solve_qps(now, np.unique(broken.problem), plan.further.join(broken)))
        return plan

    def _find_broken(self, now: Iterates, plan: Plan, is_wanted: NDArray[np.bool_]) -> Contacts:
        """Return the places on the grid at which wanted ones of planned steps would break margins, as far as normals tell."""
        rows = plan.rows[is_wanted]
        if not len(rows):
            return NO_CONTACTS
        moved = self.margins.find_step(plan.step[is_wanted])[:, :, None]
        margin = now.at.margin[rows] + (now.at.normal[rows] * moved).sum(axis=1)
        before, after = np.full_like(margin, np.inf), np.full_like(margin, np.inf)
        before[..., 1:], after[..., :-1] = margin[..., :-1], margin[..., 1:]
        bound = -VIOLATED * self.margins.extent[rows, None, None]
        row, obstacle, place = np.nonzero((margin <= before) & (margin < after) & (margin < bound))
        found = Contacts(rows[row], obstacle, self.margins.times[place])
        return found.take(~_is_known(found, plan.contacts, VIOLATED_APART))

    def _solve_qps(self, now: Iterates, rows: Indices, further: Contacts, failed: Plan | None = None) -> Plan:
        """Return the solutions of the QPs of some problems (r,); further: places that have rows besides the contacts.

        After steps that failed, margins are corrected to second order: by what they are there, beyond what was foretold.
        """
        margins, objective = self.margins, self.objective
        places, known = self._choose_places(now, rows, further)
        at, control, k_now = np.searchsorted(rows, places.problem), now.control[rows], now.k[rows]
        is_free = (k_now > 0.0) & (k_now < self.wanted_k[rows] * (1.0 - FREE))
        gradients = linearise(margins, places, control[at], k_now[at], known > 0.0, is_free[at])
        if failed is not None:
            gradients = self._look_back(gradients, places, at, rows, now, failed)
        quadratic = objective.expand(rows, control, now.at.cost[rows])
        numbered, wanted = number_rows(at, len(rows)), self.wanted_k[rows]
        short = gradients.value - gradients.stddev_rate * (wanted - k_now)[at]
        qp = ReducedQP(quadratic, numbered, gradients, known, short, is_free)
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

    def _look_back(
        self, gradients: Gradients, places: Contacts, at: Indices, rows: Indices, now: Iterates, failed: Plan
    ) -> Gradients:
        """Return gradients with the margins measured at the steps that failed, less what the gradients foretold of them."""
        place = np.searchsorted(failed.rows, rows)
        step, change = failed.step[place], failed.k[place] - now.k[rows]
        motion, k = self.margins.move(rows, now.control[rows] + step), failed.k[place]
        there = self.margins.measure(places, at, motion, k[at]).value
        foretold = (gradients.gradient * step[at]).sum(axis=1) - gradients.stddev_rate * change[at]
        return gradients._replace(value=there - foretold)

    def _choose_places(self, now: Iterates, rows: Indices, further: Contacts) -> tuple[Contacts, Array]:
        """Return the places at which the QPs have rows, and what is known of their multipliers."""
        margins, last = self.margins, float(self.margins.steps)
        minima = now.at.contacts.take(np.isin(now.at.contacts.problem, rows))
        kept = np.isin(now.contacts.problem, rows) & (now.multipliers > 0.0)
        held, multipliers = now.contacts.take(kept), now.multipliers[kept]
        more = [(further.take(np.isin(further.problem, rows)), SAME), (held, APART)]
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
