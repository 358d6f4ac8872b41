"""Times at which the nearest point of a polygon passes from an edge to a vertex, where the margin may have a kink.

Along an edge the normal keeps its direction, about a vertex it turns. The standard deviation of the distance, sqrt(n'P n),
therefore changes at another rate before such a time than after it, and the margin may fall before it and rise after it.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from foc_ros.core.kernels import Matrix, compiled_separately
from foc_ros.core.obstacles.chance_constraint import UncertainObstacles
from foc_ros.core.ocp.terms import MovingObstacles

from .hermite import interpolate

REFINEMENTS = 3
"""Newton steps to the time of a corner: from a tenth of a step, two are usual."""


class Corner(NamedTuple):
    """A time at which the nearest point of a polygon is the end of an edge, infinite if there is none near.

    x, y: direction of the edge; speed, growth: of the mean along it, per step [m], and its rate; step: of time, from the corner
    to the side of the vertex.
    """

    time: float
    x: float
    y: float
    speed: float
    growth: float
    step: float


NO_CORNER = Corner(np.inf, 0.0, 0.0, 0.0, 0.0, 0.0)


@compiled_separately
def find_corner(obstacles: MovingObstacles | UncertainObstacles, trajectory: Matrix, j: int, s: float, reach: float) -> Corner:
    """Find the time nearest to s at which the nearest point of polygon j passes from an edge to a vertex, or back.

    reach: how far from s it may be, in steps. The time is that of a straight mean first, and then found by Newton's method.
    """
    polygons, corners, nearest = obstacles.polygons, obstacles.polygons.corners[j], reach
    found, vertex = NO_CORNER, 0
    at, velocity = interpolate(trajectory, s, 0), interpolate(trajectory, s, 1)
    at_x, at_y = (
        at[0] - obstacles.centre[j, 0] - s * obstacles.drift[j, 0],
        at[1] - obstacles.centre[j, 1] - s * obstacles.drift[j, 1],
    )
    for k in range(corners if corners > 1 else 0):
        after = (k + 1) % corners
        x = polygons.vertices[j, after, 0] - polygons.vertices[j, k, 0]
        y = polygons.vertices[j, after, 1] - polygons.vertices[j, k, 1]
        length = np.hypot(x, y)
        x, y = x / length, y / length
        speed = x * (velocity[0] - obstacles.drift[j, 0]) + y * (velocity[1] - obstacles.drift[j, 1])
        for end in (k, after):
            apart_x, apart_y = at_x - polygons.vertices[j, end, 0], at_y - polygons.vertices[j, end, 1]
            shift = -(x * apart_x + y * apart_y) / speed if speed != 0.0 else np.inf
            is_outside = y * apart_x - x * apart_y > 0.0 or corners == 2
            if is_outside and abs(shift) < nearest:
                nearest, vertex, found = abs(shift), end, Corner(s + shift, x, y, speed, 0.0, 0.0)
    if not 0.0 <= found.time <= trajectory.shape[1] - 1.0:
        return NO_CORNER
    time, x, y, speed = found.time, found.x, found.y, found.speed
    for _ in range(REFINEMENTS):
        at, velocity = interpolate(trajectory, time, 0), interpolate(trajectory, time, 1)
        at_x, at_y = (
            at[0] - obstacles.centre[j, 0] - time * obstacles.drift[j, 0],
            at[1] - obstacles.centre[j, 1] - time * obstacles.drift[j, 1],
        )
        along = x * (at_x - polygons.vertices[j, vertex, 0]) + y * (at_y - polygons.vertices[j, vertex, 1])
        speed = x * (velocity[0] - obstacles.drift[j, 0]) + y * (velocity[1] - obstacles.drift[j, 1])
        time = time - along / speed if speed != 0.0 else np.inf
        if not max(s - reach, 0.0) <= time <= min(s + reach, trajectory.shape[1] - 1.0):
            return NO_CORNER
    bend = interpolate(trajectory, time, 2)
    return Corner(time, x, y, speed, x * bend[0] + y * bend[1], 0.0)
