"""The arrays of a problem, stacked over its horizon, in machine code: courses, variances, weights, goal rows, circles."""

from __future__ import annotations

import numpy as np

from foc_ros.core.kernels import Flags, Indices, Matrix, Tensor, Vector, compiled
from foc_ros.core.obstacles.chance_constraint import safety_factor, variance_at

from .impulse_response import apply_impulse_response


@compiled
def scene_extent(way_x: float, way_y: float, radius: Vector) -> float:
    """Return the length of the way to the goal, or the largest radius (m,) if that is more [m]; never zero."""
    largest = max(float(np.hypot(way_x, way_y)), 1e-6)
    for j in range(len(radius)):
        largest = max(largest, radius[j])
    return float(largest)


@compiled
def propagate_without_control(powers: Tensor, mean: Vector, dt: float) -> tuple[Matrix, Matrix, Matrix]:
    """Return states (N + 1, n), positions (N, 2) and course (4, N + 1), velocities per step of dt [s], of a mean (n,) alone."""
    times, n, _ = powers.shape
    states, positions, course = np.zeros((times, n)), np.empty((times - 1, 2)), np.empty((4, times))
    for t in range(times):
        for i in range(n):
            for j in range(n):
                states[t, i] += powers[t, i, j] * mean[j]
        for axis in range(2):
            course[axis, t], course[2 + axis, t] = states[t, axis], states[t, 2 + axis] * dt
            if t > 0:
                positions[t - 1, axis] = states[t, axis]
    return states, positions, course


@compiled
def variance_weights(states: Tensor, end: Vector, way: Vector) -> Vector:
    """Return d (2N,), where d.u^2 is what a control's noise u adds to sum_i end_i X_i(N)^2 + way_i sum_{t < N} X_i(t)^2.

    states (n, 2, N + 1): responses as in `driven`; end, way (n,).
    """
    n, _, times = states.shape
    steps = times - 1
    total = np.zeros(2 * steps)
    for i in range(n):
        if end[i] == 0.0 and way[i] == 0.0:
            continue
        for channel in range(2):
            before = 0.0
            for since in range(1, times):
                square = states[i, channel, since] ** 2
                total[channel * steps + steps - since] += end[i] * square + way[i] * before
                before += square
    return total


@compiled
def build_goal_rows(last: Matrix, missing: Vector, fixed: Flags, weights: Vector) -> tuple[Matrix, Vector, Vector]:
    """Return the goal rows of the last step: those of fixed states (n,), then those with a weight (n,); targets and softness.

    last (n, 2N): what the states there owe to the control; missing (n,): what they are short of the goal without any.
    """
    n, count = len(fixed), 0
    order = np.empty(n, np.intp)
    for hard in (True, False):
        for i in range(n):
            if fixed[i] == hard and (hard or weights[i] > 0.0):
                order[count] = i
                count += 1
    rows, targets, softness = np.empty((count, last.shape[1])), np.empty(count), np.zeros(count)
    for r in range(count):
        rows[r], targets[r] = last[order[r]], missing[order[r]]
        if not fixed[order[r]]:
            softness[r] = 0.5 / weights[order[r]]
    return rows, targets, softness


@compiled
def find_inside_margin(
    position: Vector, covariance: Matrix, centre: Matrix, size_mean: Vector, size_variance: Vector, own: Tensor, wanted_k: float
) -> Flags:
    """Tell for each circle (m,) whether a position (n,) of a covariance (n, n) has less than the wanted k, with own (m, 2, 2)."""
    flags = np.zeros(len(centre), np.bool_)
    for j in range(len(centre)):
        x, y = position[0] - centre[j, 0], position[1] - centre[j, 1]
        xx, yy, xy = covariance[0, 0] + own[j, 0, 0], covariance[1, 1] + own[j, 1, 1], covariance[0, 1] + own[j, 0, 1]
        flags[j] = safety_factor(size_mean[j] - x * x - y * y, variance_at(x, y, xx, yy, xy, size_variance[j])) < wanted_k
    return flags


@compiled
def find_duplicates(centre: Matrix, drift: Matrix, reach: Vector, tolerance: float) -> Indices:
    """Return for each circle the first that differs by less than a tolerance [m] in place, drift per step and reach, (m,)."""
    first = np.arange(len(reach))
    for i in range(len(reach)):
        for j in range(i):
            largest_difference = abs(reach[i] - reach[j])
            for axis in range(2):
                largest_difference = max(
                    largest_difference, abs(centre[i, axis] - centre[j, axis]), abs(drift[i, axis] - drift[j, axis])
                )
            if largest_difference < tolerance:
                first[i] = j
                break
    return first


@compiled
def mean_positions(position: Tensor, control: Vector, free: Matrix) -> Matrix:
    """Return free + S u, (N, 2), for the responses (2, 2, N + 1) of the position."""
    positions: Matrix = free + apply_impulse_response(position, control)[:, 1:].T
    return positions


@compiled
def apart(position: Tensor, control: Vector, other: Vector) -> float:
    """Return the largest difference in x or y between the means of two controls (2N,) [m]; position (2, 2, N + 1)."""
    return float(np.abs(apply_impulse_response(position, control - other)).max())


@compiled
def position_variances(maps: Tensor, noise_variance: Vector, control: Vector, free: Matrix) -> Matrix:
    """Return the rows xx, yy, xy of free + V u^2, (3, N), for `Horizon.maps` (5, 2, N + 1) and c^2 (2N,)."""
    variance: Matrix = free + apply_impulse_response(maps[2:], noise_variance * control * control)[:, 1:]
    return variance
