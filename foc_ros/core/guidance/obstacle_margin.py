"""The margins of the obstacles: convex polygons of short edges that no force leads into."""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, pi, sin

import numpy as np

from foc_ros.core.obstacles.outline import trace_obstacle
from foc_ros.core.types import Array, Obstacles, Record

POINTS = 32
"""Number of edges round a circle."""
TOLERANCE = sin(pi / POINTS)
"""Sine of the largest angle between the normal of an edge and the true one of an arc that it stands for."""
NEAR_M = 0.001
"""Distance [m] from a margin within which there is no force into it."""


@dataclass(frozen=True, eq=False)
class Margins(Record):
    """The margins of n obstacles as convex polygons of k edges each; edges that a polygon does not have repeat its first.

    start, edge, normal (n, k, 2): first corner [m], vector to the next [m], and outward unit normal of each edge.
    """

    start: Array
    edge: Array
    normal: Array

    def __len__(self) -> int:
        return len(self.start)


def build_margins(obstacles: Obstacles, growth: float) -> Margins:
    """Return the polygons about obstacles that are larger by a growth [m]; they contain the rounded shapes."""
    extra = [(growth + radius) / cos(pi / POINTS) - radius for radius in obstacles.radius.tolist()]
    outlines = [trace_obstacle(obstacles, row, extra[row], POINTS) for row in range(len(obstacles))]
    most = max((len(each) - 1 for each in outlines), default=1)
    start, edge = np.zeros((len(outlines), most, 2)), np.zeros((len(outlines), most, 2))
    for row, outline in enumerate(outlines):
        edges = np.diff(outline, axis=0)
        is_long = np.hypot(edges[:, 0], edges[:, 1]) > 1e-12
        corners, edges = outline[:-1][is_long], edges[is_long]
        start[row], edge[row] = corners[0], edges[0]
        start[row, : len(edges)], edge[row, : len(edges)] = corners, edges
    lengths = np.hypot(edge[..., 0], edge[..., 1])[..., None]
    return Margins(start, edge, np.stack([edge[..., 1], -edge[..., 0]], axis=-1) / lengths)


def turn_along(margins: Margins, position: Array, reference: Array, force: Array) -> Array:
    """Return a force (2,) without its part into margins that the line from the hand to the reference crosses.

    With n the outward normal of the edge that is nearest to the hand, f <- f + max(-f . n, 0) n for one obstacle after the other.
    """
    for row in np.flatnonzero(_find_crossed(margins, position, reference - position)):
        distances = _measure_distances(margins, position)[row]
        normal = margins.normal[row, distances.argmin()]
        force = force + max(-float(force @ normal), 0.0) * normal
    return force


def measure_opposing_distance(margins: Margins, position: Array, force: Array) -> float:
    """Return the distance [m] of the hand from the nearest edge into which a force (2,) leads; infinite if there is none.

    Edges whose normal is within `TOLERANCE` of a right angle to the force count as well. Within a margin, the distance of its
    nearest edge is 0.
    """
    if not len(margins):
        return float('inf')
    outward = margins.normal @ force
    is_opposing = outward < TOLERANCE * float(np.hypot(*force))
    distances = _measure_distances(margins, position)
    is_nearest = distances <= distances.min(axis=1, keepdims=True) + 1e-12
    is_inside = _measure_heights(margins, position).max(axis=1, keepdims=True) < 0.0
    distances = np.where(is_inside & is_nearest, 0.0, distances)
    return float(np.where(is_opposing, distances, np.inf).min())


def _measure_heights(margins: Margins, position: Array) -> Array:
    """Return by how much the hand is outside the line of each edge, (n, k) [m]."""
    heights: Array = ((position - margins.start) * margins.normal).sum(axis=-1)
    return heights


def _measure_distances(margins: Margins, position: Array) -> Array:
    """Return the distance of the hand from each edge, (n, k) [m]."""
    offset, edge = position - margins.start, margins.edge
    share = np.clip((offset * edge).sum(axis=-1) / (edge**2).sum(axis=-1), 0.0, 1.0)
    away = offset - share[..., None] * edge
    distances: Array = np.hypot(away[..., 0], away[..., 1])
    return distances


def _find_crossed(margins: Margins, position: Array, line: Array) -> Array:
    """Return which margins (n,) a line (2,) [m] from the hand crosses (clipping by Cyrus and Beck)."""
    if not len(margins):
        return np.zeros(0)
    heights, slopes = _measure_heights(margins, position), margins.normal @ line
    at = -heights / np.where(slopes == 0.0, 1.0, slopes)
    enters = np.where(slopes < 0.0, at, 0.0).max(axis=1)
    leaves = np.where(slopes > 0.0, at, 1.0).min(axis=1)
    is_beside = ((slopes == 0.0) & (heights > 0.0)).any(axis=1)
    crossed: Array = (np.maximum(enters, 0.0) < np.minimum(leaves, 1.0)) & ~is_beside
    return crossed
