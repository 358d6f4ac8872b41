"""Between space and the task plane: a plane is named by its two axes of the working frame, 'xy', 'xz' or 'yz'.

A point's height is its coordinate along the third axis. Left and right are those of the plane drawn with its first axis to the
right and its second axis up. For 'xy' and 'yz' that is the view against the third axis, for 'xz' the view along it.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from foc_ros.core.types import Array

_AXES = {'xy': (slice(0, 2), 2), 'xz': (slice(0, 3, 2), 1), 'yz': (slice(1, 3), 0)}
"""First and second axis of each plane, as a slice, then its normal."""


def project(points: ArrayLike, plane: str) -> tuple[Array, Array]:
    """Split points (..., 3) [m] into positions in the plane (..., 2) and heights (...), both views of an array's own numbers."""
    inside, normal = _AXES[plane]
    array = np.asarray(points, dtype=float)
    return array[..., inside], array[..., normal]


def lift(positions: ArrayLike, height: ArrayLike, plane: str) -> Array:
    """Return the points (..., 3) of positions in the plane (..., 2) at a height [m]; velocities lift at height 0."""
    inside, normal = _AXES[plane]
    array = np.asarray(positions, dtype=float)
    points = np.empty((*array.shape[:-1], 3))
    points[..., inside] = array
    points[..., normal] = height
    return points
