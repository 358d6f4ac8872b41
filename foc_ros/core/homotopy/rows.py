"""Rows of obstacles: those that a hand passes through one gap each.

Obstacles whose extents along the direction of movement overlap stand in one row, which the hand passes through one of its gaps;
an obstacle by itself is a row with two gaps. A wall, along which the hand moves from the start to the goals, is in no row: it
bounds the outer gaps of the rows.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from foc_ros.core.types import Array, Obstacles

Rows = NDArray[np.int64]
WALL = -1
"""The row of an obstacle that is in none."""


def find_direction(start: Array, goals: Array) -> Array:
    """Return the unit vector (2,) from a start (2,) [m] to the mean of the goals (g, 2) [m]; x where they coincide."""
    offset: Array = goals.mean(axis=0) - start
    length = float(np.hypot(*offset))
    return offset / length if length > 0.0 else np.array([1.0, 0.0])


def find_rows(obstacles: Obstacles, direction: Array, start: Array, goals: Array) -> Rows:
    """Return the row (n,) of each obstacle, counted along a unit vector (2,), or WALL; start (2,), goals (g, 2) [m]."""
    low, high = _find_extents(obstacles, direction)
    row = np.full(len(obstacles), WALL, dtype=np.int64)
    standing = np.flatnonzero(~find_walls(obstacles, np.vstack([start, goals])))
    order = standing[np.argsort(low[standing], kind='stable')]
    is_first = np.append(True, low[order[1:]] > np.maximum.accumulate(high[order])[:-1])
    row[order] = np.cumsum(is_first[: len(order)]) - 1
    return row


def find_walls(obstacles: Obstacles, points: Array) -> NDArray[np.bool_]:
    """Tell which obstacles (n,) have an edge beside which all points (q, 2) [m] lie: outside of it, and between its ends."""
    vertices, number, corners = obstacles.vertices, np.arange(obstacles.vertices.shape[1]), obstacles.corners[:, None]
    following = np.where(number + 1 < corners, number + 1, 0)
    edges = np.take_along_axis(vertices, following[..., None], axis=1) - vertices
    offset = points[:, None, None] - (obstacles.centre[:, None] + vertices)
    along = (offset * edges).sum(axis=-1)
    is_outside = edges[..., 0] * offset[..., 1] - edges[..., 1] * offset[..., 0] < 0.0
    is_beside = is_outside & (along > 0.0) & (along < (edges**2).sum(axis=-1)) & (number < corners)
    is_wall: NDArray[np.bool_] = is_beside.all(axis=0).any(axis=1)
    return is_wall


def _find_extents(obstacles: Obstacles, direction: Array) -> tuple[Array, Array]:
    """Return the ends (n,) of the obstacles along a unit vector (2,) [m]."""
    along, position = obstacles.vertices @ direction, obstacles.centre @ direction
    return position + along.min(axis=1) - obstacles.radius, position + along.max(axis=1) + obstacles.radius


def locate_rows(position: Array, row: Rows) -> Array:
    """Return the position (r,) [m] of each row: the mean of its obstacles; position (n,) [m] and row (n,) of the obstacles."""
    row, position = row[row != WALL], position[row != WALL]
    located: Array = np.bincount(row, position) / np.bincount(row)
    return located
