"""Angles that a path sweeps about centres, for kernels; `foc_ros.core.classes.sides` explains them."""

from __future__ import annotations

import numpy as np

from foc_ros.core.kernels import Matrix, Tensor, Vector, compiled_exactly
from foc_ros.core.obstacles.rounded_polygon import TURN


@compiled_exactly
def _count_crossing(a_x: float, a_y: float, b_x: float, b_y: float) -> int:
    """Count how often the straight line from a to b, relative to a centre, crosses the ray of the centre: -1, 0 or 1."""
    left = a_x * b_y - a_y * b_x
    if a_y >= 0.0:
        return 1 if b_y < 0.0 and left > 0.0 else 0
    return -1 if b_y >= 0.0 and left < 0.0 else 0


@compiled_exactly
def sweep_angles(path: Matrix, centres: Tensor) -> Vector:
    """Compute the angles (n,) [rad] that a path (m, 2) sweeps about centres (m, n, 2), or (1, n, 2) if they stand still."""
    m, n = len(path), centres.shape[1]
    angles = np.empty(n)
    for k in range(n):
        x, y = path[0, 0] - centres[0, k, 0], path[0, 1] - centres[0, k, 1]
        # a negative zero counts as zero here, as it does in `_count_crossing`
        first, crossings = np.arctan2(y + 0.0, x + 0.0), 0
        for t in range(1, m):
            at, x_before, y_before = min(t, len(centres) - 1), x, y
            x, y = path[t, 0] - centres[at, k, 0], path[t, 1] - centres[at, k, 1]
            crossings += _count_crossing(x_before, y_before, x, y)
        angles[k] = np.arctan2(y + 0.0, x + 0.0) - first + TURN * crossings
    return angles


@compiled_exactly
def is_same_class(angles: Vector, others: Vector) -> bool:
    """Tell whether two paths with the same ends, which sweep the angles (n,) [rad], pass all n centres on the same sides."""
    return bool((np.abs(angles - others) < np.pi).all())
