# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Limits of the force: its size and its rate of change, the energy that guidance gives, and the margins of the obstacles.

An energy tank makes a force passive whose parameters change (Franken et al. 2011, doi 10.1109/TRO.2011.2142430). The tank pays
for the work on the hand and takes up the work of the hand on guidance, such as that of damping, up to its capacity. The margins
are convex polygons of short edges that no force leads into.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from foc_ros.core.config import GuidanceConfig
from foc_ros.core.obstacle_table import Obstacles
from foc_ros.core.obstacles.geometry import trace_shape
from foc_ros.core.types import Array, Record


def find_largest_force(config: GuidanceConfig) -> float:
    """Return the largest force [N]: `f_max`, and not more than the slew limit reduces to zero within `ramp_s`."""
    return min(config.f_max, config.slew * config.ramp_s)


def shorten(vector: Array, length: float) -> Array:
    """Return a vector (2,) that is at most so long."""
    norm = float(np.hypot(*vector))
    return vector if norm <= length else vector * (length / norm)


def release(vector: Array, change: float, left: float) -> Array:
    """Return a vector (2,) that is being released: shorter by a change, and by a larger one where it would be zero too late.

    left: part of the time of the release that remains after this update. The change alone is enough, unless `slew`, `ramp_s` or
    `authority` were lowered meanwhile.
    """
    norm = float(np.hypot(*vector))
    return shorten(vector, max(min(norm - change, left * norm), 0.0))


def step_force(previous: Array, target: Array, most_change: float, find_bound: Callable[[Array], float]) -> Array:
    """Return the next force (2,) [N] on the way to a target, which changes by `most_change` [N] at most and keeps its bound.

    The bound of a force may depend on its direction. It is chosen so that a force that keeps its bound now, and becomes smaller
    in the same direction at the slew limit, keeps its bound later. So this is what happens where no other force is allowed.

    find_bound: returns the largest size [N] of a force in the direction of its argument.
    """
    wanted = shorten(target, find_bound(target))
    stepped = previous + shorten(wanted - previous, most_change)
    stepped = shorten(stepped, find_bound(stepped))
    if np.hypot(*(stepped - previous)) <= most_change * (1.0 + 1e-9):  # but for rounding
        return stepped
    return shorten(previous, max(float(np.hypot(*previous)) - most_change, 0.0))


def limit_by_energy(energy: float, slew: float, speed: float, period: float) -> float:
    """Return the largest force [N] for which the tank pays until it is slewed to zero.

    From f, a hand that flees at the speed w extracts w (f T + f^2 / (2 r)) at most while f is held for another T, and then falls
    at the rate r. So f is the positive root of w (f T + f^2 / (2 r)) = E.

    energy: E [J]; slew: r [N/s]; speed: w, of the fastest hand [m/s]; period: T, longest time between two updates [s].
    """
    held = slew * period
    return math.sqrt(held * held + 2.0 * slew * max(energy, 0.0) / speed) - held


POINTS = 32
"""Number of edges round a circle."""
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


def build_margins(obstacles: Obstacles, growth: float) -> Margins:
    """Return the polygons about obstacles that are larger by a growth [m]; they contain the rounded shapes."""
    shapes = zip(obstacles.vertices, obstacles.corners.tolist(), obstacles.radius.tolist(), strict=True)
    polygons = [_list_edges(polygon[:corners].tobytes(), radius, growth) for polygon, corners, radius in shapes]
    most = max((len(starts) for starts, _ in polygons), default=1)
    start, edge = np.zeros((len(polygons), most, 2)), np.zeros((len(polygons), most, 2))
    for row, (starts, edges) in enumerate(polygons):
        start[row], edge[row] = starts[0], edges[0]
        start[row, : len(edges)], edge[row, : len(edges)] = starts, edges
    start += obstacles.centre[:, None]
    lengths = np.hypot(edge[..., 0], edge[..., 1])[..., None]
    return Margins(start, edge, np.stack([edge[..., 1], -edge[..., 0]], axis=-1) / lengths)


@lru_cache(maxsize=1024)
def _list_edges(vertices: bytes, radius: float, growth: float) -> tuple[Array, Array]:
    """Return the first corners (k, 2), relative to the centre, and the vectors (k, 2) of the edges of one margin [m]."""
    outline = trace_shape(vertices, (growth + radius) / math.cos(math.pi / POINTS), POINTS)
    edges = np.diff(outline, axis=0)
    is_long = np.hypot(edges[:, 0], edges[:, 1]) > 1e-12
    return outline[:-1][is_long], edges[is_long]


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


def turn_along(seen: SeenMargins, most: Array, vector: Array) -> Array:
    """Return a vector f (2,) with a part into each margin of at most `most` (n,).

    With n the outward normal of the edge that is nearest to the hand, f <- f + max(-f . n - most, 0) n for one obstacle after the
    other. The vector does not become longer, so a margin with `most` >= |f| has no effect.
    """
    for row in np.flatnonzero(most < np.hypot(*vector)):
        normal = seen.normal[row, seen.distance[row].argmin()]
        vector = vector + max(-float(vector @ normal) - float(most[row]), 0.0) * normal
    return vector


def measure_opposing_distance(seen: SeenMargins, force: Array) -> float:
    """Return the distance [m] of the hand from the nearest edge into which a force (2,) leads; infinite if there is none.

    Edges whose normal is nearly at a right angle to the force count as well: the arc that they stand for may have other normals.
    """
    is_opposing = seen.normal @ force < math.sin(math.pi / POINTS) * float(np.hypot(*force))
    return float(seen.distance[is_opposing].min(initial=np.inf))


def find_crossed(seen: SeenMargins, line: Array) -> NDArray[np.bool_]:
    """Return which margins a line (2,) [m] from the hand crosses, (n,) (clipping by Cyrus and Beck)."""
    slopes = seen.normal @ line
    at = -seen.height / np.where(slopes == 0.0, 1.0, slopes)
    enters = np.where(slopes < 0.0, at, 0.0).max(axis=1)
    leaves = np.where(slopes > 0.0, at, 1.0).min(axis=1)
    is_beside = ((slopes == 0.0) & (seen.height > 0.0)).any(axis=1)
    crossed: NDArray[np.bool_] = (enters < leaves) & ~is_beside
    return crossed
