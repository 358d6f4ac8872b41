"""Strategy `optimal`: the least cost subject to the surrogate itself.

f(u) = E[R^2] - |d(u)|^2 + k sqrt(Var(u)) <= 0 for every obstacle and step, d = mean(p) - mean(o). Each QP linearises f at the
last u, divided by 2 |d| so that a row is a distance. The multipliers y add the convex part of the curvature of sqrt(Var) to the
cost: y 2 k / (|d| sqrt(Var)) times the variance map, on the diagonal of the Hessian. That is a lambda for every step and a tau
for every row.

Var itself grows with |d|. Far from the solution the rows leave that out, as the paper's linearisation does: with it, a row whose
standard deviation exceeds its distance would ask the hand to come nearer, through the obstacle. Once the sequence has settled,
the rows include it, and the solution is a minimum of the problem as it stands.
"""

from __future__ import annotations

import numpy as np

from foc_ros.core.config import FocConfig
from foc_ros.core.deadline import NEVER, Deadline, OutOfTimeError
from foc_ros.core.dynamics.condensed import largest_shift, position_variances
from foc_ros.core.kernels import Indices, Matrix, Tensor, Vector, compiled, freeze
from foc_ros.core.obstacles.chance_constraint import constraint_moments, eta_of_k, k_of_eta
from foc_ros.core.ocp.clearance import required_distance
from foc_ros.core.ocp.contacts.contacts import Contacts
from foc_ros.core.ocp.contacts.hermite import compute_trajectory
from foc_ros.core.ocp.minimum_safety_factor import find_minimum_safety_factor
from foc_ros.core.ocp.problem import Problem
from foc_ros.core.ocp.qp import NO_FURTHER_ROWS, Cost, ObstacleRows, ReachingQP, effort_cost, evaluate_rows
from foc_ros.core.ocp.sqp import SqpOptions, converge
from foc_ros.core.ocp.terms import ChanceTerms, Motion, MovingCircles
from foc_ros.core.ocp.warm_start import Start
from foc_ros.core.ocp.working_set import QPSolution, WorkingSet, solve
from foc_ros.core.types import Array, Status

from . import StrategyResult, find_best_effort

TOLERANCE = 1e-6
"""Largest move of the mean, relative to the scene, at which the sequence has settled."""
ROUGH_TOLERANCE = 1e-2
"""The same for the rows that leave the growth of Var out."""
MAX_QPS = 30
"""Of one search for a minimum with the rows that leave the growth of Var out."""
MAX_COMPLETE_QPS = 120
"""The same with the complete rows, which near the minimum creep along a circle more often."""
DIVERGED = 1e20
"""Multiplier at which the sequence has diverged: its curvature leaves no digit for anything else in the cost."""
SMALLEST_STEP = 1.0 / 16
"""Smallest share of the way to the wanted k that is tried at once before k counts as out of reach."""


def solve_optimal(problem: Problem, start: Start, _: FocConfig, deadline: Deadline = NEVER) -> StrategyResult:
    """Find a local minimum from a start."""
    search = _Search(problem, deadline)
    try:
        status, message = search.run(start)
    except OutOfTimeError:
        if search.best is None:
            raise
        status, message = Status.DEADLINE, f'out of time, with eta {eta_of_k(search.reached):.4g} reached'
    if search.best is None:
        return find_best_effort(problem, start)
    control, contacts = search.best.control, Contacts.at_steps(search.best.active, search.best.multipliers)
    k = max(find_minimum_safety_factor(problem, control, between_steps=False).k, 0.0)
    weights = compute_equivalent_weights(problem, control, contacts, k)
    return StrategyResult(status, message, control, contacts, qp_solves=search.qp_solves, equivalent_weights=weights)


