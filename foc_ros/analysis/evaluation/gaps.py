# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The gaps of a row of obstacles through which a hand fits."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from foc_ros.core.classes.rows import WALL, Rows
from foc_ros.core.obstacles.geometry import measure_offsets
from foc_ros.core.types import LEFT, RIGHT, Array, Obstacles

Sides = NDArray[np.int8]


def find_open_gaps(obstacles: Obstacles, row: Rows, direction: Array, hand_radius: float) -> tuple[Sides, ...]:
    """Return for each row the sides (k, n) on which a path through one of its k open gaps passes its obstacles, 0 for all others.

    A gap is open if it is wider than the hand, hand_radius [m]; the outer gaps of a row are those between it and the walls.
    """
    left = np.array([-direction[1], direction[0]])
    distance = _measure_distances(obstacles)
    found = []
    for number in range(int(row.max(initial=WALL)) + 1):
        members = np.flatnonzero(row == number)
        members = members[np.argsort(obstacles.centre[members] @ left, kind='stable')]
        right_end, left_end = (
            distance[member, _find_walls_beside(obstacles, row, member, outwards)].min(initial=np.inf)
            for member, outwards in ((members[0], -left), (members[-1], left))
        )
        is_open = np.array([right_end, *distance[members[:-1], members[1:]], left_end]) > 2.0 * hand_radius
        sides = np.zeros((len(members) + 1, len(obstacles)), dtype=np.int8)
        sides[:, members] = np.where(np.tri(len(members) + 1, len(members), -1), LEFT, RIGHT)
        found.append(sides[is_open])
    return tuple(found)


def _find_walls_beside(obstacles: Obstacles, row: Rows, member: int, outwards: Array) -> NDArray[np.intp]:
    """Return those walls whose nearest point is beside an obstacle, where a unit vector (2,) points, rather than ahead of it."""
    walls = np.flatnonzero(row == WALL)
    towards = -measure_offsets(obstacles.centre[member], obstacles.take(walls))[0][0]
    is_beside: NDArray[np.bool_] = towards @ outwards >= np.abs(towards @ [outwards[1], -outwards[0]])
    return walls[is_beside]


def _measure_distances(obstacles: Obstacles) -> Array:
    """Return the distances (n, n) [m] between obstacles; two convex polygons that are apart are nearest at a vertex of one."""
    corners = obstacles.centre[:, None] + obstacles.vertices
    nearest = measure_offsets(corners, obstacles)[1].reshape(*corners.shape[:2], len(obstacles)).min(axis=1)
    distance: Array = np.minimum(nearest, nearest.T) - obstacles.radius[:, None] - obstacles.radius
    return distance
