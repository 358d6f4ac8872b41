"""The distance that the mean has to keep from obstacles: how large it is at any time, and where a trajectory comes nearer."""

from __future__ import annotations

from typing import TypeAlias

import numpy as np

from foc_ros.core.kernels import Matrix, compiled, compiled_with_caller
from foc_ros.core.obstacles.rounded_polygon import find_normal, find_offset, measure_extent

from .contacts.hermite import interpolate
from .terms import MovingObstacles

ROOT_STEPS = 40
"""Most steps of regula falsi or bisection to the time of closest approach within a step; five are usual."""
ROOT_TOLERANCE = 1e-12
"""Bracket of that time at which the search ends, in steps."""

SMALLEST_DISTANCE = 1e-12
"""Least distance from a polygon by which an offset is divided [m]."""

RelativeState: TypeAlias = tuple[float, float, float, float]
"""Position and velocity per step relative to a centre: x, y, vx, vy [m]."""


@compiled_with_caller
def required_distance(obstacles: MovingObstacles, j: int, time: float) -> tuple[float, float, float]:
    """Return the distance to keep from polygon j at a time [m], with its first and second derivative by time in steps.

    The distance is the reach, less what the hand was short of at step 0 and may still be short of: that share falls to zero as a
    minimum-jerk movement does, so that the problem asks for a way out of an obstacle, not for a jump.
    """
    reach, missing, s = obstacles.reach[j], obstacles.missing[j], time * obstacles.pace
    if missing <= 0.0 or s >= 1.0:
        return reach, 0.0, 0.0
    left = 1.0 - s**3 * (10.0 - 15.0 * s + 6.0 * s**2)
    rate, bend = 30.0 * s**2 * (1.0 - s) ** 2, 60.0 * s * (1.0 - s) * (1.0 - 2.0 * s)
    return reach - missing * left, missing * rate * obstacles.pace, missing * bend * obstacles.pace**2


@compiled
def find_deepest(positions: Matrix, obstacles: MovingObstacles) -> tuple[float, int, int]:
    """Return by how much positions (N, 2) at steps 1..N come too near at most [m], the obstacle and the step; -inf for none."""
    deepest, row, step = -np.inf, 0, 0
    for j in range(len(obstacles.reach)):
        for t in range(1, len(positions) + 1):
            x = positions[t - 1, 0] - (obstacles.centre[j, 0] + t * obstacles.drift[j, 0])
            y = positions[t - 1, 1] - (obstacles.centre[j, 1] + t * obstacles.drift[j, 1])
            distance, _, _ = find_normal(find_offset(obstacles.polygons, j, x, y), SMALLEST_DISTANCE)
            depth = required_distance(obstacles, j, float(t))[0] - distance
            if depth > deepest:
                deepest, row, step = depth, j, t
    return deepest, row, step


@compiled_with_caller
def _relative_to(trajectory: Matrix, obstacles: MovingObstacles, j: int, t: int) -> RelativeState:
    """Return the state of a trajectory relative to centre j at step t."""
    dx, dy = obstacles.drift[j, 0], obstacles.drift[j, 1]
    x, y = trajectory[0, t] - obstacles.centre[j, 0] - t * dx, trajectory[1, t] - obstacles.centre[j, 1] - t * dy
    return x, y, trajectory[2, t] - dx, trajectory[3, t] - dy


@compiled_with_caller
def _compute_clearance(relative: RelativeState, obstacles: MovingObstacles, j: int, time: float) -> tuple[float, float]:
    """Return how much farther than required a relative position is from polygon j [m], and the rate of that per step."""
    x, y, vx, vy = relative
    distance, normal_x, normal_y = find_normal(find_offset(obstacles.polygons, j, x, y), SMALLEST_DISTANCE)
    required, growth, _ = required_distance(obstacles, j, time)
    return distance - required, normal_x * vx + normal_y * vy - growth


