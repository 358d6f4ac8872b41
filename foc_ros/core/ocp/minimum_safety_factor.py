"""The minimum safety factor k of a control, over all obstacles and times.

Where the control keeps clear between the steps too, the minimum is sought there as well. It then changes smoothly with the
control, where the minimum over the steps alone has kinks as it passes from one step to the next.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from foc_ros.core.dynamics.condensed import position_variances
from foc_ros.core.kernels import Matrix, Vector, compiled, compiled_with_caller
from foc_ros.core.obstacles.chance_constraint import CERTAIN_K, constraint_moments, safety_factor
from foc_ros.core.obstacles.rounded_polygon import find_offset
from foc_ros.core.types import Array

from .contacts.bracket import PARABOLAS, Bracket, find_vertex, narrow
from .contacts.corners import find_corner
from .contacts.hermite import basis, interpolate, interpolation_row
from .problem import Problem
from .terms import ChanceTerms, Motion

VERTEX_TOLERANCE = 1e-4
"""Distance in steps from the lowest time so far at which the next vertex is not evaluated any more: k is flat there."""
WORTH_REFINING = 0.5
"""A step is a candidate for the search between the steps if its k exceeds the minimum by less than this share of 1 + |k|."""


class MinimumSafetyFactor(NamedTuple):
    """The minimum safety factor k, CERTAIN_K without obstacles; row of the obstacle and time in steps where it is attained."""

    k: float
    obstacle: int
    time: float


@compiled_with_caller
def _is_above(bound: float, mean: float, variance: float) -> bool:
    """Tell whether `safety_factor` is certainly above a bound, without the square root: most obstacles are far away."""
    return mean < 0.0 and (bound <= 0.0 or mean * mean > bound * bound * variance)


@compiled_with_caller
def _initial_variance(chance: ChanceTerms, time: float, x: float, y: float) -> float:
    """Return the part of the variance of x p_x + y p_y at a time that comes from the uncertain initial state."""
    trajectory, covariance = chance.error_trajectory, chance.initial_covariance
    if trajectory.shape[1] == 0:
        return 0.0
    t = min(int(time), trajectory.shape[1] - 2)
    weight, total = basis(time - t, 0), 0.0
    row = np.zeros(len(covariance))
    for axis in range(2):
        p, v, direction = trajectory[axis], trajectory[2 + axis], (x, y)[axis]
        row += direction * (weight[0] * p[t] + weight[1] * v[t] + weight[2] * p[t + 1] + weight[3] * v[t + 1])
    for i in range(len(row)):
        for j in range(len(row)):
            total += row[i] * covariance[i, j] * row[j]
    return total


@compiled_with_caller
def _k_at_time(motion: Motion, chance: ChanceTerms, trajectory: Matrix, control_variance: Vector, j: int, time: float) -> float:
    """Return the safety factor for obstacle j at any time; control_variance (2N,): c^2 u^2."""
    obstacles = chance.obstacles
    at, own = interpolate(trajectory, time, 0), obstacles.centre_covariance[j]
    x = at[0] - (obstacles.centre[j, 0] + time * obstacles.drift[j, 0])
    y = at[1] - (obstacles.centre[j, 1] + time * obstacles.drift[j, 1])
    offset = find_offset(obstacles.polygons, j, x, y)
    x, y = offset.x, offset.y
    # the variance of the squared distance along d is that of d.p, so that one row serves both axes
    row = interpolation_row(motion.responses, time, x, y)
    variance = x * x * own[0, 0] + 2 * x * y * own[0, 1] + y * y * own[1, 1]
    for u in range(len(row)):
        variance += row[u] * row[u] * control_variance[u]
    variance += _initial_variance(chance, time, x, y)
    return safety_factor(obstacles.size_mean[j] - offset.side * (x * x + y * y), obstacles.size_variance[j] + 4 * variance)


@compiled
def minimum_safety_factor(
    motion: Motion, chance: ChanceTerms, trajectory: Matrix, control: Vector, between_steps: bool
) -> MinimumSafetyFactor:
    """Return the minimum safety factor of a control (2N,) with a trajectory (4, N + 1).

    Beside each step whose k is smaller than its neighbours', the minimum is sought at the vertex of the parabola through three
    times, closer and closer. Where the mean is over a corner, there may be a kink.
    """
    mean, variance = constraint_moments(trajectory[:2, 1:].T.copy(), position_variances(chance.noise, control), chance.obstacles)
    m, steps = mean.shape
    least, row, moment = np.inf, 0, 1.0
    for j in range(m):
        for t in range(steps):
            if not _is_above(least, mean[j, t], variance[j, t]):
                k = safety_factor(mean[j, t], variance[j, t])
                if k < least:
                    least, row, moment = k, j, t + 1.0
    if not between_steps:
        return MinimumSafetyFactor(min(least, CERTAIN_K), row, moment)
    near = least + WORTH_REFINING * (1.0 + abs(least))
    control_variance = chance.noise.noise_variance * control * control
    for j in range(m):
        for t in range(1, steps - 1):
            if _is_above(near, mean[j, t], variance[j, t]):
                continue
            ka, kb, kc = (
                safety_factor(mean[j, t - 1], variance[j, t - 1]),
                safety_factor(mean[j, t], variance[j, t]),
                safety_factor(mean[j, t + 1], variance[j, t + 1]),
            )
            if not (kb <= ka and kb < kc and kb < near and ka < CERTAIN_K and kc < CERTAIN_K):
                continue
            bracket = Bracket(float(t), t + 1.0, t + 2.0, ka, kb, kc)
            for _ in range(PARABOLAS):
                time = find_vertex(bracket, VERTEX_TOLERANCE)
                if time == np.inf:
                    break
                bracket = narrow(bracket, time, _k_at_time(motion, chance, trajectory, control_variance, j, time))
            if bracket.at_b < least:
                least, row, moment = bracket.at_b, j, bracket.b
        for t in range(1, steps if chance.obstacles.polygons.corners[j] > 1 else 1):
            if _is_above(near, mean[j, t - 1], variance[j, t - 1]) and _is_above(near, mean[j, t], variance[j, t]):
                continue
            time = find_corner(chance.obstacles, trajectory, j, t + 0.5, 0.5).time
            k = _k_at_time(motion, chance, trajectory, control_variance, j, time) if time < np.inf else np.inf
            if k < least:
                least, row, moment = k, j, time
    return MinimumSafetyFactor(min(least, CERTAIN_K), row, moment)


def find_minimum_safety_factor(problem: Problem, control: Array, *, between_steps: bool) -> MinimumSafetyFactor:
    """Return the minimum over all obstacles and steps of a stacked control (2N,), or over the times between the steps too."""
    control = np.ascontiguousarray(control, dtype=float)
    motion, chance = problem.terms.motion, problem.terms.chance
    return minimum_safety_factor(motion, chance, problem.trajectory(control), control, between_steps)
