"""The quadratic programme of one linearisation, built apart from its solution.

minimise 1/2 u' diag(hessian) u - linear' u + sum_r (goal_rows u - target)_r^2 / (2 softness_r) (an equality where softness is 0)
subject to sum_q coefficient[j, t, q] (map_q(t) * weights[q]) u >= limit[j, t] for every obstacle j and step t.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from foc_ros.core.dynamics.impulse_response import apply_impulse_response
from foc_ros.core.kernels import Indices, Matrix, Tensor, Vector, compiled, compiled_with_caller, freeze
from foc_ros.core.kernels.linear_algebra import factorise_cholesky, multiply, multiply_transposed, multiply_vector, solve_lower
from foc_ros.core.obstacles.rounded_polygon import find_normal, find_offset
from foc_ros.core.types import Array

from .clearance import required_distance
from .contacts.hermite import interpolation_rows
from .problem import Problem
from .terms import CostTerms, MovingObstacles

SMALLEST_PIVOT = 1e-14
"""Least squared pivot of the goal rows' Schur complement, scaled to a unit diagonal."""
NO_TIMES = np.zeros(0)
NO_FURTHER_ROWS = np.zeros((0, 0, 0))


class GoalSolution(NamedTuple):
    """The solution of a QP without obstacle rows, and how further rows change it.

    control (2N,): the minimiser; inverse (2N,) and factor (r, 2N): further rows M with multipliers y add P M'y to the control,
    P = diag(inverse) - factor' factor = H^-1 - H^-1 E'(E H^-1 E' + softness)^-1 E H^-1 for the Hessian H and the goal rows E.
    """

    control: Vector
    inverse: Vector
    factor: Matrix


@dataclass(frozen=True, eq=False)
class Cost:
    """The cost and the goal of a QP: hessian (2N,) > 0; linear (2N,); goal_rows (r, 2N) with targets and softness (r,)."""

    hessian: Array
    linear: Array
    goal_rows: Array
    goal_targets: Array
    softness: Array

    @cached_property
    def goal_solution(self) -> GoalSolution:
        """The solution without obstacle rows."""
        return freeze(solve_goal(self.hessian, self.linear, self.goal_rows, self.goal_targets, self.softness))


@compiled
def compute_hessian(cost: CostTerms, lam: float) -> Vector:
    """Return the Hessian of J_aug, 2 (1 + variance weights + lambda sum_t (V_xx + V_yy)), (2N,) (paper, equation 16)."""
    hessian: Vector = 2.0 * (1.0 + cost.weighted_variance + lam * cost.summed_variance)
    return hessian


def effort_cost(problem: Problem, lam: float) -> Cost:
    """Return the cost J_aug at a lambda [1/s^6], with the problem's goal."""
    terms = problem.terms.cost
    hessian = compute_hessian(terms, lam)
    return Cost(hessian, np.zeros(len(hessian)), terms.goal_rows, terms.goal_targets, terms.softness)


@compiled
def solve_goal(hessian: Vector, linear: Vector, goal_rows: Matrix, goal_targets: Vector, softness: Vector) -> GoalSolution:
    """Solve a QP with a diagonal Hessian (2N,) and goal rows (r, 2N) in closed form.

    Pivots are kept away from zero, because a Hessian over many orders of magnitude leaves some without a correct digit.
    """
    r = len(softness)
    inverse = 1.0 / hessian
    weighted = goal_rows * inverse
    gram = multiply_transposed(weighted, goal_rows)
    # unit diagonal: the goal rows mix metres, metres per second and their like
    scale = np.zeros((r, r))
    for i in range(r):
        gram[i, i] += softness[i]
        scale[i, i] = 1.0 / np.sqrt(gram[i, i])
    for i in range(r):
        for j in range(r):
            gram[i, j] *= scale[i, i] * scale[j, j]
    root = solve_lower(factorise_cholesky(gram, SMALLEST_PIVOT), scale)
    factor = multiply(root, weighted)
    free = inverse * linear
    missing = multiply_vector(root, goal_targets - multiply_vector(goal_rows, free))
    control = free + multiply(np.expand_dims(missing, 0), factor)[0]
    return GoalSolution(control, inverse, factor)


@compiled_with_caller
def solve_cost(cost: CostTerms, lam: float) -> GoalSolution:
    """Return the solution of least J_aug at a lambda, without obstacle rows."""
    hessian = compute_hessian(cost, lam)
    return solve_goal(hessian, np.zeros_like(hessian), cost.goal_rows, cost.goal_targets, cost.softness)


