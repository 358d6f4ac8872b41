"""When a movement has reached a goal. All that learning, `evaluate` and `fit` say of it is decided here.

Four questions need four answers. Scores need the goal that the hand visited last, even if the recording goes on. A plan or a
demonstration needs a path that ends at the goal. Durations need a movement that covered most of its distance. A choice between
goals needs a movement that ends much nearer to one of them than they are to each other.
"""

from __future__ import annotations

import numpy as np

from foc_ros.core.types import Array

REMAINING_SHARE = 0.25
"""A movement that leaves no more than this share of its first distance to a goal has covered the distance."""
AT_GOAL_M = 0.05
"""A path that ends no farther from a goal than this ends at it [m]."""


def find_reached_goal(positions: Array, goals: Array) -> tuple[int | None, int]:
    """Find the goal that a path (m, 2) [m] reached, and the sample at which the path was nearest to it.

    Reached is the last of the goals (g, 2) [m] that the path came to within half of the distance to its nearest neighbour; a
    single goal is reached in any case. Returns None and the last sample where no goal was reached.
    """
    distance = np.hypot(*(positions[:, None] - goals).transpose(2, 0, 1))
    between = np.hypot(*(goals[:, None] - goals).transpose(2, 0, 1))
    np.fill_diagonal(between, np.inf)
    is_near = distance <= between.min(axis=1) / 2.0
    if not is_near.any():
        return None, len(positions) - 1
    last = int(np.flatnonzero(is_near.any(axis=1))[-1])
    goal = int(np.where(is_near[last], distance[last], np.inf).argmin())
    return goal, int(distance[:, goal].argmin())


def find_goal_at_end(positions: Array, goals: Array) -> tuple[int, float]:
    """Return the goal (g, 2) [m] nearest to the end of a path (m, 2) [m], and its distance [m], at most AT_GOAL_M if reached."""
    distance = np.hypot(*(goals - positions[-1]).T)
    goal = int(distance.argmin())
    return goal, float(distance[goal])


def has_covered_distance(positions: Array, goal: Array) -> bool:
    """Tell whether a path (m, 2) [m] came to within REMAINING_SHARE of its first distance from a goal (2,) [m]."""
    distance = np.hypot(*(positions - goal).T)
    return bool(distance.min() <= REMAINING_SHARE * distance[0])


def find_chosen_goal(end: Array, goals: Array) -> int | None:
    """Return the goal (g, 2) [m] at which a movement ends, None if that is unclear.

    The distance from the end (2,) to the goal is then more than REMAINING_SHARE of that from the goal to the nearest other one.
    """
    goal, distance_m = find_goal_at_end(end[None], goals)
    between = np.hypot(*(np.delete(goals, goal, axis=0) - goals[goal]).T)
    return goal if distance_m <= REMAINING_SHARE * between.min(initial=np.inf) else None
