"""The quadratic programme of one linearisation, built apart from its solution.

minimise 1/2 u' diag(hessian) u - linear' u + sum_r (goal_rows u - target)_r^2 / (2 softness_r) (an equality where softness is 0)
subject to sum_q coefficient[j, t, q] (map_q(t) * weights[q]) u >= limit[j, t] for every obstacle j and step t.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from foc_ros.core.dynamics.impulse_response import apply_impulse_response
from foc_ros.core.kernels import Indices, Matrix, Tensor, Vector, compiled
from foc_ros.core.linear_algebra import factorise_cholesky, multiply, multiply_transposed, multiply_vector, solve_lower
from foc_ros.core.types import Array

from .contacts.hermite import interpolate, interpolation_row, required_distances
from .problem import Problem

SMALLEST_PIVOT = 1e-14
"""Of the goal rows' own compliance, scaled to a unit diagonal."""


@dataclass(frozen=True, eq=False)
class Cost:
    """What is minimised, and the goal.

    hessian (2N,) > 0; linear (2N,), None for zero; goal_rows (r, 2N) with their targets and softness (r,).

    With H diagonal, the control that meets only the goal is known in closed form, and so is P, by which rows M press on it:
    P = H^-1 - H^-1 E'(E H^-1 E' + softness)^-1 E H^-1, E the goal rows.
    """

    hessian: Array
    linear: Array | None
    goal_rows: Array
    goal_targets: Array
    softness: Array

    @cached_property
    def factors(self) -> tuple[Array, Array, Array]:
        """H^-1 (2N,), root L (r, r) of (E H^-1 E' + softness)^-1 = L'L, and L E H^-1 (r, 2N)."""
        return goal_factors(self.hessian, self.goal_rows, self.softness)

    @cached_property
    def goal_control(self) -> Array:
        """The minimiser without obstacle rows, (2N,)."""
        inverse, root, factor = self.factors
        if self.linear is None:
            return control_to_goal(root, factor, self.goal_targets)
        return pulled_to_goal(inverse, root, factor, self.goal_rows, self.goal_targets, self.linear)


@compiled
def goal_factors(hessian: Vector, goal_rows: Matrix, softness: Vector) -> tuple[Vector, Matrix, Matrix]:
    """Return `Cost.factors`. Pivots are kept from zero: a Hessian over many orders of magnitude leaves some without a digit."""
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
    return inverse, root, multiply(root, weighted)


@compiled
def control_to_goal(root: Matrix, factor: Matrix, missing: Vector) -> Vector:
    """Return the least control (2N,) that makes up for what the goal rows are missing (r,)."""
    control: Vector = multiply(np.expand_dims(multiply_vector(root, missing), 0), factor)[0]
    return control


@compiled
def pulled_to_goal(
    inverse: Vector, root: Matrix, factor: Matrix, goal_rows: Matrix, goal_targets: Vector, linear: Vector
) -> Vector:
    """Return the control (2N,) of least cost with a linear term (2N,) that meets the goal alone."""
    free = inverse * linear
    control: Vector = free + control_to_goal(root, factor, goal_targets - multiply_vector(goal_rows, free))
    return control


@compiled
def schur_complement(rows: Matrix, inverse: Vector, factor: Matrix) -> tuple[Matrix, Matrix]:
    """Return rows M (k, 2N) times P: what their multipliers do to the control (k, 2N), and M P M' (k, k) to the rows' values."""
    held = multiply_transposed(rows, factor)
    pressed = multiply(held, factor)
    for i in range(rows.shape[0]):
        for j in range(rows.shape[1]):
            pressed[i, j] = rows[i, j] * inverse[j] - pressed[i, j]
    return pressed, multiply_transposed(pressed, rows)


@dataclass(frozen=True, eq=False)
class ReachingQP:
    """A cost and obstacle rows: q quantities at N steps, and at e further times, for m obstacles.

    responses (q, 2, N + 1): of the quantities, as in `driven`, and further (q, e, 2N): their maps at the further times; weights
    (q, 2N) of the control in them; coefficients (m, N + e, q) and limits (m, N + e).
    """

    cost: Cost
    responses: Array
    weights: Array
    coefficients: Array
    limits: Array
    further: Array = field(default_factory=lambda: np.zeros((0, 0, 0)))

    def row_values(self, control: Array) -> Array:
        """Left-hand side of every obstacle row, (m, N + e)."""
        return row_values(self.responses, self.further, self.weights, self.coefficients, control)

    @property
    def terms(self) -> tuple[Array, Array, Array, Array, Array]:
        """What kernels ask about the obstacle rows."""
        return self.responses, self.further, self.weights, self.coefficients, self.limits

    def rows(self, obstacle: NDArray[np.intp], step: NDArray[np.intp]) -> Array:
        """Return obstacle rows (k, 2N) for k pairs of obstacle and step index."""
        return collect_rows(self.responses, self.further, self.weights, self.coefficients, obstacle, step)