def compute_equivalent_weights(problem: Problem, control: Array, contacts: Contacts, k: float) -> list[tuple[float, float]]:
    """Return the (tau [m^2], lambda [1/s^6]) of each contact, all at steps, with which it would hold the surrogate at k.

    tau = k sqrt(Var[C]) is by how much E[C] has to be below zero; lambda = y k |d| / sqrt(Var[C]), for a multiplier y [m/s^6], is
    the cost of a variance along the normal of the contact, at its step.
    """
    positions, circles = problem.positions(control), problem.terms.chance.circles
    _, variance = constraint_moments(positions, problem.position_variance(control), circles)
    rows = contacts.obstacle, np.rint(contacts.time).astype(np.intp) - 1
    stddev, distance = np.sqrt(variance[rows]), np.hypot(*(positions[rows[1]] - problem.centres[rows]).T)
    lams = contacts.multiplier * k * distance / np.maximum(stddev, 1e-12)
    return list(zip((k * stddev).tolist(), lams.tolist(), strict=True))


class _Search:
    """Raises k from that of the least effort to the wanted one: at once if that settles, else in smaller steps."""

    def __init__(self, problem: Problem, deadline: Deadline) -> None:
        self.problem, self.deadline, self.qp_solves = problem, deadline, 0
        self.wanted, self.reached = k_of_eta(problem.eta), 0.0
        self.best: QPSolution | None = None

    def run(self, start: Start) -> tuple[Status, str]:
        """Leave the best solution in `best` and its k in `reached`; return how the search ended."""
        active, multipliers = start.contacts.rows(self.problem.horizon.steps)
        if start.control is not None and len(active):
            found = self.repeat_qps(QPSolution(start.control, active, multipliers), self.wanted, TOLERANCE, complete=True)
            if found is not None:
                self.best, self.reached = found, self.wanted
                return Status.SOLVED, 'solved'
        options = SqpOptions(verified=False)
        free = converge(self.problem, start.positions, active, 0.0, 0.0, self.deadline, options)
        if free is None:
            return Status.INFEASIBLE, 'no control meets every linearised obstacle row'
        self.qp_solves += free.qp_solves
        self.best = QPSolution(free.control, free.active, free.contacts.multiplier)
        self.reached = find_minimum_safety_factor(self.problem, free.control, between_steps=False).k
        if self.reached >= self.wanted:
            return Status.SOLVED, 'solved'
        return self.raise_k(self.best)

    def raise_k(self, latest: QPSolution) -> tuple[Status, str]:
        """Raise k from `reached`."""
        share = 1.0
        while share >= SMALLEST_STEP:
            target = self.wanted if share == 1 else self.reached + share * (self.wanted - self.reached)
            # roughly with the rows that leave the growth of Var out, then with the complete ones
            rough = self.repeat_qps(latest, target, ROUGH_TOLERANCE, complete=False)
            found = None if rough is None else self.repeat_qps(rough, target, TOLERANCE, complete=True)
            if found is None:
                share /= 2
                continue
            self.best, self.reached, latest = found, target, found
            if target == self.wanted:
                return Status.SOLVED, 'solved'
            share = min(1.0, 2 * share)
        message = f'eta {self.problem.eta:g} is out of reach: the largest found is {eta_of_k(self.reached):.4g}'
        return Status.ETA_UNREACHABLE, message

    def repeat_qps(self, latest: QPSolution, k: float, tolerance: float, *, complete: bool) -> QPSolution | None:
        """Repeat the QP until it moves the mean by less than the tolerance, relative to the scene; None if it does not."""
        problem, position = self.problem, self.problem.horizon.maps[:2]
        for _ in range(MAX_COMPLETE_QPS if complete else MAX_QPS):
            self.deadline.check()
            qp = surrogate_qp(problem, latest.control, latest.active, latest.multipliers, k, complete=complete)
            solution = solve(qp, latest.active)
            if solution is None or not solution.multipliers.max(initial=0.0) < DIVERGED:
                return None
            self.qp_solves += solution.solves
            move = largest_shift(position, latest.control, solution.control)
            latest = solution
            if move < tolerance * problem.extent:
                return latest
        return None


