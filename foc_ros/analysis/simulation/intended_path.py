"""The path that an operator intends: of minimum jerk through via points round the obstacles as the operator sees them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import make_interp_spline

from foc_ros.core.obstacles.geometry import measure_offsets
from foc_ros.core.types import Array, Obstacles, Record

DT = 0.005
"""Time step of the simulation [s]."""
MEAN_SPEED = 0.25
"""Mean speed of a movement [m/s]."""
CLEARANCE_M = (0.003, 0.01)
"""Range of the distance that an operator plans to keep from an obstacle."""
FREE_M = 0.001
"""Distance that an intended path keeps from every obstacle as the operator sees it."""
MOST_VIA_POINTS = 5
PREFERS_SHORTER = 0.75
"""Probability that an operator passes an obstacle on the shorter side."""


@dataclass(frozen=True, eq=False)
class IntendedPath(Record):
    """Positions [m], velocities [m/s] and accelerations [m/s^2] of a movement, (n, 2) each, at steps of `DT`."""

    position: Array
    velocity: Array
    acceleration: Array

    def join(self, steps: int, rest: IntendedPath) -> IntendedPath:
        """Return the path with another one behind its first steps."""
        parts = ((self.position, rest.position), (self.velocity, rest.velocity), (self.acceleration, rest.acceleration))
        return IntendedPath(*(np.concatenate([before[:steps], behind]) for before, behind in parts))


def interpolate_minimum_jerk(points: Array, times: Array, start: tuple[Array, Array]) -> IntendedPath:
    """Return the path of least integrated squared jerk through points (k, 2) [m] at times (k,) [s], at rest at its end.

    With fixed times this is the quintic spline with knots at the via points (Flash and Hogan 1985, doi
    10.1523/JNEUROSCI.05-07-01688.1985). start: velocity (2,) [m/s] and acceleration (2,) [m/s^2] at the first point.
    """
    conditions = ([(1, start[0]), (2, start[1])], [(1, np.zeros(2)), (2, np.zeros(2))])
    spline = make_interp_spline(times, points, k=5, bc_type=conditions)
    at = np.append(np.arange(0.0, times[-1], DT), times[-1])
    return IntendedPath(spline(at), spline(at, 1), spline(at, 2))


def plan_path(
    rng: np.random.Generator, start: Array, goal: Array, seen: Obstacles, moving: tuple[Array, Array] | None = None
) -> IntendedPath | None:
    """Return an intended path to a goal among obstacles as the operator sees them; None if no few via points lead there.

    A via point is set beside the obstacle that the path comes nearest to, until the path is free. moving: velocity [m/s] and
    acceleration [m/s^2] at the start, (2,) each; at rest if not given.
    """
    points = [start, goal]
    for _ in range(MOST_VIA_POINTS):
        path = _time_path(np.array(points), moving or (np.zeros(2), np.zeros(2)))
        offsets, distances = measure_offsets(path.position, seen)
        heights = distances - seen.radius
        if not len(seen) or heights.min() >= FREE_M:
            return path
        step, row = np.unravel_index(heights.argmin(), heights.shape)
        points = _add_via_point(rng, points, path.position[step], offsets[step, row], float(seen.extent[row]), seen.centre[row])
    return None


def _add_via_point(
    rng: np.random.Generator, points: list[Array], near: Array, offset: Array, extent: float, centre: Array
) -> list[Array]:
    """Return the points with one more beside an obstacle, on the shorter side with the probability `PREFERS_SHORTER`."""
    along = points[-1] - points[0]
    left = np.array([-along[1], along[0]]) / np.hypot(*along)
    side = 1.0 if offset @ left > 0.0 else -1.0
    if rng.random() > PREFERS_SHORTER:
        side = -side
    via = centre + side * (extent + rng.uniform(*CLEARANCE_M)) * left
    others = [each for each in points[1:-1] if np.hypot(*(each - near)) > extent + CLEARANCE_M[1]]
    return [points[0], *sorted([*others, via], key=lambda each: float(each @ along)), points[-1]]


def _time_path(points: Array, moving: tuple[Array, Array]) -> IntendedPath:
    """Return a path through points whose times are those of a straight minimum-jerk movement of the same length."""
    lengths = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(points, axis=0).T))])
    s = np.linspace(0.0, 1.0, 201)
    shares = np.interp(lengths / lengths[-1], 10 * s**3 - 15 * s**4 + 6 * s**5, s)
    if moving[0].any():  # it has begun: the first half of the profile is past
        shares = lengths / lengths[-1]
    return interpolate_minimum_jerk(points, shares * max(lengths[-1] / MEAN_SPEED, 0.4), moving)
