"""The mean path as a smooth curve, for pictures: the cubics through positions and velocities of the steps."""

from __future__ import annotations

import numpy as np

from foc_ros.core.types import Array

from .response import hermite, pair_steps

LEAST_POINTS = 50
"""Number of points from which a curve looks smooth."""


def compute_curve(path: Array, velocity: Array, dt: float) -> Array:
    """Return points (m, 2) [m] on the mean path, m > LEAST_POINTS: the positions of the steps and, where needed, some between.

    path, velocity (N + 1, 2) [m, m/s]: at steps dt [s] apart. Equal parts of a step lie between two points. A path of more steps,
    or of one point, is returned as it is.
    """
    steps = len(path) - 1
    parts = -(-LEAST_POINTS // max(steps, 1))
    if steps < 1 or parts == 1:
        return path
    return sample_curve(path, velocity, dt, parts)


def sample_curve(path: Array, velocity: Array, dt: float, parts: int) -> Array:
    """Return the mean path at equal parts of its steps, (parts N + 1, 2) [m], for positions and velocities as above."""
    ends = pair_steps(np.stack((path, dt * velocity), axis=1))
    points: Array = (hermite(np.arange(parts) / parts) @ ends).reshape(-1, 2)
    return np.concatenate((points, path[-1:]))
