"""The margins of the obstacles: convex polygons of short edges that no force leads into."""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, pi, sin

import numpy as np
from numpy.typing import NDArray

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


@dataclass(frozen=True, eq=False)
class SeenMargins(Record):
    """The margins as seen from a hand.

    normal (n, k, 2): outward unit normals of the edges. height (n, k): by how much the hand is outside the line of each edge [m].
    distance (n, k): from each edge [m]; that of the nearest edge is 0 within a margin.
    """

    normal: Array
    height: Array
    distance: Array


def see_margins(margins: Margins, position: Array) -> SeenMargins:
    """Return the margins as seen from a hand at a position (2,) [m]."""
    offset, edge = position - margins.start, margins.edge
    height = (offset * margins.normal).sum(axis=-1)
    share = np.minimum(np.maximum((offset * edge).sum(axis=-1) / (edge * edge).sum(axis=-1), 0.0), 1.0)
    away = offset - share[..., None] * edge
    distance = np.hypot(away[..., 0], away[..., 1])
    is_inside = (height.max(axis=1) < 0.0)[:, None]
    is_nearest = distance <= distance.min(axis=1)[:, None] + 1e-12
    return SeenMargins(margins.normal, height, np.where(is_inside & is_nearest, 0.0, distance))


def turn_along(seen: SeenMargins, line: Array, force: Array) -> Array:
    """Return a force (2,) without its part into margins that a line (2,) [m] from the hand crosses.

    With n the outward normal of the edge that is nearest to the hand, f <- f + max(-f . n, 0) n for one obstacle after the other.
    """
    for row in _find_crossed(seen, line):
        normal = seen.normal[row, seen.distance[row].argmin()]
        force = force + max(-float(force @ normal), 0.0) * normal
    return force


def measure_opposing_distance(seen: SeenMargins, force: Array) -> float:
    """Return the distance [m] of the hand from the nearest edge into which a force (2,) leads; infinite if there is none.

    Edges whose normal is within `TOLERANCE` of a right angle to the force count as well.
    """
    is_opposing = seen.normal @ force < TOLERANCE * float(np.hypot(*force))
    return float(seen.distance[is_opposing].min(initial=np.inf))


def _find_crossed(seen: SeenMargins, line: Array) -> NDArray[np.intp]:
    """Return the rows of the margins that a line (2,) [m] from the hand crosses (clipping by Cyrus and Beck)."""
    slopes = seen.normal @ line
    at = -seen.height / np.where(slopes == 0.0, 1.0, slopes)
    enters = np.where(slopes < 0.0, at, 0.0).max(axis=1)
    leaves = np.where(slopes > 0.0, at, 1.0).min(axis=1)
    is_beside = ((slopes == 0.0) & (seen.height > 0.0)).any(axis=1)
    return np.flatnonzero((enters < leaves) & ~is_beside)
