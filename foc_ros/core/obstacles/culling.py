"""Culling of obstacles that are far from every path, so that the cost of a prediction is bounded for any scene."""

from __future__ import annotations

import numpy as np

from foc_ros.core.types import Array, Obstacles

from .geometry import measure_offsets


def cull_obstacles(obstacles: Obstacles, hand: Array, goals: Array, duration_s: float, most: int) -> Obstacles:
    """Return the `most` obstacles at most, in their order, that a path to a goal can touch with the smallest detour.

    hand (2,), goals (g, 2) [m], g >= 1. The detour over an obstacle is d(hand) + d(goal) - 2 r - |hand - goal|, with distances d
    from its polygon, for the goal where it is smallest. A moving obstacle may come nearer by its speed times duration_s [s], at
    both ends. Of equal ones the first rows are kept.
    """
    if len(obstacles) <= most:
        return obstacles
    _, distance = measure_offsets(np.concatenate((hand[None], goals)), obstacles)
    detour = (distance[1:] - np.linalg.norm(goals - hand, axis=1)[:, None]).min(axis=0) + distance[0]
    reach = obstacles.radius + duration_s * np.linalg.norm(obstacles.velocity, axis=1)
    kept = np.argsort(detour - 2.0 * reach, kind='stable')[:most]
    return obstacles.take(np.sort(kept))