@compiled
def schur_complement(rows: Matrix, inverse: Vector, factor: Matrix) -> tuple[Matrix, Matrix]:
    """Return M P (k, 2N) and M P M' (k, k) for rows M (k, 2N): effect of their multipliers on the control and on the rows."""
    effects = multiply(multiply_transposed(rows, factor), factor)
    for i in range(rows.shape[0]):
        for j in range(rows.shape[1]):
            effects[i, j] = rows[i, j] * inverse[j] - effects[i, j]
    return effects, multiply_transposed(effects, rows)


class ObstacleRows(NamedTuple):
    """Rows for q quantities at N steps, and at e further times, for m obstacles.

    responses (q, 2, N + 1): impulse responses of the quantities; further (q, e, 2N): their rows at the further times; weights
    (q, 2N): factors on the control in each quantity; coefficients (m, N + e, q) and limits (m, N + e).
    """

    responses: Tensor
    further: Tensor
    weights: Matrix
    coefficients: Tensor
    limits: Matrix


@dataclass(frozen=True, eq=False)
class ReachingQP:
    """A cost, obstacle rows with frozen arrays, and the name of the solver that is to be used."""

    cost: Cost
    obstacle_rows: ObstacleRows
    backend: str = 'piqp'

    @property
    def limits(self) -> Array:
        """Right-hand side of every obstacle row, (m, N + e)."""
        return self.obstacle_rows.limits

    def row_values(self, control: Array) -> Array:
        """Return the left-hand side of every obstacle row for a control (2N,), (m, N + e)."""
        return evaluate_rows(*self.obstacle_rows[:4], control)

    def rows(self, obstacle: NDArray[np.intp], step: NDArray[np.intp]) -> Array:
        """Return obstacle rows (k, 2N) for k pairs of obstacle and step index."""
        return collect_rows(self.obstacle_rows, obstacle, step)


@compiled
def evaluate_rows(responses: Tensor, further: Tensor, weights: Matrix, coefficients: Tensor, control: Vector) -> Matrix:
    """Return the left-hand side of every row, (m, N + e), from the fields of `ObstacleRows`."""
    m, times, q = coefficients.shape
    steps, moved, values = responses.shape[2] - 1, np.empty((q, times)), np.zeros((m, times))
    for a in range(q):
        weighted = weights[a] * control
        moved[a, :steps] = apply_impulse_response(responses[a : a + 1], weighted)[0, 1:]
        if times > steps:
            moved[a, steps:] = multiply_vector(further[a], weighted)
    for j in range(m):
        for t in range(times):
            for a in range(q):
                values[j, t] += coefficients[j, t, a] * moved[a, t]
    return values


@compiled
def find_violated(
    rows: ObstacleRows, control: Vector, known_obstacle: Indices, known_step: Indices, tolerance: float
) -> tuple[Indices, Indices]:
    """Return the worst row of every stretch of steps at which a control (2N,) violates an obstacle's, as obstacle and step index.

    Rows that are known, given by obstacle and step index (k,), count as met.
    """
    violation = rows.limits - evaluate_rows(rows.responses, rows.further, rows.weights, rows.coefficients, control)
    m, steps = violation.shape
    for i in range(len(known_step)):
        violation[known_obstacle[i], known_step[i]] = 0.0
    obstacle, step, count = np.empty(m * steps, np.intp), np.empty(m * steps, np.intp), 0
    for j in range(m):
        for t in range(steps):
            here = violation[j, t]
            is_peak = (t == 0 or here >= violation[j, t - 1]) and (t == steps - 1 or here > violation[j, t + 1])
            if here > tolerance and is_peak:
                obstacle[count], step[count] = j, t
                count += 1
    return obstacle[:count].copy(), step[:count].copy()


@compiled
def collect_rows(rows: ObstacleRows, obstacle: Indices, step: Indices) -> Matrix:
    """Return the rows of k pairs of obstacle and step, (k, 2N)."""
    q, _, times = rows.responses.shape
    steps = times - 1
    collected = np.zeros((len(step), 2 * steps))
    for i in range(len(step)):
        t = step[i]
        for a in range(q):
            share = rows.coefficients[obstacle[i], t, a]
            if t >= steps:
                for u in range(2 * steps):
                    collected[i, u] += share * rows.further[a, t - steps, u] * rows.weights[a, u]
                continue
            for channel in range(2):
                for k in range(t + 1):
                    u = channel * steps + k
                    collected[i, u] += share * rows.responses[a, channel, t + 1 - k] * rows.weights[a, u]
    return collected


