# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Initial guesses: the positions of a hand that moves along a path in time, smooth and with room to the obstacles."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from foc_ros.core.errors import SceneError
from foc_ros.core.obstacle_table import Obstacles
from foc_ros.core.obstacles.geometry import measure_offsets
from foc_ros.core.types import Array

from .graph import Rows
from .names import Names
from .sides import sweep

SLOPE = 0.5
"""A hand in a margin leaves it by this much for each metre of its path, and enters the margin of its goal likewise."""
ROOM = 0.002
"""Distance from the grown obstacles that a guess keeps where there is room [m]."""


def compute_path_lengths(path: Array) -> Array:
    """Compute the lengths (m,) [m] of a path (m, 2) [m] from its beginning to each of its points."""
    return np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(path, axis=0).T))])


def compute_progress(length: float, speed: float, duration_s: float, steps: int) -> Array:
    """Compute the length along a path at steps 0..N (N + 1,) [m]: minimum jerk from a speed [m/s] along it to rest at its end.

    s = L (10 t^3 - 15 t^4 + 6 t^5) + v T (t - 6 t^3 + 8 t^4 - 3 t^5) with t in [0, 1]. The path would overshoot with v T > 2.5 L
    and begin backwards with v < 0, so v is kept between these bounds.
    """
    t = np.linspace(0.0, 1.0, steps + 1)
    carried = min(max(speed * duration_s, 0.0), 2.5 * length)
    along = length * t**3 * (10.0 + t * (6.0 * t - 15.0)) + carried * t * (1.0 + t**2 * (t * (8.0 - 3.0 * t) - 6.0))
    return np.clip(along, 0.0, length)


def timed(path: Array, velocity: Array, duration_s: float, steps: int) -> Array:
    """Return the positions of a hand that moves along a path with the timing of the guesses.

    Parameters
    ----------
    path : Array
        Points (m, 2) [m], m >= 2.
    velocity : Array
        Velocity at the beginning (2,) [m/s].
    duration_s : float
        Duration [s].
    steps : int
        Number N of time steps.

    Returns
    -------
    Array
        Positions at steps 0..N, (N + 1, 2) [m].
    """
    along, step = compute_path_lengths(path), path[1] - path[0]
    heading = step / max(float(np.hypot(*step)), np.finfo(float).tiny)
    at = compute_progress(float(along[-1]), float(heading @ velocity), duration_s, steps)
    return np.column_stack([np.interp(at, along, axis) for axis in path.T])


def guess_path(start: Array, goal: Array, steps: int, amplitude: float = 0.0, via: Array | None = None) -> Array:
    """Return positions at steps 0..N, (N + 1, 2) [m], from start (2,) to goal (2,), with the timing of a minimum-jerk movement.

    They are on the line through the points `via` (m, 2), or on the straight line plus amplitude sin(pi k/N) [m] to its left. If
    `via` has N + 1 points, it is returned as it is.
    """
    if via is not None and len(via) == steps + 1:
        return via
    path = timed(np.vstack([start, *([] if via is None else via), goal]), np.zeros(2), 1.0, steps)
    if via is not None:
        return path
    direction = goal - start
    distance = float(np.hypot(*direction))
    if not distance:
        raise SceneError('guess', 'a goal away from the start', f'both at {start.tolist()}')
    aside = amplitude / distance * np.array([-direction[1], direction[0]])
    return path + np.outer(np.sin(np.pi * np.arange(steps + 1) / steps), aside)


def make_guesses(taut: Sequence[Array], goals: Sequence[int], obstacles: Obstacles, names: Names) -> list[Array]:
    """Smooth the timed positions (N + 1, 2) [m] on taut paths to goals (rows), and move them away from the obstacles.

    If hand or goal lies in the margin of an obstacle, the guess leaves or enters the margin gradually. A guess that smoothing
    brought to the other side of an obstacle stays taut. names: how the obstacles count.
    """
    if not taut:
        return []
    before, guesses = np.array(taut), np.array(taut)
    step = np.hypot(*np.diff(before, axis=1).transpose(2, 0, 1)).max(initial=0.0)
    apart = np.hypot(*(before.reshape(-1, 1, 2) - obstacles.centre).transpose(2, 0, 1)) - obstacles.extent
    near = np.flatnonzero((apart < names.radius - obstacles.radius + ROOM + step).any(axis=0))
    shapes = obstacles.take(near)
    wanted = _measure_wanted(before, list(goals), shapes, names, near)
    for room in (ROOM, ROOM, 0.0):  # the last smoothing uses up the room
        guesses[:, 1:-1] += (guesses[:, :-2] + guesses[:, 2:] - 2.0 * guesses[:, 1:-1]) / 4.0
        guesses = _push(guesses, wanted + room, shapes)
    guesses = _push(guesses, wanted, shapes)
    _, distance = measure_offsets(guesses.reshape(-1, 2), shapes)
    is_clear = (distance.reshape(wanted.shape) >= wanted - 1e-12).all(axis=2, keepdims=True)
    guesses = np.where(is_clear, guesses, before)
    angles = [sweep(each[:, :, None] - shapes.centre) for each in (guesses, before)]
    apart = np.abs(angles[0] - angles[1]).max(axis=1, initial=0.0)
    return list(np.where(apart[:, None, None] < np.pi, guesses, before))


def _measure_wanted(paths: Array, goals: list[int], shapes: Obstacles, names: Names, rows: Rows) -> Array:
    """Return the distance (k, N + 1, r) [m] that positions (k, N + 1, 2) want from the polygons of some obstacles (r,)."""
    steps = np.hypot(*np.diff(paths, axis=1, prepend=paths[:, :1]).transpose(2, 0, 1))
    along, goal = np.cumsum(steps, axis=1)[..., None], np.array(goals)[:, None]
    _, ends = measure_offsets(paths[:, [0, -1]].reshape(-1, 2), shapes)
    at_hand, at_goal = ends.reshape(len(paths), 2, 1, len(rows)).transpose(1, 0, 2, 3)
    leaving = np.where(names.holds_hand[rows], at_hand + SLOPE * along, np.inf)
    entering = np.where(names.holds_goal[goal, rows][:, None], at_goal + SLOPE * (along[:, -1:] - along), np.inf)
    held = np.minimum(names.radius[rows], np.minimum(leaving, entering))
    wanted: Array = np.where(names.blocks[goal, rows][:, None], held, -np.inf)
    return wanted


def _push(paths: Array, wanted: Array, shapes: Obstacles) -> Array:
    """Move positions (k, N + 1, 2) to the wanted distance (k, N + 1, r) from that obstacle to which each is too near by most."""
    if not len(shapes):
        return paths
    points, wanted = paths.reshape(-1, 2), wanted.reshape(-1, len(shapes))
    offset, distance = measure_offsets(points, shapes)
    rows, worst = np.arange(len(points)), (wanted - distance).argmax(axis=1)
    away, apart = offset[rows, worst], distance[rows, worst]
    missing = np.maximum(wanted[rows, worst] - apart, 0.0)
    moved: Array = points + away * (missing / np.where(apart == 0.0, np.inf, apart))[:, None]
    moved = moved.reshape(paths.shape)
    moved[:, [0, -1]] = paths[:, [0, -1]]
    return moved
