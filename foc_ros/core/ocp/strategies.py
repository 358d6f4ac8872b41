# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Strategies: curves of (k, tau, lambda) and the rule that chooses a point on them.

`optimal` minimises the effort at a safety factor k itself, and gives way where k is not worth its effort. `fixed` is one point of
tau and lambda, `algorithm1` walks along them in whole steps as printed in the paper, and `lv` and `hc` look for the best point
(`lv_hc`). All solve the same problem with the same `Solver`.

A strategy from outside the package is registered by name and then used like these:
``foc_ros.core.registry.STRATEGIES.register('mine', solve_mine)``, with `FocConfig(strategy='mine')`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from foc_ros.core.config import FocConfig
from foc_ros.core.deadline import NEVER, Deadline
from foc_ros.core.solution import Status
from foc_ros.core.types import Array

from .margin import Contacts, Indices, Margins
from .minima import find_least_factors
from .point import Point, solve_at
from .problem import REACHED, Problem
from .solver import LARGEST_TOLERANCE
from .start import NO_FORCES, Forces, Start

INFEASIBLE = 'no path between the obstacles in this homotopy class meets the goal: the path shown violates them least'
BETWEEN_STEPS = 'held off at the steps alone, the mean enters an obstacle between them'
STALLED = 1e-6
NEARLY = 1e-2
"""Relative shortfall of k that is made good by asking for more: an obstacle comes nearer than its contacts tell."""
CORRECTIONS = 3
"""Most times that more than the wanted safety factor is asked for."""
SETTLED_EFFORT = 1.0
"""Change of effort at which `algorithm1` ends, xi of the paper [m^2/s^6]."""
MOST_STEPS = 500
"""Most QPs of `algorithm1`."""
LARGEST_LAMBDA = 1e150
"""Lambda at which `algorithm1` ends: with a large growth it leaves the range of double precision before tau is large enough."""


@dataclass(frozen=True, eq=False)
class StrategyResult:
    """How a strategy ended.

    Parameters
    ----------
    status, message
        The outcome, in words and numbers.
    control
        The stacked control, (2N,) [m/s^3 for the triple integrator].
    forces
        Where obstacles hold the mean off, with multipliers.
    tau, lam
        Clearance term [m^2] and weight of the variances lambda [1/s^6] that the control belongs to.
    qp_solves, iterations
        QPs solved; iterations of a loop that the strategy counts besides, None if there is none.
    minimum
        The least safety factor of the control, the row of its obstacle and its time [steps]; None where it is to be found.
    weights
        The (tau, lambda) of each contact for which it would be there, None where these are tau and lam.
    aims_at_eta
        Whether a control with less than the wanted eta is no solution.
    """

    status: Status
    message: str
    control: Array
    forces: Forces = NO_FORCES
    tau: float = 0.0
    lam: float = 0.0
    qp_solves: int = 0
    iterations: int | None = None
    minimum: tuple[float, int, float] | None = None
    weights: tuple[tuple[float, float], ...] | None = None
    aims_at_eta: bool = True


class Strategy(Protocol):
    """A function that solves several problems with the same response to the control, from a start each.

    It looks at the deadline once an iteration. For a problem without a solution it raises nothing, but returns the best that it
    has found, with a status.
    """

    def __call__(
        self, problems: Sequence[Problem], starts: Sequence[Start], settings: FocConfig, deadline: Deadline, /
    ) -> list[StrategyResult]:
        """Return a result for each problem."""


def collect(point: Point, row: int, status: Status, message: str, **rest: object) -> StrategyResult:
    """Return the result of one problem at a point."""
    now, solver = point.now, point.solver
    mine = (now.contacts.problem == row) & (now.multipliers > 0.0)
    forces = Forces(now.contacts.obstacle[mine], now.contacts.time[mine], now.multipliers[mine])
    control = now.control[row] / solver.gain[row]
    rest.setdefault('qp_solves', int(now.iterations[row]))
    return StrategyResult(status, message, control, forces, **rest)  # type: ignore[arg-type]


def solve_optimal(
    problems: Sequence[Problem], starts: Sequence[Start], _: FocConfig, deadline: Deadline = NEVER
) -> list[StrategyResult]:
    """Find the least effort at the wanted safety factor, or at the one that is worth its effort."""
    zeros = np.zeros(len(problems))
    point = solve_at(problems, starts, (zeros, zeros), is_chance=True, deadline=deadline)
    found = _meet_everywhere(point, deadline)
    touching = point.is_touching() if (point.k < 0.0).any() else zeros
    results = [_finish_optimal(point, row, bool(touching[row])) for row in range(len(problems))]
    minima, weights = zip(*(each.tolist() for each in found), strict=True), _find_weights(point, results)
    return [replace(each, minimum=least, weights=pairs) for each, least, pairs in zip(results, minima, weights, strict=True)]


