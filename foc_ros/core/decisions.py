"""The decisions that tell classes apart: which gap each takes in the next row, and in how many rows it turns back.

An obstacle is open if some classes pass it on the left and others on the right. Open obstacles form rows (`rows`), and the next
row is the first of them that is still ahead of the hand. A class weaves through a row if it passes an obstacle on the right and
one to the right of that on the left, so that it goes through several gaps of this row.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from .homotopy import compute_swept_angles
from .obstacles.chance_constraint import centre_trajectories
from .rows import find_direction, find_rows, locate_rows
from .types import LEFT, RIGHT, Array, HandState, Obstacles, Solution


class Decisions(NamedTuple):
    """Of k classes: the number (k,) of the gap that each takes in the next row, and the number (k,) of rows it weaves through."""

    next_gap: NDArray[np.intp]
    woven: NDArray[np.intp]


def tabulate_sides(solutions: Sequence[Solution], obstacles: Obstacles) -> NDArray[np.int8]:
    """Return LEFT or RIGHT, (k, n): the side on which the mean path of each solution passes each obstacle."""
    angles = [
        compute_swept_angles(each.path, centre_trajectories(obstacles.centre, each.dt * obstacles.velocity, len(each.mean) - 1))
        for each in solutions
    ]
    return np.where(np.array(angles).reshape(len(solutions), len(obstacles)) < 0.0, LEFT, RIGHT).astype(np.int8)


def find_decisions(sides: NDArray[np.int8], obstacles: Obstacles, hand: HandState, goals: Array) -> Decisions:
    """Find the decisions of classes that pass obstacles on sides (k, n); goals (g, 2) [m]."""
    here, start = hand.mean[:2], hand.mean[:2] if hand.onset_position is None else hand.onset_position
    direction = find_direction(start, goals)
    open_rows = np.flatnonzero((sides != sides[:1]).any(axis=0))
    obstacles, is_left = obstacles.take(open_rows), sides[:, open_rows] == LEFT
    row, along = find_rows(obstacles, direction, start, goals), obstacles.centre @ direction
    across = obstacles.centre @ np.array([-direction[1], direction[0]])
    gaps, woven = list[NDArray[np.bool_]](), np.zeros(len(sides), dtype=np.intp)
    for number in np.flatnonzero(locate_rows(along, row) > here @ direction):
        members = np.flatnonzero(row == number)
        gaps.append(is_left[:, members[np.argsort(across[members], kind='stable')]])
        woven += (gaps[-1][:, 1:] > gaps[-1][:, :-1]).any(axis=1)
    numbers = dict[bytes, int]()
    next_gap = [numbers.setdefault(each.tobytes(), len(numbers)) for each in gaps[0]] if gaps else [0] * len(sides)
    return Decisions(np.array(next_gap, dtype=np.intp), woven)
