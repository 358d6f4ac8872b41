"""Points in space and in the task plane, which is named by its two axes of the working frame: 'xy', 'xz' or 'yz'.

The height of a point is its coordinate along the third axis. Left and right are those of a drawing with the first axis to the
right and the second axis up. For 'xy' and 'yz' that is the view against the third axis, for 'xz' the view along it.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from foc_ros.core.types import Array

_AXES = {'xy': (slice(0, 2), 2), 'xz': (slice(0, 3, 2), 1), 'yz': (slice(1, 3), 0)}
"""The two axes of each plane as a slice, and its normal."""


def project(points: ArrayLike, plane: str) -> tuple[Array, Array]:
    """Split points (..., 3) [m] into positions in the plane (..., 2) and heights (...); both are views if points is an array."""
    axes, normal = _AXES[plane]
    array = np.asarray(points, dtype=float)
    return array[..., axes], array[..., normal]


def lift(positions: ArrayLike, height: ArrayLike, plane: str) -> Array:
    """Return the points (..., 3) of positions in the plane (..., 2) at a height [m]; velocities are lifted with height 0."""
    axes, normal = _AXES[plane]
    array = np.asarray(positions, dtype=float)
    points = np.empty((*array.shape[:-1], 3))
    points[..., axes] = array
    points[..., normal] = height
    return points
