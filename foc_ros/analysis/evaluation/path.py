"""The path that a hand really took: which goal it reached, when, and how far along it was at each moment."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from foc_ros.core.types import NANOSECONDS, Array

SHARE_OF_STEP = 0.02
"""Travel is counted in steps of this share of the path's extent: what noise adds at rest is none."""


class Path:
    """A recorded path, of a movement that ends where it is nearest to the goal that it reached.

    Attributes: stamps_ns (m,), positions (m, 2) [m], goals (g, 2) [m]; goal: row of the goal reached, None where none was;
    end_ns: when the movement ends; travelled (m,): way that lies behind [m]; progress (m,): its share of the movement's way.
    """

    def __init__(self, stamps_ns: NDArray[np.int64], positions: Array, goals: Array) -> None:
        self.stamps_ns, self.positions, self.goals = stamps_ns, positions, goals
        self.goal, end = reached(positions, goals)
        self.end_ns = int(stamps_ns[end])
        self.travelled = _travelled(positions)
        whole = self.travelled[end]
        self.progress = np.minimum(self.travelled / whole, 1.0) if whole > 0.0 else np.zeros(len(positions))

    def at(self, stamp_ns: int, seconds: Array) -> Array:
        """Return the positions (h, 2) [m] some seconds after a stamp, nan beyond the end."""
        times = (self.stamps_ns - stamp_ns) / NANOSECONDS
        return np.column_stack([np.interp(seconds, times, axis, right=np.nan) for axis in self.positions.T])

    def index(self, stamp_ns: int) -> int:
        """Return the place of a stamp."""
        return int(np.searchsorted(self.stamps_ns, stamp_ns))


def reached(positions: Array, goals: Array) -> tuple[int | None, int]:
    """Return the goal that a path (m, 2) [m] reached, and the place where it was nearest to it.

    goals (g, 2) [m]. Reached is the last goal that the path came to within half of the distance to its nearest neighbour, a
    single one in any case. None, and the end of the path, where there is none.
    """
    apart = np.hypot(*(positions[:, None] - goals).transpose(2, 0, 1))
    between = np.hypot(*(goals[:, None] - goals).transpose(2, 0, 1))
    np.fill_diagonal(between, np.inf)
    near = apart <= between.min(axis=1) / 2.0
    if not near.any():
        return None, len(positions) - 1
    last = int(np.flatnonzero(near.any(axis=1))[-1])
    goal = int(np.where(near[last], apart[last], np.inf).argmin())
    return goal, int(apart[:, goal].argmin())


def _travelled(positions: Array) -> Array:
    """Return the way [m] behind each position (m, 2) [m], counted in steps that noise does not make."""
    step = SHARE_OF_STEP * float(np.hypot(*np.ptp(positions, axis=0)))
    travelled, last = np.zeros(len(positions)), positions[0]
    for place in range(1, len(positions)):
        moved = float(np.hypot(*(positions[place] - last)))
        travelled[place] = travelled[place - 1]
        if moved >= step:
            travelled[place] += moved
            last = positions[place]
    return travelled