def clearance_qp(
    problem: Problem, cost: Cost, guess: Array, tau: float, *, literal: bool = False, between: Array = NO_TIMES
) -> ReachingQP:
    """Build the paper's reformulated problem E[C] + tau <= 0 (equation 16) at a guess; its lambda is in the cost.

    Parameters
    ----------
    problem, cost
        The problem, and its cost at some lambda.
    guess
        Positions (N, 2) at steps 1..N to linearise at [m].
    tau
        Clearance term [m^2].
    literal
        Whether to linearise as printed in the paper: see `half_planes`.
    between
        (e,): times in steps at which rows hold besides the steps. Their rows follow, as if they were steps N + 1..N + e.
    """
    steps, further = problem.horizon.steps, NO_FURTHER_ROWS
    normals, limits = half_planes(problem, guess, tau, literal=literal)
    if len(between):
        further, free = interpolation_rows(problem.terms.motion, between)
        path = np.concatenate((problem.initial_mean[None, :2], guess))
        positions = np.stack([np.interp(between, np.arange(steps + 1.0), axis) for axis in path.T], axis=1)
        more_normals, more_limits = linearise_clearance(positions, free, between, problem.obstacles_with_reach(tau), False)
        normals, limits = np.concatenate((normals, more_normals), axis=1), np.concatenate((limits, more_limits), axis=1)
    rows = ObstacleRows(problem.horizon.maps[:2], further, np.ones((2, 2 * steps)), normals, limits)
    return ReachingQP(cost, freeze(rows), problem.qp_backend)


def half_planes(problem: Problem, guess: Array, tau: float, *, literal: bool = False) -> tuple[Array, Array]:
    """Linearise |p - q|^2 >= E[R^2] + tau at a guess (N, 2): unit normals (m, N, 2) and limits (m, N) on normal . (S u) [m].

    q is the point of the polygon that is nearest to the guess; inside a polygon distances count as negative.

    literal: the paper's E[C] + tau <= 0 divided by 2 |d|; its plane lies (reach^2 + d^2) / (2 d) from q, d = |guess - q|.
    Otherwise the plane with the same normal that touches the rounded polygon: the two agree at a solution, where the constraint
    is active, and the touching one cuts off less elsewhere, so that a far obstacle is never in the way. Both stay outside
    the obstacle.
    """
    motion, times = problem.terms.motion, np.arange(1.0, problem.horizon.steps + 1.0)
    free = np.ascontiguousarray(motion.free[:2, 1:].T)
    return linearise_clearance(np.ascontiguousarray(guess, dtype=float), free, times, problem.obstacles_with_reach(tau), literal)


@compiled
def linearise_clearance(
    guess: Matrix, free: Matrix, times: Vector, obstacles: MovingObstacles, literal: bool
) -> tuple[Tensor, Matrix]:
    """Return normals (m, q, 2) and limits (m, q) of `half_planes` at times (q,), for a guess (q, 2) and free positions (q, 2)."""
    m, q = len(obstacles.reach), len(times)
    normals, limits = np.empty((m, q, 2)), np.empty((m, q))
    for j in range(m):
        for t in range(q):
            cx = obstacles.centre[j, 0] + times[t] * obstacles.drift[j, 0]
            cy = obstacles.centre[j, 1] + times[t] * obstacles.drift[j, 1]
            offset = find_offset(obstacles.polygons, j, guess[t, 0] - cx, guess[t, 1] - cy)
            nearest_x, nearest_y = guess[t, 0] - offset.x, guess[t, 1] - offset.y
            distance, x, y = find_normal(offset, 0.0)
            if distance == 0.0:  # a guess on a centre has no normal: pass on the left of the y axis
                x, y, distance = 0.0, 1.0, 1.0
            reach = required_distance(obstacles, j, times[t])[0]
            normals[j, t, 0], normals[j, t, 1] = x, y
            limits[j, t] = x * (nearest_x - free[t, 0]) + y * (nearest_y - free[t, 1])
            limits[j, t] += (reach * reach + distance * distance) / (2.0 * distance) if literal and distance > 0.0 else reach
    return normals, limits
