"""Times at which the nearest point of a polygon passes from an edge to a vertex, where the margin may have a kink.

Along an edge the normal keeps its direction, about a vertex it turns. The standard deviation of the distance, sqrt(n'P n),
therefore changes at another rate before such a time than after it, and the margin may fall before it and rise after it.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from foc_ros.core.kernels import Matrix, Vector, compiled_separately
from foc_ros.core.ocp.terms import MovingObstacles, ProblemTerms

from .hermite import interpolate
from .surrogate import Margin, evaluate_margin

CORNER_REACH = 1.0
"""Time from a contact, in steps, within which it may be at a corner."""
TIME_STEP = 1e-3
"""Difference in time, in steps, by which derivatives by time are taken."""


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
def find_corner(obstacles: MovingObstacles, trajectory: Matrix, j: int, s: float) -> Corner:
    """Find the time nearest to s at which the nearest point of polygon j passes from an edge to a vertex, or back."""
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
            if is_outside and abs(time - s) < min(abs(found.time - s), CORNER_REACH):
                found = Corner(time, x, y, speed, x * bend[0] + y * bend[1], 0.0)
    return found


@compiled_separately
def find_kink(
    terms: ProblemTerms, obstacles: MovingObstacles, trajectory: Matrix, control: Vector, j: int, s: float, k: float
) -> tuple[Corner, tuple[Margin, Margin, Margin]]:
    """Find a corner near time s at which the margin of obstacle j is least, as it falls before it and rises after it.

    Returns the corner, with an infinite time if there is none, and the margins that `hold_at_corner` needs.
    """
    corner = find_corner(obstacles, trajectory, j, s)
    none = Corner(np.inf, 0.0, 0.0, 0.0, 0.0, 0.0)
    at = evaluate_margin(terms, obstacles, trajectory, control, j, s, k, 0.0)
    if not max(terms.chance.obstacles.ignored_until[j], 1.0) < corner.time < trajectory.shape[1] - 1.0:
        return none, (at, at, at)
    at = evaluate_margin(terms, obstacles, trajectory, control, j, corner.time, k, 0.0)
    before = evaluate_margin(terms, obstacles, trajectory, control, j, corner.time - TIME_STEP, k, at.scale)
    after = evaluate_margin(terms, obstacles, trajectory, control, j, corner.time + TIME_STEP, k, at.scale)
    if not before.value > at.value < after.value or before.is_on_edge == after.is_on_edge:
        return none, (at, at, at)
    step, near = (TIME_STEP, after) if before.is_on_edge else (-TIME_STEP, before)
    far = evaluate_margin(terms, obstacles, trajectory, control, j, corner.time + 2.0 * step, k, at.scale)
    return Corner(corner.time, corner.x, corner.y, corner.speed, corner.growth, step), (at, near, far)
