"""Strategy `optimal`: the least cost subject to the surrogate itself.

f(u) = E[R^2] - |d(u)|^2 + k sqrt(Var(u)) <= 0 for every obstacle and step, d = mean(p) - mean(o). Each QP takes f linear at the
last u, divided by 2 |d| so that a row is a distance, and bends the cost by what the multipliers y say of sqrt(Var): its convex
part, y 2 k / (|d| sqrt(Var)) times the variance map, on the Hessian's diagonal. That is a lambda for every step and a tau for
every row.

Var itself grows with |d|. Far from the solution the rows leave that out, as the paper's linearisation does: with it, a row whose
spread exceeds its distance would ask the hand to come nearer, through the obstacle. Once settled, it is taken in, and the
solution is a minimum of the problem as it stands.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from foc_ros.core.deadline import NEVER, Deadline, OutOfTimeError
from foc_ros.core.dynamics.condensed import apart, mean_positions, position_variances
from foc_ros.core.kernels import Indices, Matrix, Tensor, Vector, compiled
from foc_ros.core.obstacles.chance_constraint import eta_of_k, k_of_eta, variances
from foc_ros.core.ocp.chance_evaluation import evaluate_chance_constraint
from foc_ros.core.ocp.problem import Problem
from foc_ros.core.ocp.qp import Cost, ReachingQP, effort_cost, row_values, wanted_distance
from foc_ros.core.ocp.sqp import converge
from foc_ros.core.ocp.warm_start import Start
from foc_ros.core.ocp.working_set import WorkingSet, solve
from foc_ros.core.types import Array, Status

SETTLED = 1e-6
"""Largest move of the mean, relative to the way, at which the sequence has settled."""
ROUGHLY = 1e-2
"""The same for the rows that leave the growth of Var out."""
MAX_QPS = 30
"""Of one search for a minimum with the rows that leave the growth of Var out."""
MAX_COMPLETE_QPS = 120
"""The same with the true rows, which near the minimum creep along a circle more often."""
DIVERGED = 1e20
"""Multiplier at which the sequence runs away: the bend that it puts on the cost leaves no digit for anything else."""
SMALLEST_STEP = 1.0 / 16
"""Smallest share of the way to the wanted k that is tried at once before k is called out of reach."""


@dataclass(frozen=True, eq=False)
class Optimum:
    """How the search ended: control (2N,), the rows that hold it with their multipliers, QPs solved."""

    status: Status
    message: str
    control: Array
    active: WorkingSet
    multipliers: Array
    qp_solves: int


@dataclass(frozen=True, eq=False)
class _Iterate:
    """A control, its active rows and their multipliers."""

    control: Array
    active: WorkingSet
    multipliers: Array


def optimise(problem: Problem, start: Start, deadline: Deadline = NEVER) -> Optimum | None:
    """Find a local minimum from a start; None where even the obstacle rows there contradict each other."""
    search = _Search(problem, deadline)
    try:
        status, message = search.run(start)
    except OutOfTimeError:
        if search.iterate is None:
            raise
        status, message = Status.DEADLINE, f'out of time, with eta {eta_of_k(search.reached):.4g} reached'
    if search.iterate is None:
        return None
    found = search.iterate
    return Optimum(status, message, found.control, found.active, found.multipliers, search.qp_solves)


class _Search:
    """Raises k from what the least effort gives to what is wanted: at once if that settles, else in smaller steps."""

    def __init__(self, problem: Problem, deadline: Deadline) -> None:
        self.problem, self.deadline, self.qp_solves = problem, deadline, 0
        self.wanted, self.reached = k_of_eta(problem.eta), 0.0
        self.iterate: _Iterate | None = None

    def run(self, start: Start) -> tuple[Status, str]:
        """Leave the best iterate in `iterate` and the k that it reaches in `reached`; return how it ended."""
        active, multipliers = start.contacts.rows(self.problem.horizon.steps)
        if start.control is not None and len(active):
            settled = self.repeat(_Iterate(start.control, active, multipliers), self.wanted, SETTLED, complete=True)
            if settled is not None:
                self.iterate, self.reached = settled, self.wanted
                return Status.SOLVED, 'solved'
        free = converge(self.problem, start.positions, active, 0.0, 0.0, self.deadline, verified=False)
        if free is None:
            return Status.INFEASIBLE, 'no control meets every linearised obstacle row'
        self.qp_solves += free.qp_solves
        self.iterate = _Iterate(free.control, free.active, free.contacts.force)
        self.reached = evaluate_chance_constraint(self.problem, free.control).smallest_k
        if self.reached >= self.wanted:
            return Status.SOLVED, 'solved'
        return self.raised(self.iterate)

    def raised(self, iterate: _Iterate) -> tuple[Status, str]:
        """Raise k from `reached`."""
        share = 1.0
        while share >= SMALLEST_STEP:
            target = self.wanted if share == 1 else self.reached + share * (self.wanted - self.reached)
            settled = self.settle(iterate, target)
            if settled is None:
                share /= 2
                continue
            self.iterate, self.reached, iterate = settled, target, settled
            if target == self.wanted:
                return Status.SOLVED, 'solved'
            share = min(1.0, 2 * share)
        message = f'eta {self.problem.eta:g} is out of reach: the largest found is {eta_of_k(self.reached):.4g}'
        return Status.ETA_UNREACHABLE, message

    def settle(self, iterate: _Iterate, k: float) -> _Iterate | None:
        """Settle the surrogate at k: roughly with the rows that leave the growth of Var out, then with the true ones."""
        rough = self.repeat(iterate, k, ROUGHLY, complete=False)
        return None if rough is None else self.repeat(rough, k, SETTLED, complete=True)

    def repeat(self, iterate: _Iterate, k: float, tolerance: float, *, complete: bool) -> _Iterate | None:
        """Repeat the QP until it moves the mean by less than the tolerance, relative to the scene; None if it does not."""
        problem, position = self.problem, self.problem.horizon.maps[:2]
        for _ in range(MAX_COMPLETE_QPS if complete else MAX_QPS):
            self.deadline.check()
            qp = surrogate_qp(problem, iterate.control, iterate.active, iterate.multipliers, k, complete=complete)
            solution = solve(qp, iterate.active)
            if solution is None or not solution.multipliers.max(initial=0.0) < DIVERGED:
                return None
            self.qp_solves += solution.solves
            move = apart(position, iterate.control, solution.control)
            iterate = _Iterate(solution.control, solution.active, solution.multipliers)
            if move < tolerance * problem.extent:
                return iterate
        return None


def surrogate_qp(
    problem: Problem, control: Array, active: WorkingSet, multipliers: Array, k: float, *, complete: bool = True
) -> ReachingQP:
    """Build the QP of f <= 0 linearised at a control (2N,), with the curvature of active rows (multipliers (k,)).

    complete: with the derivative of Var by the position.
    """
    maps = problem.horizon.maps
    slopes, limits, weights = surrogate_rows(
        maps,
        problem.noise_variance,
        problem.free_position,
        problem.free_variance,
        np.ascontiguousarray(control, dtype=float),
        problem.centres,
        problem.size[1],
        problem.obstacles.centre_covariance,
        wanted_distance(problem, 0.0),
        k,
        1.0 if complete else 0.0,
    )
    return ReachingQP(_bent(problem, control, active, multipliers, slopes), maps, weights, slopes, limits)


@compiled
def linearised(
    offset: Tensor,
    covariance: Matrix,
    size_variance: Vector,
    centre_covariance: Tensor,
    wanted: Matrix,
    k: float,
    turning: float,
) -> tuple[Tensor, Matrix]:
    """Linearise -f / (2 |d|), which is to be >= 0, by position and covariance xx, yy, xy: slopes (m, N, 5), values (m, N) [m].

    offset d (m, N, 2), covariance (3, N) of the position; turning: 1 to count that Var changes with d too, 0 to leave it out.
    """
    m, steps, _ = offset.shape
    slopes, surplus = np.empty((m, steps, 5)), np.empty((m, steps))
    var = variances(offset, covariance, size_variance, centre_covariance)
    for j in range(m):
        for t in range(steps):
            distance = max(np.hypot(offset[j, t, 0], offset[j, t, 1]), 1e-9)
            x, y = offset[j, t, 0] / distance, offset[j, t, 1] / distance
            stddev = np.sqrt(max(var[j, t], 1e-24))
            xx = covariance[0, t] + centre_covariance[j, 0, 0]
            yy = covariance[1, t] + centre_covariance[j, 1, 1]
            xy = covariance[2, t] + centre_covariance[j, 0, 1]
            turn, pull = 2 * k / stddev * turning, 2 * k * distance / stddev
            slopes[j, t, 0] = x - turn * (xx * x + xy * y)
            slopes[j, t, 1] = y - turn * (xy * x + yy * y)
            slopes[j, t, 2], slopes[j, t, 3], slopes[j, t, 4] = -pull * x * x, -pull * y * y, -2 * pull * x * y
            reach = wanted[j, t if wanted.shape[1] > 1 else 0]
            surplus[j, t] = (distance * distance - reach * reach - k * stddev) / (2 * distance)
    return slopes, surplus


@compiled
def surrogate_rows(
    maps: Tensor,
    noise_variance: Vector,
    free_position: Matrix,
    free_variance: Matrix,
    control: Vector,
    centres: Tensor,
    size_variance: Vector,
    centre_covariance: Tensor,
    wanted: Matrix,
    k: float,
    turning: float,
) -> tuple[Tensor, Matrix, Matrix]:
    """Return `linearised` at a control (2N,) as rows on u: slopes (m, N, 5), limits (m, N) and the maps' weights (5, 2N)."""
    offset = np.expand_dims(mean_positions(maps[:2], control, free_position), 0) - centres
    covariance = position_variances(maps, noise_variance, control, free_variance)
    slopes, surplus = linearised(offset, covariance, size_variance, centre_covariance, wanted, k, turning)
    weights = np.ones((5, len(control)))
    weights[2:] = noise_variance * control
    return slopes, row_values(maps, np.empty((0, 0, 0)), weights, slopes, control) - surplus, weights


