"""Goals that a movement reached: the one definition for learning, fitting and evaluation."""

from __future__ import annotations

import numpy as np

from .types import Array


def find_reached_goal(positions: Array, goals: Array, within_m: float | None = None) -> tuple[int | None, int]:
    """Return the row of the goal (g, 2) [m] that a path (m, 2) [m] reached, and the index of the position nearest to it.

    It is the last goal to which the path came within a distance [m]: by default half of the distance of the goal to its nearest
    neighbour, and any distance for a single goal. None and the last index if there is none.
    """
    distance = np.hypot(*(positions[:, None] - goals).transpose(2, 0, 1))
    between = np.hypot(*(goals[:, None] - goals).transpose(2, 0, 1))
    np.fill_diagonal(between, np.inf)
    near = distance <= (between.min(axis=1, initial=np.inf) / 2.0 if within_m is None else within_m)
    if not near.any():
        return None, len(positions) - 1
    last = int(np.flatnonzero(near.any(axis=1))[-1])
    goal = int(np.where(near[last], distance[last], np.inf).argmin())
    return goal, int(distance[:, goal].argmin())