def _meet_everywhere(point: Point, deadline: Deadline) -> tuple[Array, Indices, Array]:
    """Return the least safety factors of a point, after asking for more where an obstacle comes nearer than its contacts tell."""
    solver, now = point.solver, point.now
    found = find_least_factors(solver.margins, now.control, now.at.factors)
    aimed = np.array([each.wanted_k for each in solver.margins.problems])
    for _ in range(CORRECTIONS):
        short = (found[0] < aimed * (1.0 - REACHED)) & (found[0] > aimed * (1.0 - NEARLY)) & now.is_done & ~now.is_waiting
        if not short.any() or not deadline.allows():
            break
        solver.wanted_k[short] *= 1.0 + 1.2 * (1.0 - found[0][short] / aimed[short])
        now.is_done[short] = now.is_settled[short] = False
        now.bound[short] = np.inf
        solver.run(now, deadline)
        found = find_least_factors(solver.margins, now.control, now.at.factors)
    point.k = np.where(now.at.factor > 0.0, found[0], now.at.factor)
    return found


def _find_weights(point: Point, results: Sequence[StrategyResult]) -> list[tuple[tuple[float, float], ...]]:
    """Return the (tau [m^2], lambda [1/s^6]) with which each contact would be where it is.

    tau = k sqrt(Var[C]) is by how much E[C] has to be below zero. With the standard deviation s = sqrt(Var[C]) / (2 D) along the
    normal, lambda = y k / (2 s) D / (D - k s), for a multiplier y [m/s^6] of the margin g, is the cost of the variance s^2 at its
    time: -y dg/d(s^2).
    """
    counts = [len(each.forces.time) for each in results]
    obstacle, time, push = (np.concatenate([each.forces[i] for each in results]) for i in range(3))
    problem = np.repeat(np.arange(len(results)), counts)
    spread, distance = point.solver.margins.measure_spread(Contacts(problem, obstacle, time), point.now.control)
    k = point.k[problem]
    effort = np.array([float(each.control @ each.control) for each in results])[problem]
    clear = distance / (distance - k * spread / (2.0 * distance))
    pairs = list(zip((k * spread).tolist(), (push * effort * k * distance / spread * clear).tolist(), strict=True))
    ends = np.cumsum(counts).tolist()
    return [tuple(pairs[end - count : end]) for count, end in zip(counts, ends, strict=True)]


def _finish_optimal(point: Point, row: int, is_touching: bool) -> StrategyResult:
    problem, now = point.solver.margins.problems[row], point.now
    k = float(point.k[row])
    reached = problem.risk.find_probability(k)
    if now.is_waiting[row]:
        message = f'unlikely, and goes on in the next prediction: eta {reached:.4g} so far, and the likelihood is estimated'
        return collect(point, row, Status.ESTIMATED, message, aims_at_eta=False)
    if problem.is_reached(k) and now.is_done[row]:
        return collect(point, row, Status.SOLVED, 'solved')
    is_late = point.is_late(row)
    if is_touching and not is_late:
        return collect(point, row, Status.INFEASIBLE, INFEASIBLE)
    is_settled = now.is_settled[row] or now.gain[row] < LARGEST_TOLERANCE
    is_short = problem.preference.is_hard and not problem.is_reached(k)
    if is_late or not (is_settled or is_short):
        status, cause = _name_unsettled(point, row)
        return collect(
            point, row, status, f'{cause}: eta {reached:.4g} so far, and the likelihood is estimated', aims_at_eta=False
        )
    if problem.preference.is_hard:
        message = f'eta {problem.eta:g} is out of reach: the largest found is {reached:.4g}'
    else:
        message = (
            f'eta {reached:.6g} of the wanted {problem.eta:g}: more would cost more than likelihood.shortfall, or is out of reach'
        )
    return collect(point, row, Status.ETA_UNREACHABLE, message)


def _name_unsettled(point: Point, row: int) -> tuple[Status, str]:
    """Return status and cause of a problem that is not settled."""
    if point.is_late(row):
        return Status.DEADLINE, 'out of time'
    return Status.ESTIMATED, f'not settled after {int(point.now.iterations[row])} QPs'


