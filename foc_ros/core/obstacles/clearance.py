"""How far a path stays from obstacles that may move."""

from __future__ import annotations

import numpy as np

from foc_ros.core.types import Array, Obstacles

from .chance_constraint import centre_trajectories
from .geometry import measure_offsets

FINER = 4
"""Number of parts of a step at which distances are measured."""


def measure_clearance(path: Array, obstacles: Obstacles, dt: float) -> float:
    """Return the smallest distance [m] of a path (N + 1, 2) [m] from obstacles, negative inside; dt: the time step [s]."""
    steps = len(path) - 1
    at = np.linspace(0.0, steps, FINER * steps + 1)
    points = np.column_stack([np.interp(at, np.arange(steps + 1), axis) for axis in path.T])
    centres = centre_trajectories(obstacles.centre, dt / FINER * obstacles.velocity, FINER * steps)
    distance = measure_offsets(points, obstacles, centres)[1] - obstacles.radius
    return float(distance.min(initial=np.inf))
