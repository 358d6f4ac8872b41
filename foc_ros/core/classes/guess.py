# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Initial guesses: the positions of a hand that moves along a path in time."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from foc_ros.core.errors import SceneError
from foc_ros.core.types import Array


def compute_path_lengths(path: Array) -> Array:
    """Compute the lengths (m,) [m] of a path (m, 2) [m] from its beginning to each of its points."""
    return np.append(0.0, np.hypot(*(path[1:] - path[:-1]).T)).cumsum()


def time_paths(
    paths: Sequence[Array], velocity: Array, durations_s: Sequence[float], steps: int
) -> tuple[list[Array], list[float]]:
    """Return the positions of a hand that moves along paths with the timing of the guesses; for all together it takes less time.

    Parameters
    ----------
    paths : Sequence[Array]
        Points of each path (m, 2) [m], m >= 2.
    velocity : Array
        Velocity at the beginning (2,) [m/s].
    durations_s : Sequence[float]
        Duration of each movement [s].
    steps : int
        Number N of time steps.

    Returns
    -------
    list[Array], list[float]
        For each path the positions at steps 0..N, (N + 1, 2) [m], and its length [m].
    """
    along = [compute_path_lengths(path) for path in paths]
    lengths, begin = [float(each[-1]) for each in along], np.reshape([path[1] - path[0] for path in paths], (-1, 2))
    heading = begin / np.maximum(np.hypot(*begin.T), np.finfo(float).tiny)[:, None]
    progress = _compute_progress(np.array(lengths)[:, None], heading[:, None] @ velocity, np.array(durations_s)[:, None], steps)
    timed = zip(paths, along, progress, strict=True)
    return [np.column_stack([np.interp(at, known, axis) for axis in path.T]) for path, known, at in timed], lengths


def _compute_progress(length: Array, speed: Array, duration_s: Array, steps: int) -> Array:
    """Return the lengths along k paths at steps 0..N, (k, N + 1) [m]: minimum jerk from a speed along each to rest at its end.

    length, speed, duration_s: of each path (k, 1) [m, m/s, s].

    s = L (10 t^3 - 15 t^4 + 6 t^5) + v T (t - 6 t^3 + 8 t^4 - 3 t^5) with t in [0, 1]. The path would overshoot with v T > 2.5 L
    and begin backwards with v < 0, so v is kept between these bounds.
    """
    t = np.linspace(0.0, 1.0, steps + 1)
    carried = np.clip(speed * duration_s, 0.0, 2.5 * length)
    along = length * t**3 * (10.0 + t * (6.0 * t - 15.0)) + carried * t * (1.0 + t**2 * (t * (8.0 - 3.0 * t) - 6.0))
    return np.clip(along, 0.0, length)


def guess_path(start: Array, goal: Array, steps: int, amplitude: float = 0.0, via: Array | None = None) -> Array:
    """Return positions at steps 0..N, (N + 1, 2) [m], from start (2,) to goal (2,), with the timing of a minimum-jerk movement.

    They are on the line through the points `via` (m, 2), or on the straight line plus amplitude sin(pi k/N) [m] to its left. If
    `via` has N + 1 points, it is returned as it is.
    """
    if via is not None and len(via) == steps + 1:
        return via
    path = time_paths([np.vstack([start, *([] if via is None else via), goal])], np.zeros(2), [1.0], steps)[0][0]
    if via is not None:
        return path
    direction = goal - start
    distance = float(np.hypot(*direction))
    if not distance:
        raise SceneError('guess', 'a goal away from the start', f'both at {start.tolist()}')
    aside = amplitude / distance * np.array([-direction[1], direction[0]])
    return path + np.outer(np.sin(np.pi * np.arange(steps + 1) / steps), aside)
