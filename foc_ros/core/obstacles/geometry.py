# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The nearest point of a convex polygon: all that the numeric core knows of the shape of an obstacle.

An obstacle is the set of points within a distance R of a convex polygon with one vertex (circle), two (capsule) or more (box,
hull). With q(p) the point of the polygon nearest to p and d = p - q(p), the signed distance D is |d| outside the polygon and -|d|
inside it, and n = d / D points away from the obstacle. Where q is a vertex n turns as p moves; where q is on an edge it does not.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from foc_ros.core.obstacle_table import Edges, Obstacles
from foc_ros.core.types import Array, as_readonly

SMALLEST_DISTANCE = 1e-13
"""Distance [m] below which a point counts as on the polygon, where its normal is not defined: rounding."""


class Offset(NamedTuple):
    """Points relative to polygons: signed distance D [m], outward unit normal n, and whether the nearest point is on an edge."""

    distance: Array
    normal_x: Array
    normal_y: Array
    is_on_edge: NDArray[np.bool_]


def find_offset(x: Array, y: Array, edges: Edges) -> Offset:
    """Return the positions of points relative to polygons.

    Parameters
    ----------
    x, y : Array
        Points relative to the centres of the polygons [m], of any shape (...).
    edges : Edges
        Edges of the polygons; each field has a shape that broadcasts to (..., V).

    Returns
    -------
    Offset
        Arrays of shape (...).
    """
    if edges.x.shape[-1] == 1:
        no = np.zeros(x.shape, dtype=np.bool_)
        return _point(x - edges.x[..., 0], y - edges.y[..., 0], no, no)
    from_x, from_y = x[..., None] - edges.x, y[..., None] - edges.y
    share = (from_x * edges.along_x + from_y * edges.along_y) * edges.inverse_square
    left = edges.along_x * from_y - edges.along_y * from_x
    held = np.minimum(np.maximum(share, 0.0), 1.0)
    off_x, off_y = from_x - held * edges.along_x, from_y - held * edges.along_y
    nearest = (off_x * off_x + off_y * off_y).argmin(axis=-1)
    shape, flat = nearest.shape, np.arange(nearest.size) * share.shape[-1] + nearest.ravel()
    x, y, share, left = (each.ravel()[flat].reshape(shape) for each in (off_x, off_y, share, left))
    is_on_edge = (share > 0.0) & (share < 1.0)
    # the nearest point to one inside of a convex polygon is on an edge, of which this one is on the left
    return _point(x, y, is_on_edge & (left >= 0.0) & edges.is_solid[..., 0], is_on_edge)


def _point(x: Array, y: Array, is_inside: NDArray[np.bool_], is_on_edge: NDArray[np.bool_]) -> Offset:
    """Return the offset for a vector from the nearest point; one without length points along the y axis."""
    length = np.sqrt(x * x + y * y)
    is_short = length < SMALLEST_DISTANCE
    if is_short.any():
        x, y, length = np.where(is_short, 0.0, x), np.where(is_short, SMALLEST_DISTANCE, y), np.maximum(length, SMALLEST_DISTANCE)
    distance = np.where(is_inside, -length, length)
    return Offset(distance, x / distance, y / distance, is_on_edge)


def measure_offsets(points: Array, obstacles: Obstacles, centres: Array | None = None) -> tuple[Array, Array]:
    """Return the positions of points relative to the polygons of obstacles.

    Parameters
    ----------
    points : Array
        Points (q, 2) [m].
    obstacles : Obstacles
        n obstacles.
    centres : Array, optional
        Where the obstacles are at each point, (q, n, 2) [m], if they move.

    Returns
    -------
    Array, Array
        d (q, n, 2) [m], from the nearest point of each polygon, and signed distances (q, n) [m] from the polygons: the boundary
        of a circle is at its radius.
    """
    relative = np.reshape(points, (-1, 1, 2)) - (obstacles.centre[None] if centres is None else centres)
    found = find_offset(relative[..., 0], relative[..., 1], obstacles.edges)
    offsets = np.stack((found.normal_x, found.normal_y), axis=-1) * found.distance[..., None]
    return offsets, found.distance


def find_holders(
    goals: Array, obstacles: Obstacles, objects: Sequence[str | None] = (), times_s: Sequence[float] = ()
) -> NDArray[np.bool_]:
    """Tell which of n obstacles are goals (g, 2) [m], (g, n): those that hold a goal, or are named as the object of it.

    times_s: the time to go to each goal [s]. An obstacle has to hold the goal at this time, too: one that only moves over a goal
    is not the goal.
    """
    is_held: NDArray[np.bool_] = measure_offsets(goals, obstacles)[1] < obstacles.radius
    if len(times_s) and obstacles.velocity.any():
        centres = obstacles.centre + np.reshape(times_s, (-1, 1, 1)) * obstacles.velocity
        is_held &= measure_offsets(goals, obstacles, centres)[1] < obstacles.radius
    for row, name in enumerate(objects):
        if name is not None:
            is_held[row] |= np.array([each == name for each in obstacles.ids], dtype=bool)
    return is_held


TURN = 2.0 * np.pi


def trace_obstacle(obstacles: Obstacles, row: int, growth: float = 0.0, points: int = 64) -> Array:
    """Return points (k, 2) [m] of the outline of one obstacle: of all that lies within its radius of its polygon.

    growth [m]: added to the radius; points: number of them on a full circle. They go round anticlockwise, and the last one is the
    first. The arc about a vertex begins at the outward normal of the edge before it and ends at that of the edge behind it.
    """
    polygon = obstacles.vertices[row, : obstacles.corners[row]].tobytes()
    outline: Array = obstacles.centre[row] + trace_shape(polygon, float(obstacles.radius[row]) + growth, points)
    return outline


@lru_cache(maxsize=1024)
def trace_shape(vertices: bytes, radius: float, points: int) -> Array:
    """Return the outline of an obstacle as `trace_obstacle` does, relative to its centre; the last outlines are kept."""
    polygon = np.frombuffer(vertices).reshape(-1, 2)
    edges = np.roll(polygon, -1, axis=0) - polygon
    normals = np.arctan2(-edges[:, 0], edges[:, 1])
    begins = np.roll(normals, 1)
    turns = np.mod(normals - begins, TURN) if len(polygon) > 1 else [TURN]
    arcs = []
    for vertex, begin, turn in zip(polygon, begins, turns, strict=True):
        angles = begin + np.linspace(0.0, turn, 1 + int(np.ceil(points * turn / TURN)) if radius else 1)
        arcs.append(vertex + radius * np.column_stack([np.cos(angles), np.sin(angles)]))
    return as_readonly(np.concatenate([*arcs, arcs[0][:1]]))


def find_limits(obstacles: Obstacles, growth: Array | float = 0.0) -> tuple[Array, Array]:
    """Return the smallest and the largest x and y (n, 2) [m] of each obstacle; growth (n,) [m]: added to the radii."""
    reach = (obstacles.radius + growth)[:, None]
    return obstacles.centre + obstacles.vertices.min(axis=1) - reach, obstacles.centre + obstacles.vertices.max(axis=1) + reach