def solve_fixed(
    problems: Sequence[Problem], starts: Sequence[Start], settings: FocConfig, deadline: Deadline = NEVER
) -> list[StrategyResult]:
    """Solve at the tau [m^2] and lambda [1/s^6] of the settings, at the steps; the eta is what this gives."""
    tau_lam = np.full(len(problems), settings.tau), np.full(len(problems), settings.lam)
    point = solve_at(problems, starts, tau_lam, is_chance=False, between=False, deadline=deadline)
    touching, results = point.is_touching(), []
    for row in range(len(problems)):
        weights = {'tau': settings.tau, 'lam': settings.lam, 'aims_at_eta': False}
        results.append(_finish_curve(point, row, bool(touching[row]), Status.SOLVED, 'solved', **weights))
    return results


def _finish_curve(point: Point, row: int, is_touching: bool, status: Status, message: str, **rest: object) -> StrategyResult:
    """Return the result of a strategy of tau and lambda, unless the point is none."""
    is_late = point.is_late(row)
    if is_late or not (point.now.is_done[row] or point.now.gain[row] < LARGEST_TOLERANCE):
        status, cause = _name_unsettled(point, row)
        message = f'{cause}: the likelihood is estimated'
    elif is_touching and point.is_kept_at_steps()[row]:
        status, message = Status.ITERATION_LIMIT, BETWEEN_STEPS
    elif is_touching:
        status, message = Status.INFEASIBLE, INFEASIBLE
    return collect(point, row, status, message, **rest)


def solve_algorithm1(
    problems: Sequence[Problem], starts: Sequence[Start], settings: FocConfig, deadline: Deadline = NEVER
) -> list[StrategyResult]:
    """Run the paper's algorithm 1, with its loop condition the right way round.

    tau = 0, lambda = 1. Solve the QP, linearise at its mean; while the surrogate is violated tau += delta, lambda *= Delta; end
    when it holds and the effort changes by less than xi. Both grow in large steps, so that the loop overshoots, or steps over
    what is feasible.
    """
    return [_run_algorithm1(problem, start, settings, deadline) for problem, start in zip(problems, starts, strict=True)]


def _run_algorithm1(problem: Problem, start: Start, settings: FocConfig, deadline: Deadline) -> StrategyResult:
    chance = Margins([problem], np.zeros(1), is_chance=True)
    tau, lam, effort, point, iteration = 0.0, 1.0, math.inf, None, 0
    for iteration in range(1, MOST_STEPS + 1):
        if point is not None and not deadline.allows():
            message = f'out of time after {iteration - 1} QPs: the likelihood is estimated'
            weights = {'tau': tau, 'lam': lam, 'iterations': iteration - 1, 'qp_solves': iteration - 1}
            return collect(point, 0, Status.DEADLINE, message, **weights, aims_at_eta=False)
        one = np.array([tau]), np.array([lam])
        point = solve_at([problem], [start], one, is_chance=False, between=False, before=point, most=1)
        last, effort = effort, float((point.now.control**2).sum()) / problem.horizon.gain**2
        k = float(find_least_factors(chance, point.now.control)[0][0])
        weights = {'tau': tau, 'lam': lam, 'iterations': iteration, 'qp_solves': iteration}
        if k >= problem.wanted_k and abs(effort - last) < SETTLED_EFFORT:
            return collect(point, 0, Status.SOLVED, 'solved', **weights)
        if point.now.gain[0] < STALLED and point.is_touching()[0] and not point.is_kept_at_steps()[0]:
            message = f'QP {iteration} is infeasible at tau = {tau:.3g}, lambda = {lam:.3g}'
            return collect(point, 0, Status.INFEASIBLE, message, **weights)
        if k < problem.wanted_k:
            if lam * settings.algorithm1_growth > LARGEST_LAMBDA:
                # so far along, the variances alone push the mean about: whether there is a path is known at the beginning
                first = solve_at([problem], [start], (np.zeros(1), np.ones(1)), is_chance=False, between=False, deadline=deadline)
                if first.is_touching()[0] and not first.is_kept_at_steps()[0]:
                    return collect(point, 0, Status.INFEASIBLE, INFEASIBLE, **weights)
                message = f'lambda = {lam:.3g} after {iteration} QPs, and the surrogate is still violated'
                return collect(point, 0, Status.ITERATION_LIMIT, message, **weights)
            tau, lam = tau + settings.lv_delta, lam * settings.algorithm1_growth
    assert point is not None
    message = f'not settled after {MOST_STEPS} QPs at tau = {tau:.3g}, lambda = {lam:.3g}'
    weights = {'tau': tau, 'lam': lam, 'iterations': MOST_STEPS, 'qp_solves': MOST_STEPS}
    return collect(point, 0, Status.ITERATION_LIMIT, message, **weights)
