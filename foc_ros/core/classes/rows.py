# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Rows of obstacles, and the decisions that tell classes apart: which gap each takes in the next row, and where it turns back.

Obstacles whose extents along the direction of movement overlap stand in one row, which the hand passes through one of its gaps;
an obstacle by itself is a row with two gaps. A wall, along which the hand moves from the start to the goals, is in no row: it
bounds the outer gaps of the rows.

An obstacle is open if some classes pass it on the left and others on the right. The next row is the first row of open obstacles
that is still ahead of the hand. Where no row is ahead, the next decision is that between the goals. A class weaves through a row
if it passes one obstacle on its right side, and another one, farther to the right, on its left side: it goes through several
gaps of this row. A row within which the goal of the class lies, or beyond it, is not gone through.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from foc_ros.core.obstacle_table import Obstacles
from foc_ros.core.solution import LEFT, RIGHT
from foc_ros.core.types import Array, HandState

from .sides import Passages

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


class Decisions(NamedTuple):
    """The decisions of k classes.

    next_gap, way (k,): numbers of the gap that each takes in the next row, and of its way. Classes of one way take the same gaps
    in all rows ahead, whatever their goals. Where no row is ahead, the gap and the way of a class are its goal. woven (k,):
    how many rows each weaves through. next_row (m,): the obstacles of the next row, none where no row is ahead.
    """

    next_gap: NDArray[np.intp]
    way: NDArray[np.intp]
    woven: NDArray[np.intp]
    next_row: NDArray[np.intp] = np.zeros(0, dtype=np.intp)


def tabulate_sides(passages: Passages) -> NDArray[np.int8]:
    """Return LEFT or RIGHT, (k, n): the side on which each path passes each obstacle; 0 if it ends in it."""
    return np.where(passages.is_passed, np.where(passages.swept < 0.0, LEFT, RIGHT), 0).astype(np.int8)


def find_decisions(
    sides: NDArray[np.int8], goal: NDArray[np.intp], obstacles: Obstacles, hand: HandState, goals: Array
) -> Decisions:
    """Find the decisions of classes that pass obstacles on sides (k, n) and lead to goals (k,), rows of goals (g, 2) [m].

    A path that ends in an obstacle has the side 0 there, which is a gap of its own.
    """
    here, start = hand.mean[:2], hand.mean[:2] if hand.onset_position is None else hand.onset_position
    direction = find_direction(start, goals)
    is_open = (sides == LEFT).any(axis=0) & (sides == RIGHT).any(axis=0)
    open_obstacles = np.flatnonzero(is_open)
    obstacles = obstacles.take(open_obstacles)
    row, along = find_rows(obstacles, direction, start, goals), obstacles.centre @ direction
    is_ahead = np.append(locate_rows(along, row) > here @ direction, False)[row]  # a wall is in the last row here
    order = np.lexsort((obstacles.centre @ np.array([-direction[1], direction[0]]), row))
    order = order[is_ahead[order]]
    if not len(order):
        number = np.unique(goal, return_inverse=True)[1]
        return Decisions(number, number, np.zeros(len(sides), dtype=np.intp))
    row, sides = row[order], sides[:, open_obstacles[order]]
    turns_back = np.zeros(sides.shape, dtype=np.bool_)
    turns_back[:, 1:] = (sides[:, 1:] == LEFT) & (sides[:, :-1] == RIGHT) & (row[1:] == row[:-1])
    begins = np.flatnonzero(np.diff(row, prepend=WALL))
    far_end = np.maximum.reduceat(_find_extents(obstacles, direction)[1][order], begins)
    is_passed = (goals @ direction)[goal][:, None] >= far_end
    woven = (np.logical_or.reduceat(turns_back, begins, axis=1) & is_passed).sum(axis=1)
    is_next = row == row[0]
    return Decisions(_number_rows(sides[:, is_next]), _number_rows(sides), woven, open_obstacles[order[is_next]])


def _number_rows(table: NDArray[np.int8]) -> NDArray[np.intp]:
    """Return a number (k,) for each row of a table (k, n), the same for equal rows."""
    numbers = dict[bytes, int]()
    return np.array([numbers.setdefault(each.tobytes(), len(numbers)) for each in table], dtype=np.intp)
