"""The margin by which a movement meets the surrogate of the chance constraint, at any time, with its derivatives.

At a time s, d is the mean position relative to the nearest point of the polygon, h_q the effect of the control u_q on d,
r_q = d.h_q, and P the covariance. Where that point is a vertex, h_q is the effect on the position; where it is on an edge, only
what of this is along the normal. With Var = Var[R^2] + 4 d'Pd, the margin

    g(u, s, k) = (|d|^2 - E[R^2] - k sqrt(Var)) / (2 |d_0|)   [m]

is at least zero where the safety factor is at least k; d_0 is the d at which derivatives are taken, and counts as constant.
Inside a polygon |d|^2 counts as negative. From

    dVar/du_q = 8 c_q^2 u_q r_q^2 + 8 (P d).h_q,
    d2Var/du2 = diag(8 c^2 r^2) + W'S + S'W + 8 S'P S,   S_q = h_q,   W_q = 16 c_q^2 u_q r_q h_q,

the Hessian of g is a diagonal and a matrix of rank five, in the rows S (2), W (2) and dVar/du. Before the time at which an
obstacle begins to count, because the hand is still leaving its margin, k is zero: the mean alone keeps the required distance.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from foc_ros.core.dynamics.condensed import position_variances
from foc_ros.core.kernels import Indices, Matrix, Vector, compiled_separately, compiled_with_caller
from foc_ros.core.obstacles.rounded_polygon import Offset, find_normal, find_offset
from foc_ros.core.ocp.clearance import required_distance
from foc_ros.core.ocp.terms import ChanceTerms, MovingObstacles, ProblemTerms

from .bracket import PARABOLAS, Bracket, find_vertex, narrow
from .corners import NO_CORNER, Corner, find_corner
from .hermite import basis, contact_rows, interpolate

SMALLEST_VARIANCE = 1e-24
"""Least Var[C] [m^4]: its root has no derivative at zero."""
SMALLEST_DISTANCE = 1e-9
"""Least distance from a centre by which a margin is divided [m]."""
VERTEX_TOLERANCE = 1e-3
"""Distance in steps from the lowest time so far at which the next vertex is not evaluated any more."""
CORNER_REACH = 1.0
"""Time from a contact, in steps, within which it may be at a corner."""
LEAST_RISE = 1e-9
"""Rise of a margin towards a corner that does not count as rounding [m]."""
TIME_STEP = 1e-3
"""Difference in time, in steps, by which derivatives by time are taken."""
APART = 2.0
"""Least distance in steps between two shortfalls: a contact at the deeper one mends its neighbours too."""


class Margin(NamedTuple):
    """The margin of an obstacle at a time, and what its derivatives consist of.

    value [m]; k: the safety factor that counts; stddev: sqrt(Var) [m^2]; scale: 1 / (2 |d_0|) [1/m]; x, y: d [m]; side and
    is_on_edge: as in `Offset`; covariance (2, 2): P [m^2]; position (3, 2N): S in the rows 0 and 2; variance_row and row
    (2N,): derivatives of Var and g by the control.
    """

    value: float
    k: float
    stddev: float
    scale: float
    x: float
    y: float
    side: float
    is_on_edge: bool
    covariance: Matrix
    position: Matrix
    variance_row: Vector
    row: Vector


@compiled_separately
def initial_covariance_at(chance: ChanceTerms, time: float) -> Matrix:
    """Return the part of the position covariance at a time that comes from the uncertain initial state, (2, 2) [m^2]."""
    errors, covariance = chance.error_trajectory, np.zeros((2, 2))
    if errors.shape[1] == 0:
        return covariance
    t = min(int(time), errors.shape[1] - 2)
    weight, n = basis(time - t, 0), len(chance.initial_covariance)
    rows = np.empty((2, n))
    for axis in range(2):
        p, v = errors[axis], errors[2 + axis]
        for i in range(n):
            rows[axis, i] = weight[0] * p[t, i] + weight[1] * v[t, i] + weight[2] * p[t + 1, i] + weight[3] * v[t + 1, i]
    for a in range(2):
        for b in range(2):
            for i in range(n):
                for j in range(n):
                    covariance[a, b] += rows[a, i] * chance.initial_covariance[i, j] * rows[b, j]
    return covariance


@compiled_with_caller
def relative_position(trajectory: Matrix, obstacles: MovingObstacles, j: int, time: float) -> tuple[float, float]:
    """Return the position of a trajectory (4, N + 1) relative to centre j at any time [m]."""
    at = interpolate(trajectory, time, 0)
    x = at[0] - obstacles.centre[j, 0] - time * obstacles.drift[j, 0]
    return x, at[1] - obstacles.centre[j, 1] - time * obstacles.drift[j, 1]


@compiled_separately
def project_on_normal(position: Matrix, offset: Offset) -> None:
    """Keep of the effects of the control on the position, in the rows 0 and 2, what is along the normal."""
    _, x, y = find_normal(offset, SMALLEST_DISTANCE)
    for q in range(position.shape[1]):
        along = x * position[0, q] + y * position[2, q]
        position[0, q], position[2, q] = along * x, along * y


@compiled_separately
def evaluate_margin(
    terms: ProblemTerms,
    obstacles: MovingObstacles,
    trajectory: Matrix,
    control: Vector,
    j: int,
    time: float,
    k: float,
    scale: float,
) -> Margin:
    """Return the margin of a control (2N,) for obstacle j at any time; scale [1/m], 0 for that of the position itself."""
    chance, n = terms.chance, len(control)
    noise, covariance = chance.noise.noise_variance, initial_covariance_at(chance, time) + chance.obstacles.centre_covariance[j]
    offset = find_offset(obstacles.polygons, j, *relative_position(trajectory, obstacles, j, time))
    x, y = offset.x, offset.y
    position = contact_rows(terms.motion.responses, time, 1.0, 0.0, 0.0)
    for q in range(n):
        variance, a, b = noise[q] * control[q] * control[q], position[0, q], position[2, q]
        covariance[0, 0] += variance * a * a
        covariance[0, 1] += variance * a * b
        covariance[1, 1] += variance * b * b
    covariance[1, 0] = covariance[0, 1]
    if offset.is_on_edge:
        project_on_normal(position, offset)
    pull_x, pull_y = covariance[0, 0] * x + covariance[0, 1] * y, covariance[1, 0] * x + covariance[1, 1] * y
    stddev = np.sqrt(max(chance.obstacles.size_variance[j] + 4.0 * (x * pull_x + y * pull_y), SMALLEST_VARIANCE))
    counted = k if time >= chance.obstacles.ignored_until[j] else 0.0
    if scale == 0.0:
        scale = 0.5 / max(np.hypot(x, y), SMALLEST_DISTANCE)
    value = (offset.side * (x * x + y * y) - required_distance(obstacles, j, time)[0] ** 2 - counted * stddev) * scale
    variance_row, row = np.empty(n), np.empty(n)
    for q in range(n):
        along = x * position[0, q] + y * position[2, q]
        variance_row[q] = 8.0 * (noise[q] * control[q] * along * along + pull_x * position[0, q] + pull_y * position[2, q])
        row[q] = (2.0 * offset.side * along - counted * variance_row[q] / (2.0 * stddev)) * scale
    return Margin(value, counted, stddev, scale, x, y, offset.side, offset.is_on_edge, covariance, position, variance_row, row)


@compiled_separately
def margins_at_steps(
    terms: ProblemTerms, obstacles: MovingObstacles, trajectory: Matrix, covariance: Matrix, j: int, k: float
) -> Vector:
    """Return the margins of obstacle j at steps 0..N, (N + 1,), that at step 0 infinite; covariance (3, N): xx, yy, xy [m^2]."""
    chance, steps = terms.chance.obstacles, covariance.shape[1]
    own, margin = chance.centre_covariance[j], np.full(steps + 1, np.inf)
    for t in range(1, steps + 1):
        x = trajectory[0, t] - obstacles.centre[j, 0] - t * obstacles.drift[j, 0]
        y = trajectory[1, t] - obstacles.centre[j, 1] - t * obstacles.drift[j, 1]
        offset = find_offset(obstacles.polygons, j, x, y)
        x, y = offset.x, offset.y
        xx, yy, xy = covariance[0, t - 1] + own[0, 0], covariance[1, t - 1] + own[1, 1], covariance[2, t - 1] + own[0, 1]
        variance = max(chance.size_variance[j] + 4.0 * (x * x * xx + y * y * yy + 2.0 * x * y * xy), SMALLEST_VARIANCE)
        counted = k if t >= chance.ignored_until[j] else 0.0
        distance, reach = max(np.hypot(x, y), SMALLEST_DISTANCE), required_distance(obstacles, j, float(t))[0]
        margin[t] = (offset.side * distance * distance - reach * reach - counted * np.sqrt(variance)) / (2.0 * distance)
    return margin


@compiled_separately
def find_least_margin(
    terms: ProblemTerms, obstacles: MovingObstacles, trajectory: Matrix, control: Vector, j: int, k: float, margin: Vector, t: int
) -> tuple[float, float]:
    """Return the time near step t of the least margin of obstacle j, and that margin, by parabolas through three times."""
    bracket = Bracket(t - 1.0, float(t), t + 1.0, margin[t - 1], margin[t], margin[t + 1])
    for _ in range(PARABOLAS):
        time = find_vertex(bracket, VERTEX_TOLERANCE)
        if time == np.inf:
            break
        value = evaluate_margin(terms, obstacles, trajectory, control, j, time, k, 0.0).value
        bracket = narrow(bracket, time, value)
    return bracket.b, bracket.at_b


@compiled_separately
def find_kink(
    terms: ProblemTerms, obstacles: MovingObstacles, trajectory: Matrix, control: Vector, j: int, s: float, k: float, here: Margin
) -> tuple[Corner, tuple[Margin, Margin, Margin]]:
    """Find a corner near time s at which the margin of obstacle j is least, as it falls before it and rises after it.

    here: the margin at s. Returns the corner, at an infinite time if there is none, and the margins that `hold_at_corner` needs.
    """
    corner = find_corner(obstacles, trajectory, j, s, CORNER_REACH)
    if not max(terms.chance.obstacles.ignored_until[j], 1.0) < corner.time < trajectory.shape[1] - 1.0:
        return NO_CORNER, (here, here, here)
    at = evaluate_margin(terms, obstacles, trajectory, control, j, corner.time, k, here.scale)
    if at.value > here.value + LEAST_RISE:
        return NO_CORNER, (at, at, at)
    before = evaluate_margin(terms, obstacles, trajectory, control, j, corner.time - TIME_STEP, k, at.scale)
    after = evaluate_margin(terms, obstacles, trajectory, control, j, corner.time + TIME_STEP, k, at.scale)
    if not before.value > at.value < after.value or before.is_on_edge == after.is_on_edge:
        return NO_CORNER, (at, at, at)
    step, near = (TIME_STEP, after) if before.is_on_edge else (-TIME_STEP, before)
    far = evaluate_margin(terms, obstacles, trajectory, control, j, corner.time + 2.0 * step, k, at.scale)
    return Corner(corner.time, corner.x, corner.y, corner.speed, corner.growth, step), (at, near, far)


@compiled_separately
def find_shortfalls(
    terms: ProblemTerms,
    obstacles: MovingObstacles,
    first_alike: Indices,
    trajectory: Matrix,
    control: Vector,
    k: float,
    tolerance: float,
) -> Matrix:
    """Return where margins are least in time and below minus a tolerance [m], deepest first, (q, 2): row of the obstacle, time.

    Only times from step 1 on are searched: at and beside steps, and where the mean is over a corner. Of equal obstacles the first
    alone counts (`Problem.first_alike`), and of shortfalls nearer than `APART` in time the deepest.
    """
    m, steps = len(obstacles.reach), trajectory.shape[1] - 1
    covariance = position_variances(terms.chance.noise, control)
    depth, places, count = np.empty(2 * m * (steps + 1)), np.empty((2 * m * (steps + 1), 2)), 0
    for j in range(m):
        if first_alike[j] != j:
            continue
        margin = margins_at_steps(terms, obstacles, trajectory, covariance, j, k)
        for t in range(1, steps + 1):
            here = margin[t]
            if margin[t - 1] < here or (t < steps and margin[t + 1] <= here):
                continue
            time, least = float(t), here
            # between two steps a margin hardly falls by more than it rises to the step after
            if 1 < t < steps and here < max(margin[t - 1], margin[t + 1]) - here:
                time, least = find_least_margin(terms, obstacles, trajectory, control, j, k, margin, t)
            if least < -tolerance:
                depth[count], places[count, 0], places[count, 1] = least, j, time
                count += 1
        for t in range(1, steps if obstacles.polygons.corners[j] > 1 else 1):
            x, y = trajectory[0, t + 1] - trajectory[0, t], trajectory[1, t + 1] - trajectory[1, t]
            if min(margin[t], margin[t + 1]) > np.hypot(x, y):
                continue
            time = find_corner(obstacles, trajectory, j, t + 0.5, 0.5).time
            least = evaluate_margin(terms, obstacles, trajectory, control, j, time, k, 0.0).value if time < np.inf else np.inf
            if least < -tolerance:
                depth[count], places[count, 0], places[count, 1] = least, j, time
                count += 1
    found, kept = np.empty((count, 2)), 0
    for _ in range(count):
        i, is_apart = np.argmin(depth[:count]), True
        depth[i] = np.inf
        for other in range(kept):
            is_apart = is_apart and abs(found[other, 1] - places[i, 1]) >= APART
        if is_apart:
            found[kept] = places[i]
            kept += 1
    return found[:kept].copy()