@compiled
def row_values(responses: Tensor, further: Tensor, weights: Matrix, coefficients: Tensor, control: Vector) -> Matrix:
    """Return the left-hand side of every row, (m, N + e)."""
    m, times, q = coefficients.shape
    steps, moved, found = responses.shape[2] - 1, np.empty((q, times)), np.zeros((m, times))
    for a in range(q):
        weighted = weights[a] * control
        moved[a, :steps] = apply_impulse_response(responses[a : a + 1], weighted)[0, 1:]
        if times > steps:
            moved[a, steps:] = multiply_vector(further[a], weighted)
    for j in range(m):
        for t in range(times):
            for a in range(q):
                found[j, t] += coefficients[j, t, a] * moved[a, t]
    return found


@compiled
def find_peaks(violation: Matrix, known_obstacle: Indices, known_step: Indices, tolerance: float) -> tuple[Indices, Indices]:
    """Return the worst row of every stretch of violated steps (m, N), as obstacle and step index; rows known count as met."""
    m, steps = violation.shape
    left = violation.copy()
    for i in range(len(known_step)):
        left[known_obstacle[i], known_step[i]] = 0.0
    obstacle, step, count = np.empty(m * steps, np.intp), np.empty(m * steps, np.intp), 0
    for j in range(m):
        for t in range(steps):
            here = left[j, t]
            if here > tolerance and (t == 0 or here >= left[j, t - 1]) and (t == steps - 1 or here > left[j, t + 1]):
                obstacle[count], step[count] = j, t
                count += 1
    return obstacle[:count].copy(), step[:count].copy()


@compiled
def find_violated(
    responses: Tensor,
    further: Tensor,
    weights: Matrix,
    coefficients: Tensor,
    limits: Matrix,
    control: Vector,
    known_obstacle: Indices,
    known_step: Indices,
    tolerance: float,
) -> tuple[Indices, Indices]:
    """Return the worst row of every stretch of steps at which a control (2N,) violates a circle's; known ones (k,) are met."""
    return find_peaks(
        limits - row_values(responses, further, weights, coefficients, control), known_obstacle, known_step, tolerance
    )


@compiled
def collect_rows(
    responses: Tensor, further: Tensor, weights: Matrix, coefficients: Tensor, obstacle: Indices, step: Indices
) -> Matrix:
    """Return the rows of k pairs of obstacle and step, (k, 2N)."""
    q, _, times = responses.shape
    steps = times - 1
    rows = np.zeros((len(step), 2 * steps))
    for i in range(len(step)):
        t = step[i]
        for a in range(q):
            share = coefficients[obstacle[i], t, a]
            if t >= steps:
                for u in range(2 * steps):
                    rows[i, u] += share * further[a, t - steps, u] * weights[a, u]
                continue
            for channel in range(2):
                for k in range(t + 1):
                    u = channel * steps + k
                    rows[i, u] += share * responses[a, channel, t + 1 - k] * weights[a, u]
    return rows


def effort_cost(problem: Problem, lam: float) -> Cost:
    """Return J_aug: H = 2 (1 + variance weights + lambda sum_t (V_xx + V_yy)) (paper, equation 16), with the problem's goal."""
    return Cost(2.0 * (1.0 + problem.weighted_variance + lam * problem.summed_variance), None, *problem.goal_rows)


def half_planes(problem: Problem, guess: Array, tau: float, *, literal: bool = False) -> tuple[Array, Array]:
    """Linearise |p - o|^2 >= E[R^2] + tau at a guess (N, 2): unit normals (m, N, 2) and limits (m, N) on normal . (S u) [m].

    literal: the paper's E[C] + tau <= 0 divided by 2 |d|; its plane lies (reach^2 + d^2) / (2 d) from the centre, d = |guess -
    centre|. Otherwise the plane with the same normal that touches the circle: the two agree at a solution, where the constraint
    is active, and the touching one cuts less off before it, so a far obstacle is never in the way. Both stay outside the circle.
    """
    normals, distance, limits = normals_at(np.ascontiguousarray(guess, dtype=float), problem.centres, problem.centres_from_free)
    reach = wanted_distance(problem, tau)
    return normals, limits + ((reach**2 + distance**2) / (2 * distance) if literal else reach)


