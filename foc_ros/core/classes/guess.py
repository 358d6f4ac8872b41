# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Initial guesses: the positions of a hand that moves along a path in time."""

from __future__ import annotations

import numpy as np

from foc_ros.core.errors import SceneError
from foc_ros.core.types import Array


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