def _bent(problem: Problem, control: Array, active: WorkingSet, multipliers: Array, slopes: Array) -> Cost:
    """Return the cost with the curvature of the active rows' standard deviations, about the control."""
    if not len(active):
        return effort_cost(problem, 0.0)
    variances = problem.noise_variance, problem.weighted_variance
    return Cost(*bent(problem.horizon.maps, slopes, *active.rows, multipliers, *variances, control), *problem.goal_rows)


@compiled
def bent(
    maps: Tensor,
    slopes: Tensor,
    obstacle: Indices,
    step: Indices,
    multipliers: Vector,
    noise_variance: Vector,
    weighted_variance: Vector,
    control: Vector,
) -> tuple[Vector, Vector]:
    """Return the Hessian (2N,) that k rows of slopes (m, N, 5), with multipliers (k,), bend, and the linear term (2N,) of that.

    maps (5, 2, N + 1): `Horizon.maps`; noise_variance, weighted_variance (2N,): of the problem; control (2N,): bent about.
    """
    steps = maps.shape[2] - 1
    bend = np.zeros(2 * steps)
    for i in range(len(step)):
        for q in range(2, 5):
            weight = -multipliers[i] * slopes[obstacle[i], step[i], q]
            for channel in range(2):
                for k in range(step[i] + 1):
                    bend[channel * steps + k] += weight * maps[q, channel, step[i] + 1 - k]
    bend *= noise_variance
    return 2.0 * (1.0 + weighted_variance) + bend, bend * control