@compiled_with_caller
def _clearance_at(trajectory: Matrix, obstacles: MovingObstacles, j: int, time: float) -> tuple[float, float]:
    """Return the same for a trajectory (4, N + 1) at any time."""
    p, v = interpolate(trajectory, time, 0), interpolate(trajectory, time, 1)
    dx, dy = obstacles.drift[j, 0], obstacles.drift[j, 1]
    x, y = p[0] - obstacles.centre[j, 0] - time * dx, p[1] - obstacles.centre[j, 1] - time * dy
    return _compute_clearance((x, y, v[0] - dx, v[1] - dy), obstacles, j, time)


@compiled_with_caller
def _find_closest(
    trajectory: Matrix, obstacles: MovingObstacles, j: int, begin: float, rate_begin: float, rate_end: float
) -> float:
    """Return the time within the step from `begin` at which the rate passes zero: regula falsi, with bisections in between."""
    low, high, below, above = begin, begin + 1.0, rate_begin, rate_end
    time = begin
    for i in range(ROOT_STEPS):
        time = (low + high) / 2 if i % 3 == 2 else (low * above - high * below) / (above - below)
        _, rate = _clearance_at(trajectory, obstacles, j, time)
        if rate < 0.0:
            low, below = time, rate
        else:
            high, above = time, rate
        if high - low < ROOT_TOLERANCE or abs(rate) < ROOT_TOLERANCE * (above - below + 1e-9):
            break
    return time


@compiled_with_caller
def _longest_step(trajectory: Matrix) -> float:
    """Return a bound on how far a trajectory gets within a step [m]."""
    longest, before = 0.0, 0.0
    for t in range(trajectory.shape[1]):
        speed = np.sqrt(trajectory[2, t] ** 2 + trajectory[3, t] ** 2)
        if t > 0:
            x, y = trajectory[0, t] - trajectory[0, t - 1], trajectory[1, t] - trajectory[1, t - 1]
            longest = max(longest, np.sqrt(x * x + y * y) + before + speed)
        before = speed
    return longest


@compiled_with_caller
def _is_far(trajectory: Matrix, obstacles: MovingObstacles, j: int, distance: float) -> bool:
    """Tell whether centre j is farther than a distance from the positions at all steps."""
    nearest = np.inf
    for t in range(trajectory.shape[1]):
        x, y, _, _ = _relative_to(trajectory, obstacles, j, t)
        nearest = min(nearest, x * x + y * y)
    return nearest > distance * distance


@compiled
def find_penetrations(trajectory: Matrix, obstacles: MovingObstacles, tolerance: float) -> Matrix:
    """Return the closest approaches of a trajectory (4, N + 1) that are too near, (q, 2): row of the obstacle, time in steps.

    Only times from step 1 on are searched, because the hand cannot change where it is before. Between two steps there is an
    approach where the distance to spare falls at the first and grows at the second.
    """
    m, last = len(obstacles.reach), trajectory.shape[1] - 1
    found, count = np.empty((m * (last + 1), 2)), 0
    travelled = _longest_step(trajectory)
    for j in range(m):
        reach = obstacles.reach[j] + measure_extent(obstacles.polygons, j)
        if _is_far(trajectory, obstacles, j, reach + travelled + np.hypot(obstacles.drift[j, 0], obstacles.drift[j, 1])):
            continue
        spare_before, rate_before = 0.0, 0.0
        for t in range(1, last + 1):
            spare, rate = _compute_clearance(_relative_to(trajectory, obstacles, j, t), obstacles, j, float(t))
            time = -1.0
            if t == 1 and rate >= 0.0:
                time = 1.0
            elif t > 1 and rate_before < 0.0 <= rate and min(spare, spare_before) < abs(rate_before) + abs(rate):
                time = _find_closest(trajectory, obstacles, j, t - 1.0, rate_before, rate)
            if t == last and rate < 0.0:
                time = float(last)
            if time > 0.0 and _clearance_at(trajectory, obstacles, j, time)[0] < -tolerance:
                found[count, 0], found[count, 1] = j, time
                count += 1
            spare_before, rate_before = spare, rate
    return found[:count].copy()
