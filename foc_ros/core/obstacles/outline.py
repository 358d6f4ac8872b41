"""The outline of an obstacle as points, for pictures: an arc about each vertex of its polygon, joined by straight lines."""

from __future__ import annotations

import numpy as np

from foc_ros.core.types import Array, Obstacles

TURN = 2.0 * np.pi


def trace_outline(polygon: Array, radius: float, points: int = 64) -> Array:
    """Return points (k, 2) [m] of the boundary of all that lies within a radius [m] of a convex polygon.

    polygon (v, 2): vertices [m], anticlockwise; one is a circle. points: number of them on a full circle. They go round
    anticlockwise, and the last one is the first. The arc about a vertex begins at the outward normal of the edge before it and
    ends at that of the edge behind it.
    """
    edges = np.roll(polygon, -1, axis=0) - polygon
    normals = np.arctan2(-edges[:, 0], edges[:, 1])
    begins = np.roll(normals, 1)
    turns = np.mod(normals - begins, TURN) if len(polygon) > 1 else [TURN]
    arcs = []
    for vertex, begin, turn in zip(polygon, begins, turns, strict=True):
        angles = begin + np.linspace(0.0, turn, 1 + int(np.ceil(points * turn / TURN)) if radius else 1)
        arcs.append(vertex + radius * np.column_stack([np.cos(angles), np.sin(angles)]))
    return np.concatenate([*arcs, arcs[0][:1]])


def trace_obstacle(obstacles: Obstacles, row: int, growth: float = 0.0, points: int = 64) -> Array:
    """Return the outline (k, 2) [m] of one obstacle; growth [m]: added to its radius."""
    polygon = obstacles.centre[row] + obstacles.vertices[row, : obstacles.corners[row]]
    return trace_outline(polygon, float(obstacles.radius[row]) + growth, points)


def find_limits(obstacles: Obstacles, growth: Array | float = 0.0) -> tuple[Array, Array]:
    """Return the smallest and the largest x and y (n, 2) [m] of each obstacle; growth (n,) [m]: added to the radii."""
    reach = (obstacles.radius + growth)[:, None]
    return obstacles.centre + obstacles.vertices.min(axis=1) - reach, obstacles.centre + obstacles.vertices.max(axis=1) + reach
