# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""On which side a path passes an obstacle, and when the paths of several candidates separate, computed from the paths alone.

A path crosses the ray that leaves the centre of an obstacle along -x. The number of these crossings (anticlockwise ones positive)
and the directions of the two ends, as seen from the centre, give the angle that the path sweeps about the centre.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from foc_ros.core.errors import SceneError
from foc_ros.core.obstacle_table import Obstacles
from foc_ros.core.obstacles.geometry import TURN, find_offset
from foc_ros.core.obstacles.risk import centre_trajectories
from foc_ros.core.solution import LEFT, RIGHT, Solution
from foc_ros.core.types import Array, Record


def count_crossings(begin: Array, end: Array) -> NDArray[np.int8]:
    """Count how often straight lines cross the rays of centres, (...): -1, 0, or 1 for an anticlockwise crossing.

    begin, end (..., 2): ends of the lines relative to the centres [m].
    """
    is_above, ends_above = begin[..., 1] >= 0.0, end[..., 1] >= 0.0
    left = begin[..., 0] * end[..., 1] - begin[..., 1] * end[..., 0]
    anticlockwise, clockwise = is_above & ~ends_above & (left > 0.0), ~is_above & ends_above & (left < 0.0)
    return anticlockwise.astype(np.int8) - clockwise.astype(np.int8)


def compute_bearings(offset: Array) -> Array:
    """Return the directions [rad] of points (..., 2) from a centre; a negative zero counts as zero, as in `count_crossings`."""
    bearing: Array = np.arctan2(offset[..., 1] + 0.0, offset[..., 0] + 0.0)
    return bearing


def compute_swept_angles(path: Array, centres: Array) -> Array:
    """Compute the angle that a path sweeps about each centre, anticlockwise positive.

    The angle is exact if no step of the path turns by pi or more about a centre.

    Parameters
    ----------
    path : Array
        Points (m, 2) [m], m >= 1.
    centres : Array
        Centres (n, 2) [m], or (m, n, 2) if they move: the centres at each point of the path.

    Returns
    -------
    Array
        Angles (n,) [rad].

    Raises
    ------
    SceneError
        If the shapes do not fit each other.
    """
    _check_shapes(path, centres)
    return sweep(path[:, None] - centres)


def _check_shapes(path: Array, centres: Array) -> None:
    if path.ndim != 2 or path.shape[1] != 2 or not len(path):
        raise SceneError('path', 'points (m, 2), m >= 1', f'an array {path.shape}')
    if centres.ndim == 3 and len(centres) != len(path):
        raise SceneError('centres', f'one row for each of the {len(path)} points', f'{len(centres)} rows')


def sweep(offset: Array) -> Array:
    """Return the angles (..., n) [rad] that paths sweep about centres; offset (..., m, n, 2): of their points [m]."""
    turns = count_crossings(offset[..., :-1, :, :], offset[..., 1:, :, :]).sum(axis=-2)
    angles: Array = compute_bearings(offset[..., -1, :, :]) - compute_bearings(offset[..., 0, :, :]) + TURN * turns
    return angles


def find_path_sides(path: Array, obstacles: Obstacles, centres: Array | None = None) -> dict[str, int]:
    """Find the side on which a path passes each obstacle.

    A path that sweeps clockwise about a centre passes the obstacle on the left. A path passes an obstacle if the foot of
    some point of its polygon on the chord from the first to the last point lies strictly between the two, or if the path winds
    about the centre by more than half a turn. If the obstacle moves, points are relative to it.

    Parameters
    ----------
    path : Array
        Points (m, 2) [m], m >= 1.
    obstacles : Obstacles
        The n obstacles.
    centres : Array, optional
        Centres (m, n, 2) [m] of the obstacles at each point of the path, if they move.

    Returns
    -------
    dict[str, int]
        LEFT or RIGHT by the id of each obstacle that is passed.

    Raises
    ------
    SceneError
        If the shapes do not fit each other.
    """
    rows = obstacles.centre if centres is None else centres
    _check_shapes(path, rows)
    return find_sides(path[None], obstacles, rows)[0]


def find_sides(paths: Array, obstacles: Obstacles, centres: Array) -> list[dict[str, int]]:
    """Return for each of the paths (b, m, 2) [m] what `find_path_sides` returns; together they take little longer than one."""
    offset, edges = paths[:, :, None] - centres, obstacles.edges
    angles = sweep(offset)
    is_passed = is_between(edges.x, edges.y, offset[:, 0], offset[:, -1], 0.0) | (np.abs(angles) > np.pi)
    sides = np.where(angles < 0.0, LEFT, RIGHT).tolist()
    return [{obstacles.ids[row]: of[row] for row in np.flatnonzero(each)} for of, each in zip(sides, is_passed, strict=True)]