def surrogate_qp(
    problem: Problem, control: Array, active: WorkingSet, multipliers: Array, k: float, *, complete: bool = True
) -> ReachingQP:
    """Build the QP of f <= 0 linearised at a control (2N,), with the curvature of active rows (multipliers (k,)).

    complete: with the derivative of Var by the position.
    """
    control, motion, chance = np.ascontiguousarray(control, dtype=float), problem.terms.motion, problem.terms.chance
    slopes, limits, weights = linearise_surrogate(motion, chance, problem.circles(0.0), control, k, complete)
    cost = effort_cost(problem, 0.0)
    if len(active):
        curvature = compute_curvature(chance.noise.responses, slopes, *active.rows, multipliers, chance.noise.noise_variance)
        rows = cost.goal_rows, cost.goal_targets, cost.softness
        cost = Cost(cost.hessian + curvature, curvature * control, *rows)
    obstacle_rows = ObstacleRows(problem.horizon.maps, NO_FURTHER_ROWS, weights, slopes, limits)
    return ReachingQP(cost, freeze(obstacle_rows), problem.qp_backend)


@compiled
def linearise_surrogate(
    motion: Motion, chance: ChanceTerms, circles: MovingCircles, control: Vector, k: float, complete: bool
) -> tuple[Tensor, Matrix, Matrix]:
    """Linearise -f / (2 |d|) >= 0 at a control (2N,) as rows: slopes (m, N, 5), limits (m, N), weights (5, 2N) of the control.

    The slopes are those by x, y and the covariances xx, yy, xy; circles: with the distance to keep at tau = 0.
    """
    positions, covariance = compute_trajectory(motion, control)[:2, 1:].T.copy(), position_variances(chance.noise, control)
    m, steps = len(circles.reach), len(positions)
    slopes, surplus = np.empty((m, steps, 5)), np.empty((m, steps))
    _, variance = constraint_moments(positions, covariance, chance.circles)
    for j in range(m):
        own = chance.circles.centre_covariance[j]
        for t in range(steps):
            dx = positions[t, 0] - (circles.centre[j, 0] + (t + 1) * circles.drift[j, 0])
            dy = positions[t, 1] - (circles.centre[j, 1] + (t + 1) * circles.drift[j, 1])
            distance = max(np.hypot(dx, dy), 1e-9)
            x, y = dx / distance, dy / distance
            stddev = np.sqrt(max(variance[j, t], 1e-24))
            xx, yy, xy = covariance[0, t] + own[0, 0], covariance[1, t] + own[1, 1], covariance[2, t] + own[0, 1]
            turn, pull = 2 * k / stddev if complete else 0.0, 2 * k * distance / stddev
            slopes[j, t, 0] = x - turn * (xx * x + xy * y)
            slopes[j, t, 1] = y - turn * (xy * x + yy * y)
            slopes[j, t, 2], slopes[j, t, 3], slopes[j, t, 4] = -pull * x * x, -pull * y * y, -2 * pull * x * y
            reach = required_distance(circles, j, t + 1.0)[0]
            surplus[j, t] = (distance * distance - reach * reach - k * stddev) / (2 * distance)
    weights = np.ones((5, len(control)))
    weights[2:] = chance.noise.noise_variance * control
    return slopes, evaluate_rows(chance.noise.responses, np.empty((0, 0, 0)), weights, slopes, control) - surplus, weights


@compiled
def compute_curvature(
    responses: Tensor, slopes: Tensor, obstacle: Indices, step: Indices, multipliers: Vector, noise_variance: Vector
) -> Vector:
    """Return what k rows of slopes (m, N, 5) with multipliers (k,) add to the diagonal Hessian, (2N,).

    responses (5, 2, N + 1): `Horizon.maps`; noise_variance (2N,): c^2.
    """
    steps = responses.shape[2] - 1
    curvature = np.zeros(2 * steps)
    for i in range(len(step)):
        for q in range(2, 5):
            weight = -multipliers[i] * slopes[obstacle[i], step[i], q]
            for channel in range(2):
                for k in range(step[i] + 1):
                    curvature[channel * steps + k] += weight * responses[q, channel, step[i] + 1 - k]
    return curvature * noise_variance
