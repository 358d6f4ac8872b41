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


@compiled_separately
def find_corner(obstacles: MovingObstacles | UncertainObstacles, trajectory: Matrix, j: int, s: float, reach: float) -> Corner:
    """Find the time nearest to s at which the nearest point of polygon j passes from an edge to a vertex, or back.

    reach: how far from s it may be, in steps. The mean counts as straight in between.
    """
    polygons, corners, found = obstacles.polygons, obstacles.polygons.corners[j], Corner(np.inf, 0.0, 0.0, 0.0, 0.0, 0.0)
    at, velocity, bend = interpolate(trajectory, s, 0), interpolate(trajectory, s, 1), interpolate(trajectory, s, 2)
    for k in range(corners if corners > 1 else 0):
        after = (k + 1) % corners
        x, y = (
            polygons.vertices[j, after, 0] - polygons.vertices[j, k, 0],
            polygons.vertices[j, after, 1] - polygons.vertices[j, k, 1],
        )
        length = np.hypot(x, y)
        x, y = x / length, y / length
        for end in (k, after):
            corner_x = obstacles.centre[j, 0] + s * obstacles.drift[j, 0] + polygons.vertices[j, end, 0]
            corner_y = obstacles.centre[j, 1] + s * obstacles.drift[j, 1] + polygons.vertices[j, end, 1]
            apart_x, apart_y = at[0] - corner_x, at[1] - corner_y
            speed = x * (velocity[0] - obstacles.drift[j, 0]) + y * (velocity[1] - obstacles.drift[j, 1])
            time = s - (x * apart_x + y * apart_y) / speed if speed != 0.0 else np.inf
            is_outside = y * apart_x - x * apart_y > 0.0 or corners == 2
            if is_outside and abs(time - s) < min(abs(found.time - s), reach):
                found = Corner(time, x, y, speed, x * bend[0] + y * bend[1], 0.0)
    return found
