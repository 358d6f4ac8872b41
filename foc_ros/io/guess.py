"""Guesses of a path, given by hand: each pins the homotopy class that is solved."""

from __future__ import annotations

import numpy as np

from foc_ros.core.errors import SceneError
from foc_ros.core.types import Array


def guess_path(start: Array, goal: Array, steps: int, amplitude: float = 0.0, via: Array | None = None) -> Array:
    """Return positions at steps 0..N, (N + 1, 2) [m], from start (2,) to goal (2,), with the timing of a minimum-jerk movement.

    s = 10 r^3 - 15 r^4 + 6 r^5, r = k/N, of the way along the straight line, plus amplitude sin(pi r) [m] to its left; or along
    the line through the points `via` (m, 2). N + 1 points are taken for the positions themselves.
    """
    if via is not None and len(via) == steps + 1:
        return via
    share = np.arange(steps + 1) / steps
    progress = 10 * share**3 - 15 * share**4 + 6 * share**5
    if via is not None:
        return _along(np.vstack([start, via, goal]), progress)
    way = goal - start
    length = float(np.hypot(*way))
    if not length:
        raise SceneError('guess', 'a goal away from the start', f'both at {start.tolist()}')
    left = np.array([-way[1], way[0]]) / length
    path: Array = start + progress[:, None] * way + amplitude * np.sin(np.pi * share)[:, None] * left
    return path


def _along(points: Array, progress: Array) -> Array:
    """Return the positions at shares (m,) of the length of a line through points."""
    length = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(points, axis=0).T))])
    return np.column_stack([np.interp(progress * length[-1], length, axis) for axis in points.T])
