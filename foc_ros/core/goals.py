"""Goals that a movement reached: the one definition for learning, fitting and evaluation."""

from __future__ import annotations

import numpy as np

from .types import Array


def find_reached_goal(positions: Array, goals: Array, within_m: float | None = None) -> tuple[int | None, int]:
    """Return the goal that a path reached.

    Parameters
    ----------
    positions
        The path, (m, 2) [m].
    goals
        The goals, (g, 2) [m].
    within_m
        Distance [m] within which a goal is reached. By default half of the distance of a goal to its nearest neighbour, and any
        distance for a single goal.

    Returns
    -------
    goal, index
        Row of the last goal that the path came near, and the index of the position nearest to it. None and the last index if
        the path came near no goal.
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