@compiled
def normals_at(guess: Matrix, centres: Tensor, centres_from_free: Tensor) -> tuple[Tensor, Matrix, Matrix]:
    """Return the unit normals (m, N, 2) at a guess, its distances from the centres (m, N), and normal . (centre - free) (m, N).

    A guess on a centre has no normal: take the left of the y axis.
    """
    m, steps, _ = centres.shape
    normals, distances, along = np.empty((m, steps, 2)), np.empty((m, steps)), np.empty((m, steps))
    for j in range(m):
        for t in range(steps):
            x, y = guess[t, 0] - centres[j, t, 0], guess[t, 1] - centres[j, t, 1]
            distance = np.hypot(x, y)
            if distance == 0.0:
                y, distance = 1.0, 1.0
            normals[j, t, 0], normals[j, t, 1] = x / distance, y / distance
            distances[j, t] = distance
            along[j, t] = normals[j, t, 0] * centres_from_free[j, t, 0] + normals[j, t, 1] * centres_from_free[j, t, 1]
    return normals, distances, along


def wanted_distance(problem: Problem, tau: float) -> Array:
    """Distance from each centre that the mean has to keep, (m, 1) or (m, N) [m]: sqrt(E[R^2] + tau).

    Less where the hand is nearer now: what is missing now may be missing still, falling to zero over the recovery time as a
    minimum-jerk movement does, so that the problem asks for a way out, not for a jump.
    """
    reach, missing, pace = required_margins(problem, tau)
    if problem.recovery_s <= 0 or missing.max(initial=0.0) <= 0:
        return reach[:, None]
    return required_distances(reach, missing, pace, np.arange(1.0, problem.horizon.steps + 1.0))


def required_margins(problem: Problem, tau: float) -> tuple[Array, Array, float]:
    """Return the same as functions of time, `between.kept`: reach (m,) and what of it is missing now (m,) [m], pace [1/step]."""
    reach: Array = np.sqrt(problem.size[0] + tau)
    if problem.recovery_s <= 0:
        return reach, np.zeros(len(reach)), 0.0
    return reach, reach - problem.distance_now, problem.horizon.dt / problem.recovery_s


@compiled
def compute_depths(positions: Matrix, centres: Tensor, wanted: Matrix) -> Matrix:
    """Return how much nearer than wanted the positions (N, 2) are to each centre, (m, N) [m]."""
    m, steps, _ = centres.shape
    depth = np.empty((m, steps))
    for j in range(m):
        for t in range(steps):
            reach = wanted[j, t if wanted.shape[1] > 1 else 0]
            depth[j, t] = reach - np.hypot(positions[t, 0] - centres[j, t, 0], positions[t, 1] - centres[j, t, 1])
    return depth


NO_TIMES = np.zeros(0)


def clearance_qp(
    problem: Problem, cost: Cost, guess: Array, tau: float, *, literal: bool = False, between: Array = NO_TIMES
) -> ReachingQP:
    """Build the paper's reformulated problem (equation 16) at a guess (N, 2): E[C] + tau <= 0; its lambda is in the cost.

    between (e,): times in steps at which the rows hold besides the steps; they follow those, as if they were steps N+1..N+e.
    """
    normals, limits = half_planes(problem, guess, tau, literal=literal)
    if not len(between):
        return ReachingQP(cost, problem.horizon.maps[:2], problem.unweighted, normals, limits)
    more_maps, more_normals, more_limits = _half_planes_at(problem, guess, tau, between)
    return ReachingQP(
        cost,
        problem.horizon.maps[:2],
        problem.unweighted,
        np.concatenate((normals, more_normals), axis=1),
        np.concatenate((limits, more_limits), axis=1),
        more_maps,
    )


def _half_planes_at(problem: Problem, guess: Array, tau: float, times: Array) -> tuple[Array, Array, Array]:
    """Return the position's maps (2, e, 2N), and `half_planes` of a guess (N, 2), straight between the steps, at times (e,)."""
    maps = np.array(
        [[interpolation_row(problem.horizon.motion, time, x, y) for time in times] for x, y in ((1.0, 0.0), (0.0, 1.0))]
    )
    free = np.array([interpolate(problem.free_course, time, 0) for time in times])
    centres = problem.obstacles.centre[:, None] + times[:, None] * problem.drift[:, None]
    path = np.concatenate((problem.initial_mean[None, :2], guess))
    there = np.stack([np.interp(times, np.arange(len(path)), axis) for axis in path.T], axis=1)
    normals, _, limits = normals_at(there, centres, centres - free)
    return maps, normals, limits + required_distances(*required_margins(problem, tau), times)
