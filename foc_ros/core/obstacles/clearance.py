# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""How far a path stays from obstacles, which obstacles no path comes near, and which the hand passes above or below.

The footprint of an obstacle is a range of progress, the coordinate along the line from the hand to the goal: whatever way leads
around the other obstacles, the hand has about the progress of the free movement. An obstacle is cleared if the band of predicted
heights is above it, or below it, during the whole time in which the hand has the progress of the footprint. The footprint is
longer than the obstacle by 0.45 of the distance to the goal on both sides, because a way around obstacles has not quite the
progress of the free movement.
Obstacles beyond the goal are judged as if they were at the goal, and those behind the hand as if they were at the hand.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from foc_ros.core.obstacle_table import Obstacles
from foc_ros.core.types import Array

from .geometry import measure_offsets
from .risk import centre_trajectories

FINER = 4
"""Number of parts of a step at which distances are measured."""
GRAZE_M = 1e-3
"""Depth up to which a path within an obstacle counts as one along its boundary [m]."""


def measure_clearance(path: Array, obstacles: Obstacles, dt: float, parts: int = FINER) -> float:
    """Return the smallest distance [m] of a path (N + 1, 2) [m] from obstacles, negative inside.

    dt: the time step [s]; parts: number of parts of a step at whose ends the distance is measured.
    """
    return float(_measure_distances(path, obstacles, dt, parts).min(initial=np.inf))


def is_free(path: Array, obstacles: Obstacles, dt: float) -> bool:
    """Tell whether a path (N + 1, 2) [m] leads through no obstacle but those that hold its first or its last point; dt [s]."""
    return not bool(_is_blocked(_measure_distances(path, obstacles, dt)))


def find_blocked(paths: Array, obstacles: Obstacles) -> NDArray[np.bool_]:
    """Tell which of the paths (r, m, 2) [m] through points that are close together are not free, (r,), as `is_free` does."""
    is_blocked, (x, y) = np.zeros(len(paths), dtype=np.bool_), np.moveaxis(paths, 2, 0).copy()
    for row, ((x0, y0), extent) in enumerate(zip(obstacles.centre.tolist(), obstacles.extent.tolist(), strict=True)):
        near = np.flatnonzero(((x - x0) ** 2 + (y - y0) ** 2 < extent**2).any(axis=1))  # hardly any path is
        if len(near):
            distances = measure_offsets(paths[near], obstacles.take([row]))[1].reshape(len(near), paths.shape[1], 1)
            is_blocked[near] |= _is_blocked(distances - obstacles.radius[row])
    return is_blocked


def _is_blocked(distances: Array) -> NDArray[np.bool_]:
    """Tell whether one of n obstacles holds points of a path, but neither the first nor the last; distances (..., m, n) [m]."""
    is_inside = distances < -GRAZE_M
    is_between = is_inside.any(axis=-2) & ~is_inside[..., 0, :] & ~is_inside[..., -1, :]
    return np.asarray(is_between.any(axis=-1))


def _measure_distances(path: Array, obstacles: Obstacles, dt: float, parts: int = FINER) -> Array:
    """Return the distances (m, n) [m] of points along a path from obstacles that move on meanwhile, negative inside."""
    steps = len(path) - 1
    at = np.linspace(0.0, steps, parts * steps + 1)
    points = np.column_stack([np.interp(at, np.arange(steps + 1), axis) for axis in path.T])
    centres = centre_trajectories(obstacles.centre, dt / parts * obstacles.velocity, parts * steps)
    distances: Array = measure_offsets(points, obstacles, centres)[1] - obstacles.radius
    return distances


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


def find_cleared(obstacles: Obstacles, hand: Array, goal: Array, progress: Array, band: Array, dt: float) -> NDArray[np.bool_]:
    """Return which obstacles the hand passes above or below on its way to a goal, (n,).

    Parameters
    ----------
    obstacles
        The obstacles now, grown by what the hand needs beside them. One whose heights are not known is not cleared.
    hand, goal
        Positions in the plane, (2,) [m].
    progress
        Of the free movement at steps 0..N, (N + 1,) [m].
    band
        Lowest and highest predicted point of the hand at these steps, (2, N + 1) [m].
    dt
        Duration of a step [s].
    """
    distance = float(np.hypot(*(goal - hand)))
    direction = (goal - hand) / distance if distance > 0.0 else np.zeros(2)
    corners = obstacles.vertices @ direction
    times = dt * np.arange(len(progress))[:, None]
    centre = (obstacles.centre - hand) @ direction + times * (obstacles.velocity @ direction)
    reach = obstacles.radius + 0.45 * distance
    near = np.minimum(centre + corners.min(axis=1) - reach, progress.max())
    far = np.maximum(centre + corners.max(axis=1) + reach, progress.min())
    behind, ahead = progress[:, None] < near, progress[:, None] > far
    # the hand is not at the footprint between two steps if it is on the same side of it at both
    is_there = ~((behind[:-1] & behind[1:]) | (ahead[:-1] & ahead[1:]))
    lowest, highest = obstacles.heights.T
    is_cleared = np.zeros(len(obstacles), dtype=bool)
    for is_clear in (band[0][:, None] > highest, band[1][:, None] < lowest):
        is_cleared |= ((is_clear[:-1] & is_clear[1:]) | ~is_there).all(axis=0)
    return is_cleared
