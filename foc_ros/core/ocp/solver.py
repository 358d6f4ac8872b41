"""One sequential QP for all strategies, and for all candidates of a prediction at once.

For each problem it finds a control u and a safety factor k that minimise

    ln J(u) + rate max(0, k_wanted - k) + floor_rate max(0, -k)    subject to    E u = e,  G_i(u; k) >= 0,

with J the quadratic cost and G_i the least margins over time of the obstacles (`margin`). In the logarithm, costs are compared as
likelihoods compare them; `rate` is what a unit of safety is worth, and a mean that meets an obstacle always costs more than the
way round it. In each iteration the margins are linearised where they are least, and the QP

    minimise  1/2 p'H p + p'(grad ln J) + rate max(0, k_wanted - k) + ...   subject to  E p = 0,  G_i + G_i' p - r_i (k - k_now) >= 0

is solved by its dual. H is diagonal plus few rows: curvature of the margins, and -(grad ln J)(grad ln J)'. All that is needed of
it is a Gram matrix of the goal, curvature and contact rows, so that the dual has one unknown for each contact: rate appears in it as
a budget, r'y <= rate. A line search on the function above refuses controls that pass an obstacle on another side.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from foc_ros.core.deadline import NEVER, Deadline
from foc_ros.core.registry import QP_BACKENDS
from foc_ros.core.safety_preference import COST_FLOOR
from foc_ros.core.types import Array

from .backend import DenseQP
from .margin import FACTORS, Contacts, Indices, Margins
from .problem import Problem

MOST_ITERATIONS = 60
NEAR = 0.1
"""Margin relative to the scene below which an obstacle has a row in the QP."""
NEAR_FACTOR = 1.5
"""Safety factor relative to the wanted one below which it has one too."""
BESIDE = 0.3
"""Time on both sides of a contact with a polygon at which there are rows too: its margin may have a kink [steps]."""
APART = 0.05
"""Time from other contacts beyond which one that held the mean off is kept: along a side there may be two [steps]."""
SAME = 1e-3
"""Time between contacts that count as one [steps]."""
HELD = 1e-5
"""Multiplier relative to the largest one from which a contact holds the mean off."""
LARGEST_RATE = 1e3
"""Worth of a unit of safety, in logarithms of cost, where the wanted safety is a condition: no class costs so much more."""
GENTLE_RATE = 5.0
"""Worth with which the search begins where it is larger: at a guess, margins tell little of what they cost."""
FLOOR = 20.0
"""How much more a mean inside an obstacle costs than a smaller safety factor, for a unit of it: by this factor, or `LEAST_FLOOR`."""
LEAST_FLOOR = 300.0
ROUGH_GAIN = 1e-3
"""Gain at which the search with the gentle worth ends."""
LEAST_CURVATURE = 0.3
"""Least eigenvalue of the Hessian relative to its diagonal part: less curvature would leave the QP without a minimum."""
SMALL_GAIN = 2e-8
"""Gain that the QP promises, as a logarithm of cost, below which a problem is solved."""
SMALL_FACTOR = 1e-9
"""Relative difference of a safety factor that counts as rounding."""
LARGEST_TOLERANCE = 5e-3
"""Largest gain of such a step for classes that are unlikely."""
LARGEST_EXCESS = 20.0
LAST_GAIN = 3e-4
"""Gain of a whole step after which a problem is solved: Newton steps converge quadratically."""
LAST_FACTOR = 1e-6
"""Relative difference up to which the step has to reach its safety factor."""
STALLED_GAIN = 2e-5
"""The same, below which a problem is solved that no step improves: rounding."""
ROUNDS = 3
"""Most times that rows are added to a QP for places at which its solution breaks margins."""
VIOLATED = 1e-3
"""Broken margin, relative to the scene, for which a row is added."""
MOST_TRIALS = 5
SHORTER = 0.25
"""Share of a step that is tried where it fails."""
BUNDLES = 1
"""Trials of a whole step, before which rows are added where the last one failed; then steps are halved."""
SUFFICIENT = 1e-4
"""Share of the promised gain that a step has to bring."""
ROUNDING = 1e-11
GG = 0.0
GRACE = 0.02
SOFT = 1e-11
"""Part of the length of a contact row by which it gives way: near the goal no control may move it."""
ROUNDED = 3e-10
"""Margin relative to the scene that counts as none: accuracy of a QP."""
DEBUG = False


@dataclass
class Evaluation:
    """What the sequence knows of the controls of r problems.

    cost (r,): J, in units of `gain`^2; loss (r,): the function that is minimised; factor (r,): the safety factor k; angles (r, m):
    swept angles [rad]; margin (r, m, T), normal (r, 2, m, T): on the grid; contacts, factors (q,): minima of the safety factors near the movement.
    """

    cost: Array
    loss: Array
    factor: Array
    angles: Array
    margin: Array
    normal: Array
    contacts: Contacts
    factors: Array

    def put(self, rows: Indices, other: Evaluation, taken: NDArray[np.bool_], problems: Indices) -> None:
        """Take rows over from the evaluation of some problems: those that are marked."""
        self.cost[rows], self.loss[rows], self.factor[rows] = other.cost[taken], other.loss[taken], other.factor[taken]
        self.angles[rows], self.margin[rows], self.normal[rows] = other.angles[taken], other.margin[taken], other.normal[taken]
        old, new = ~np.isin(self.contacts.problem, problems[taken]), np.isin(other.contacts.problem, problems[taken])
        self.contacts = self.contacts.take(old).join(other.contacts.take(new))
        self.factors = np.concatenate((self.factors[old], other.factors[new]))


@dataclass
class Plan:
    """The solutions of the QPs of r problems.

    rows (r,): the problems; step (r, 2N); k (r,): planned safety factors; gain (r,): how much the loss falls to first order;
    contacts and multipliers (q,): the rows of the QPs.
    """

    rows: Indices
    step: Array
    k: Array
    gain: Array
    contacts: Contacts
    multipliers: Array

    def replace(self, other: Plan) -> Plan:
        """Return the plans with those of some of the problems replaced."""
        place = np.searchsorted(self.rows, other.rows)
        for mine, new in ((self.step, other.step), (self.k, other.k), (self.gain, other.gain)):
            mine[place] = new
        kept = ~np.isin(self.contacts.problem, other.rows)
        contacts, multipliers = self.contacts.take(kept).join(other.contacts), np.concatenate((self.multipliers[kept], other.multipliers))
        return Plan(self.rows, self.step, self.k, self.gain, contacts, multipliers)


@dataclass
class Iterates:
    """Where the sequence is: a row for each of b problems.

    control (b, 2N), in units of `Horizon.gain`; k (b,): safety factor at which margins are linearised; at: what is known of the
    controls; contacts and multipliers (q,) of the last QPs; angles (b, m): swept angles of the class [rad]; is_done (b,): whether
    the sequence has ended, is_settled (b,): at a minimum; gain (b,): what the last QP promised; iterations (b,).
    """

    control: Array
    k: Array
    at: Evaluation
    contacts: Contacts
    multipliers: Array
    angles: Array
    is_done: NDArray[np.bool_]
    is_settled: NDArray[np.bool_]
    gain: Array
    iterations: Indices
    bound: Array


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
    """

    def __init__(self, margins: Margins, wanted_k: Array, rate: Array, lam: Array) -> None:
        self.margins, self.wanted_k = margins, wanted_k
        self._set_rate(rate)
        problems = margins.problems
        self.gain = np.array([each.horizon.gain for each in problems])
        self.most, self.small_gain = MOST_ITERATIONS, SMALL_GAIN
        terms = {id(each): _tabulate_cost(each) for each in problems}
        tables = [terms[id(each)] for each in problems]
        self.weights = np.stack([each[0] + l * each[1] for each, l in zip(tables, lam.tolist(), strict=True)])
        self.fixed = np.array([each[2] for each in tables])
        # by this the losses of problems with different steps differ from those of costs in m^2/s^5
        self.scale = np.array([math.log(each.horizon.dt) - 2.0 * math.log(each.horizon.gain) for each in problems])
        self.beta = np.array([each.preference.beta for each in problems])
        self.goal_rows, self.goal_targets, self.soft_rows, self.soft_targets, self.soft_weights = (
            _pad([each[i] for each in tables]) for i in range(3, 8)
        )
        self.no_goal = (self.goal_rows == 0.0).all(axis=2)[..., None] * np.eye(self.goal_rows.shape[1])
        backends = {each.qp_backend for each in problems}
        self.backend = QP_BACKENDS.get(backends.pop() if len(backends) == 1 else 'piqp')

    def _set_rate(self, rate: Array) -> None:
        """Set the worth of a unit of safety, and that of a mean that stays out of the obstacles."""
        self.rate, self.floor = rate, np.maximum(FLOOR * rate, LEAST_FLOOR)

    # ---- the objective

    def compute_cost(self, rows: Indices, control: Array) -> Array:
        """Return J (r,) with its fixed part, in units of `gain`^2."""
        missed = (self.soft_rows[rows] @ control[..., None])[..., 0] - self.soft_targets[rows]
        cost: Array = (self.weights[rows] * control**2).sum(axis=1) + (self.soft_weights[rows] * missed**2).sum(axis=1)
        return cost + self.fixed[rows]

    def compute_loss(self, rows: Indices, cost: Array, k: Array) -> Array:
        """Return the function that is minimised, (r,)."""
        wanted, rate = self.wanted_k[rows], self.rate[rows]
        short = np.maximum(wanted - np.maximum(k, np.minimum(wanted, 0.0)), 0.0)
        return np.log(cost) + rate * short + self.floor[rows] * np.maximum(-k, 0.0)

    def meet_goal(self, control: Array) -> Array:
        """Return the nearest controls (b, 2N) that meet the goals exactly."""
        rows = self.goal_rows
        missing = self.goal_targets - (rows @ control[..., None])[..., 0]
        square = rows @ rows.swapaxes(1, 2)
        shares = np.linalg.pinv(square, hermitian=True) @ missing[..., None]
        met: Array = control + (rows.swapaxes(1, 2) @ shares)[..., 0]
        return met

    def evaluate(self, rows: Indices, control: Array, k: Array) -> Evaluation:
        """Return what the sequence has to know of some controls (r, 2N), linearised at safety factors (r,)."""
        margins = self.margins
        motion = margins.move(rows, control)
        grid = margins.measure_grid(rows, motion, k)
        is_near = (grid.value < NEAR * margins.extent[rows, None, None]) | (grid.factor < NEAR_FACTOR * self.wanted_k[rows, None, None])
        contacts, factors = margins.find_minima(rows, motion, k, grid, is_near)
        where = np.zeros(len(margins.problems), dtype=np.intp)
        where[rows] = np.arange(len(rows))
        found = np.full(len(rows), np.inf)
        np.minimum.at(found, where[contacts.problem], factors)
        cost = self.compute_cost(rows, control)
        loss = self.compute_loss(rows, cost, found)
        normal = np.stack((grid.normal_x, grid.normal_y), axis=1)
        return Evaluation(cost, loss, found, margins.sweep(rows, margins.find_path(motion)), grid.value, normal, contacts, factors)

    # ---- the sequence

    def begin(self, control: Array, contacts: Contacts, multipliers: Array, k: Array, angles: Array) -> Iterates:
        """Return the iterates at controls (b, 2N) that meet their goals, in the classes of some swept angles (b, m)."""
        rows = np.arange(len(control))
        at, no = self.evaluate(rows, control, k), np.zeros(len(control), dtype=np.bool_)
        k = np.clip(at.factor, 0.0, self.wanted_k)
        return Iterates(control, k, at, contacts, multipliers, angles, no, no.copy(), np.full(len(rows), np.inf), np.zeros_like(rows), at.loss + GRACE)

    def run(self, now: Iterates, deadline: Deadline = NEVER, most: int = MOST_ITERATIONS) -> None:
        """Advance all problems together, an iteration at a time, until they are solved or the time is up.

        Where safety is worth more than `GENTLE_RATE`, it is worth this at first.
        """
        self.most, rate = most, self.rate
        if (rate > GENTLE_RATE).any():
            self._set_rate(np.minimum(rate, GENTLE_RATE))
            now.at.loss = self.compute_loss(np.arange(len(rate)), now.at.cost, now.at.factor)
            now.bound = now.at.loss + GRACE
            self._run(now, deadline, most, ROUGH_GAIN)
            self._set_rate(rate)
            now.at.loss = self.compute_loss(np.arange(len(rate)), now.at.cost, now.at.factor)
            now.bound = now.at.loss + GRACE
            now.is_done[:], now.is_settled[:] = False, False
        self._run(now, deadline, most, SMALL_GAIN)

    def _run(self, now: Iterates, deadline: Deadline, most: int, small_gain: float) -> None:
        """Advance the problems until their QPs promise a small gain."""
        self.small_gain = small_gain
        for count in range(most):
            # the first iteration is for everybody: a class that is found has a cost
            if now.is_done.all() or (count and not deadline.allows()):
                break
            deadline.step_times.add()
            self.advance(now)

    def advance(self, now: Iterates) -> None:
        """Advance all problems that are not done by one QP and one line search."""
        rows = np.flatnonzero(~now.is_done)
        none = np.zeros(0, dtype=np.intp)
        further = Contacts(none, none, np.zeros(0))
        plan = self.solve_qps(now, rows, further)
        for _ in range(ROUNDS):
            new = self.find_violated(now, plan)
            again = np.unique(new.problem)
            if not len(again):
                break
            further = further.join(new)
            plan = plan.replace(self.solve_qps(now, again, further))
        before = now.at.loss[rows].copy()
        now.iterations[rows] += 1
        is_open = ~self._end(now, plan)
        share = 1.0
        for attempt in range(MOST_TRIALS):
            if not is_open.any():
                break
            place = np.flatnonzero(is_open)
            tried = rows[place]
            at, is_good = self._try(now, plan, place, share)
            good = tried[is_good]
            is_last = is_good & (plan.gain[place] < LAST_GAIN * self._tolerate(now, tried)) & (at.loss <= now.at.loss[tried])
            is_last &= at.factor > plan.k[place] - LAST_FACTOR * (1.0 + plan.k[place])
            if share == 1.0:
                now.is_done[tried[is_last]] = now.is_settled[tried[is_last]] = True
            now.control[good] += share * plan.step[place[is_good]]
            now.k[good] = np.clip(at.factor[is_good], 0.0, self.wanted_k[good])
            now.at.put(good, at, is_good, tried)
            is_open[place[is_good]] = False
            # what rounding hides is not worth another trial
            stalled = is_open & (plan.gain < STALLED_GAIN * self._tolerate(now, rows))
            now.is_done[rows[stalled]] = now.is_settled[rows[stalled]] = True
            is_open &= ~stalled
            if attempt >= BUNDLES:
                share *= SHORTER
                continue
            # a margin with a kink was linearised on one side of it: where the trial is least there is a row now
            new = at.contacts.take(np.isin(at.contacts.problem, tried[~is_good]))
            new = new.take(~_is_known(new, plan.contacts, SAME))
            again = np.unique(new.problem)
            if len(again):
                further = further.join(new)
                plan = plan.replace(self.solve_qps(now, again, further))
                is_open &= ~self._end(now, plan)
        now.bound[rows] = np.maximum(before, now.at.loss[rows])
        now.contacts, now.multipliers = plan.contacts, plan.multipliers
        now.gain[rows] = plan.gain
        now.is_done[rows[is_open]] = True
        now.is_settled[rows[is_open]] = plan.gain[is_open] < STALLED_GAIN

    def _try(self, now: Iterates, plan: Plan, place: Indices, share: float) -> tuple[Evaluation, NDArray[np.bool_]]:
        """Return the evaluation of a share of some steps, and whether they bring enough in their class."""
        rows = plan.rows[place]
        k = now.k[rows] + share * (plan.k[place] - now.k[rows])
        at = self.evaluate(rows, now.control[rows] + share * plan.step[place], k)
        bound = now.bound[rows] - SUFFICIENT * share * plan.gain[place] + ROUNDING
        return at, (at.loss <= bound) & (np.abs(at.angles - now.angles[rows]) < np.pi).all(axis=1)

    def _tolerate(self, now: Iterates, rows: Indices) -> Array:
        """Return by how much more than that of the best class the loss of some classes may be inexact, (r,).

        A likelihood changes by a share of itself: a class that is a hundred times less likely may be a hundred times less exact.
        """
        loss = now.at.loss + self.scale
        dearer = np.minimum(self.beta[rows] * (loss[rows] - loss.min()), LARGEST_EXCESS)
        return np.minimum(np.exp(dearer), LARGEST_TOLERANCE / LAST_GAIN)

    def _end(self, now: Iterates, plan: Plan) -> NDArray[np.bool_]:
        """Mark the problems as solved that have nothing to gain any more; return which of the plan they are, (r,)."""
        is_small = plan.gain < self.small_gain + SMALL_FACTOR * self.rate[plan.rows] * (1.0 + self.wanted_k[plan.rows])
        now.is_done[plan.rows[is_small]] = now.is_settled[plan.rows[is_small]] = True
        return is_small

    def find_violated(self, now: Iterates, plan: Plan) -> Contacts:
        """Return the places on the grid at which planned steps would break margins, as far as normals tell."""
        rows = plan.rows
        moved = self.margins.find_step(plan.step)[:, :, None]
        margin = now.at.margin[rows] + (now.at.normal[rows] * moved).sum(axis=1)
        before = np.concatenate((np.full((*margin.shape[:2], 1), np.inf), margin[..., :-1]), axis=2)
        after = np.concatenate((margin[..., 1:], np.full((*margin.shape[:2], 1), np.inf)), axis=2)
        bound = -VIOLATED * self.margins.extent[rows]
        row, obstacle, place = np.nonzero((margin <= before) & (margin < after) & (margin < bound[:, None, None]))
        found = Contacts(rows[row], obstacle, self.margins.times[place])
        return found.take(~_is_known(found, plan.contacts, 0.25))

    def solve_qps(self, now: Iterates, rows: Indices, further: Contacts) -> Plan:
        """Return the solutions of the QPs of some problems; further: places that have rows besides the contacts."""
        margins = self.margins
        places, known = self.choose_rows(now, rows, further)
        where = np.zeros(len(margins.problems), dtype=np.intp)
        where[rows] = np.arange(len(rows))
        at = where[places.problem]
        control, k_now = now.control[rows], now.k[rows]
        held = known > 0.0
        lin = margins.linearise(places, control[at], k_now[at], held)
        slot, width = _number(at, len(rows))
        size = control.shape[1]

        def spread(values: Array) -> Array:
            padded = np.zeros((len(rows), width, *values.shape[1:]))
            padded[at, slot] = values
            return padded

        cost = now.at.cost[rows][:, None]
        missed = (self.soft_rows[rows] @ control[..., None])[..., 0] - self.soft_targets[rows]
        soft = self.soft_weights[rows]
        gradient = (self.weights[rows] * control + ((soft * missed)[:, None] @ self.soft_rows[rows])[:, 0]) * (2.0 / cost)
        diagonal = self.weights[rows] * (2.0 / cost)
        np.add.at(diagonal, at[held], known[held, None] * lin.diagonal)
        held_slot, held_width = _number(at[held], len(rows))
        factors = np.zeros((len(rows), held_width, FACTORS, size))
        weights = np.zeros((len(rows), held_width, FACTORS, held_width, FACTORS))
        factors[at[held], held_slot] = lin.factors
        weights[at[held], held_slot, :, held_slot] = known[held, None, None] * lin.weights
        soft_count = soft.shape[1]
        bent = FACTORS * held_width + soft_count + 1
        curvature = np.zeros((len(rows), bent, bent))
        curvature[:, : FACTORS * held_width, : FACTORS * held_width] = weights.reshape(len(rows), FACTORS * held_width, FACTORS * held_width)
        place = np.arange(FACTORS * held_width, bent - 1)
        curvature[:, place, place] = 2.0 * soft / cost
        curvature[:, -1, -1] = GG
        bends = np.concatenate((factors.reshape(len(rows), FACTORS * held_width, size), self.soft_rows[rows], gradient[:, None]), axis=1)
        # factors of unit length, in the metric of the diagonal
        length = np.sqrt((bends**2 / diagonal[:, None]).sum(axis=2))
        bends /= np.where(length > 0.0, length, 1.0)[..., None]
        curvature *= length[:, :, None] * length[:, None, :]
        # what is left of all rows when the goal is met, in the metric of the diagonal: controls that move no end
        stack = np.concatenate((bends, spread(lin.gradient), gradient[:, None]), axis=1)
        soften = SOFT * (stack[:, bent:-1] ** 2 / diagonal[:, None]).sum(axis=2)
        goal = self.goal_rows[rows]
        scaled_goal = goal / diagonal[:, None]
        square = scaled_goal @ goal.swapaxes(1, 2)
        shares = np.linalg.solve(square + self.no_goal[rows], scaled_goal @ stack.swapaxes(1, 2))
        stack = stack - shares.swapaxes(1, 2) @ goal
        scaled = stack / diagonal[:, None]
        rest = scaled @ stack.swapaxes(1, 2)
        lower = np.linalg.cholesky(rest[:, :bent, :bent] + 1e-9 * np.eye(bent))
        values, vectors = np.linalg.eigh(lower.swapaxes(1, 2) @ curvature @ lower)
        reduce = 1.0 - 1.0 / np.maximum(1.0 + values, LEAST_CURVATURE)
        side = vectors.swapaxes(1, 2) @ np.linalg.solve(lower, rest[:, :bent, bent:])
        dual = rest[:, bent:, bent:] - side.swapaxes(1, 2) @ (reduce[:, :, None] * side)
        value, rate = spread(lin.value), spread(lin.stddev_rate)
        multipliers = np.zeros((len(rows), width))
        counts = np.bincount(at, minlength=len(rows))
        for b in range(len(rows)):
            n = counts[b]
            y = self._solve_dual(rows[b], dual[b, :n, :n] + np.diag(soften[b, :n]), dual[b, :n, -1], value[b, :n], rate[b, :n], k_now[b]) if n else np.zeros(0)
            multipliers[b, :n] = y
        # the step follows from the multipliers by back substitution
        coefficient = np.concatenate((multipliers, -np.ones((len(rows), 1))), axis=1)[..., None]
        bent_part = -np.linalg.solve(lower.swapaxes(1, 2), vectors @ (reduce[:, :, None] * (side @ coefficient)))
        step = (np.concatenate((bent_part, coefficient), axis=1).swapaxes(1, 2) @ scaled)[:, 0]
        moved = (spread(lin.gradient) @ step[..., None])[..., 0] + value
        wanted = self.wanted_k[rows]
        with np.errstate(divide='ignore', invalid='ignore'):
            lead = moved + ROUNDED * margins.extent[rows][:, None]
            reached = np.where(rate > 0.0, k_now[:, None] + lead / rate, np.inf)
        mask = np.arange(width) < counts[:, None]
        k_new = np.minimum(np.where(mask, reached, np.inf).min(axis=1, initial=np.inf), wanted)
        slope = (gradient * step).sum(axis=1)
        model = slope + self._penalty(rows, k_new) - self._penalty(rows, now.at.factor[rows])
        # the QP's own quadratic term is half of what its linear terms gain at the solution
        gain = -model
        if DEBUG: print('slope',slope,'model',model,'knew',k_new,'factor',now.at.factor[rows], 'y',multipliers, 'value',value,'moved',moved)
        return Plan(rows, step, k_new, np.maximum(gain, 0.0), places, multipliers[at, slot])

    def _penalty(self, rows: Indices, k: Array) -> Array:
        return self.compute_loss(rows, np.ones(len(rows)), k)

    def _solve_dual(self, row: int, square: Array, pull: Array, value: Array, rate: Array, k_now: float) -> Array:
        """Return the multipliers (n,) of one QP."""
        wanted, worth = float(self.wanted_k[row]), float(self.rate[row])
        linear = value - rate * (wanted - k_now) - pull
        diagonal = np.maximum(np.diag(square), 1e-300)
        unit = 1.0 / np.sqrt(diagonal)
        size = max(float(np.abs(linear * unit).max()), 1e-12)
        n = len(value)
        P = np.zeros((n + 1, n + 1))
        P[:n, :n] = square * unit[:, None] * unit + 1e-10 * np.eye(n)
        P[n, n] = 1e-12
        budget = rate * unit * size
        # the part of the budget beyond `rate` pays for a mean inside an obstacle
        most = float(self.floor[row])
        scale = max(float(budget.max()), 1e-12)
        G = np.zeros((2, n + 1))
        G[0, :n], G[0, n], G[1, n] = -budget / scale, 1.0, -1.0
        g = np.array([-worth / scale, -most / scale])
        c = np.concatenate((linear * unit / size, [wanted * scale / size**2]))
        answer = self.backend(DenseQP(P, c, None, None, G, g, np.zeros(n + 1)))
        return np.maximum(answer.x[:n], 0.0) * unit * size

    def choose_rows(self, now: Iterates, rows: Indices, further: Contacts) -> tuple[Contacts, Array]:
        """Return the places at which the QPs have rows, and the multipliers that are known there."""
        minima = now.at.contacts.take(np.isin(now.at.contacts.problem, rows))
        margins, last = self.margins, float(self.margins.steps)
        kept = np.isin(now.contacts.problem, rows) & (now.multipliers > 0.0)
        held, multipliers = now.contacts.take(kept), now.multipliers[kept]
        largest = np.zeros(len(margins.problems))
        np.maximum.at(largest, held.problem, multipliers)
        strong = held.take(multipliers > HELD * largest[held.problem])
        places, more = minima, [(further.take(np.isin(further.problem, rows)), SAME), (strong, APART)]
        is_polygon = margins.is_polygon[minima.problem, minima.obstacle]
        if margins.between and is_polygon.any():
            kinks = minima.take(is_polygon)
            times = (np.clip(kinks.time + apart, 1.0, last) for apart in (-BESIDE, BESIDE))
            more += [(Contacts(kinks.problem, kinks.obstacle, time), SAME) for time in times]
        for others, apart in more:
            if len(others.time):
                places = places.join(others.take(~_is_known(others, places, apart)))
        known = np.zeros(len(places.time))
        if len(multipliers) and len(known):
            far = np.abs(held.time[:, None] - places.time)
            far[(held.problem[:, None] != places.problem) | (held.obstacle[:, None] != places.obstacle)] = np.inf
            nearest = far.argmin(axis=1)
            is_there = np.isfinite(far[np.arange(len(nearest)), nearest])
            np.add.at(known, nearest[is_there], multipliers[is_there])
        known[known < HELD * largest[places.problem]] = 0.0
        return places, known