def is_between(x: Array, y: Array, begin: Array, end: Array, slack: Array | float) -> NDArray[np.bool_]:
    """Tell which polygons have a point whose foot on a line lies between the ends of the line, by more than a slack.

    x, y (n, V): vertices of the polygons, some of them more than once; begin, end (..., n, 2): of the lines, all relative to the
    centres [m]; slack (n,): least distance of the foot from both ends [m].
    """
    line = end - begin
    square = (line**2).sum(axis=-1)
    margin = slack * np.sqrt(square)
    foot = (x - begin[..., :1]) * line[..., :1] + (y - begin[..., 1:]) * line[..., 1:]
    flags: NDArray[np.bool_] = (margin < foot.max(axis=-1)) & (foot.min(axis=-1) < square - margin)
    return flags


@dataclass(frozen=True, eq=False)
class BranchTimes(Record):
    """When k paths separate.

    after_s (k, k): time until two of them separate [s], infinite for paths that never separate, and on the diagonal. path_class
    (k,): paths with equal numbers pass all obstacles on the same sides, though they may lead to different goals.
    """

    after_s: Array
    path_class: NDArray[np.intp]

    def take(self, rows: NDArray[np.intp]) -> BranchTimes:
        """Return the branch times of some of the paths."""
        return BranchTimes(self.after_s[np.ix_(rows, rows)], self.path_class[rows])


@dataclass(frozen=True, eq=False)
class Passages(Record):
    """How the mean paths of k solutions pass n obstacles.

    dt (k,): steps [s]; swept (k, n): angles that the paths sweep about the centres [rad]; distance (k, N + 1, n): from the
    polygons at the steps [m]; is_passed (k, n): false for an obstacle in which a path ends, and which it passes on no side.
    """

    dt: Array
    swept: Array
    distance: Array
    is_passed: NDArray[np.bool_]


def measure_passages(solutions: Sequence[Solution], obstacles: Obstacles) -> Passages:
    """Return how the mean paths of solutions with equally many steps pass obstacles, which move from where they are now."""
    if not solutions:
        none = np.zeros((0, len(obstacles)))
        return Passages(np.zeros(0), none, none[:, None], none > 0.0)
    path, dt = np.stack([each.path for each in solutions]), np.array([each.dt for each in solutions])
    drift = dt[:, None, None, None] * obstacles.velocity
    offset = path[:, :, None] - centre_trajectories(obstacles.centre, drift, path.shape[1] - 1)
    distance = find_offset(offset[..., 0], offset[..., 1], obstacles.edges).distance
    return Passages(dt, sweep(offset), distance, distance[:, -1] >= obstacles.radius)


def compute_branch_times(passages: Passages) -> BranchTimes:
    """Compute when the mean paths of candidates separate.

    Two paths from one hand pass an obstacle on different sides if the angles that they sweep about it differ by more than half a
    turn, or if one of them ends in it. They separate at the first such obstacle, when the first of the two is nearest to it. A
    parabola through three steps gives this time, so that it does not jump.
    """
    if not len(passages.dt):
        return BranchTimes(np.zeros((0, 0)), np.zeros(0, dtype=np.intp))
    swept, is_passed = passages.swept, passages.is_passed
    passing_s = passages.dt[:, None] * _find_minima(passages.distance)
    is_opposite = (np.abs(swept[:, None] - swept) > np.pi) & is_passed[:, None] & is_passed
    is_opposite |= is_passed[:, None] != is_passed
    after_s = np.where(is_opposite, np.minimum(passing_s[:, None], passing_s), np.inf).min(axis=2, initial=np.inf)
    return BranchTimes(after_s, np.isinf(after_s).argmax(axis=1))


def _find_minima(distance: Array) -> Array:
    """Return where the distances (r, N + 1, n) at steps are smallest, in steps (r, n)."""
    row, last = distance.argmin(axis=1), distance.shape[1] - 1
    inner = np.clip(row, 1, last - 1)
    before, here, after = (np.take_along_axis(distance, (inner + step)[:, None], axis=1)[:, 0] for step in (-1, 0, 1))
    bend = before - 2.0 * here + after
    offset = 0.5 * (before - after) / np.where(bend > 0.0, bend, np.inf)
    minima: Array = np.where(bend > 0.0, np.clip(inner + np.clip(offset, -1.0, 1.0), 0.0, last), row)
    return minima
