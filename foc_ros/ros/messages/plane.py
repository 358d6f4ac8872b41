"""Points in space and in the task plane, which is named by its two axes of the working frame: 'xy', 'xz' or 'yz'.

The height of a point is its coordinate along the third axis. Left and right are those of a drawing with the first axis to the
right and the second axis up. For 'xy' and 'yz' that is the view against the third axis, for 'xz' the view along it.
"""

from __future__ import annotations

from itertools import product
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from foc_ros.core.obstacles.shapes import make_hull_polygon
from foc_ros.core.types import Array

_AXES = {'xy': (slice(0, 2), 2), 'xz': (slice(0, 3, 2), 1), 'yz': (slice(1, 3), 0)}
"""The two axes of each plane as a slice, and its normal."""
CORNERS = np.array([*product((-1.0, 1.0), repeat=3)])
"""Corners (8, 3) of a box, in halves of its size."""


def project(points: ArrayLike, plane: str) -> tuple[Array, Array]:
    """Split points (..., 3) [m] into positions in the plane (..., 2) and heights (...); both are views if points is an array."""
    axes, normal = _AXES[plane]
    array = np.asarray(points, dtype=float)
    return array[..., axes], array[..., normal]


def compute_rotation(quaternion: Any) -> Array:
    """Return the matrix (3, 3) of a geometry_msgs/Quaternion of any length; one that was never set, all 0, is no rotation."""
    x, y, z, w = np.array([quaternion.x, quaternion.y, quaternion.z, quaternion.w], dtype=float)
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    rotation: Array = np.eye(3) + 2.0 * (w * cross + cross @ cross) / (x * x + y * y + z * z + w * w or 1.0)
    return rotation


def project_box(centre: ArrayLike, size: ArrayLike, rotation: Array, plane: str) -> tuple[Array, Array]:
    """Return the middle (2,) of the outline of a box in space, and its vertices (v, 2) from there, anticlockwise [m].

    The outline is the convex hull of the projections of the eight corners. centre (3,), size (3,) of full lengths [m]; rotation
    (3, 3): of the box.
    """
    corners = np.asarray(centre, dtype=float) + CORNERS * np.asarray(size, dtype=float) / 2.0 @ rotation.T
    return make_hull_polygon(project(corners, plane)[0])


def lift(positions: ArrayLike, height: ArrayLike, plane: str) -> Array:
    """Return the points (..., 3) of positions in the plane (..., 2) at a height [m]; velocities are lifted with height 0."""
    axes, normal = _AXES[plane]
    array = np.asarray(positions, dtype=float)
    points = np.empty((*array.shape[:-1], 3))
    points[..., axes] = array
    points[..., normal] = height
    return points