def _tabulate_cost(problem: Problem) -> tuple[Array, Array, float, Array, Array, Array, Array, Array]:
    """Return the cost of a problem and its goal, for a control in units of `Horizon.gain`.

    Returns
    -------
    tuple
        Weights of the squared control at lambda 0, (2N,), and what lambda adds, (2N,); the part of the cost that is fixed; rows
        (r, 2N) of unit length and targets (r,) of what the goal fixes; rows (s, 2N), targets (s,) and weights (s,) of what has a
        cost.
    """
    gain, dt = problem.horizon.gain, problem.horizon.dt
    fixed = (problem.preference.fixed_cost / problem.preference.dt + COST_FLOOR / dt) * gain**2
    rows, targets, softness = problem.goal_rows
    hard = softness == 0.0
    rows = rows / gain
    length = np.sqrt((rows[hard] ** 2).sum(axis=1))
    soft = rows[~hard], targets[~hard], 0.5 * gain**2 / softness[~hard]
    return 1.0 + problem.weighted_variance, problem.summed_variance, fixed, rows[hard] / length[:, None], targets[hard] / length, *soft


def _pad(tables: Sequence[Array]) -> Array:
    """Return arrays with different numbers of rows as one, filled up by zeros."""
    most = max(len(each) for each in tables)
    if all(len(each) == most for each in tables):
        return np.stack(tables)
    return np.stack([np.pad(each, [(0, most - len(each))] + [(0, 0)] * (each.ndim - 1)) for each in tables])


def _is_known(places: Contacts, known: Contacts, apart: float) -> NDArray[np.bool_]:
    """Return whether each place is less than a time [steps] apart from a known one, (q,)."""
    same = (places.problem[:, None] == known.problem) & (places.obstacle[:, None] == known.obstacle)
    found: NDArray[np.bool_] = (same & (np.abs(places.time[:, None] - known.time) < apart)).any(axis=1)
    return found


def _number(group: Indices, groups: int) -> tuple[Indices, int]:
    """Return the place of each entry within its group, (q,), and the largest size of a group; entries are in any order."""
    order = np.argsort(group, kind='stable')
    counts = np.bincount(group, minlength=groups)
    first = np.concatenate(([0], np.cumsum(counts)[:-1]))
    slot = np.empty(len(group), dtype=np.intp)
    slot[order] = np.arange(len(group)) - first[group[order]]
    return slot, int(counts.max(initial=0))
