# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Points in space and in the task plane, which is named by its two axes of the working frame: 'xy', 'xz' or 'yz'.

The height of a point is its coordinate along the third axis. Left and right are those of a drawing with the first axis to the
right and the second axis up.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from foc_ros.core.obstacles.polygons import FLAT
from foc_ros.core.types import Array

_AXES = {'xy': (slice(0, 2), 2), 'xz': (slice(0, 3, 2), 1), 'yz': (slice(1, 3), 0)}
"""The two axes of each plane as a slice, and its normal."""


def project(points: ArrayLike, plane: str) -> tuple[Array, Array]:
    """Split points (..., 3) [m] into positions in the plane (..., 2) and heights (...); both are views if points is an array."""
    axes, normal = _AXES[plane]
    array = np.asarray(points, dtype=float)
    return array[..., axes], array[..., normal]


class Transform(NamedTuple):
    """A rotation (3, 3) and a translation (3,) [m], from one frame to another, or a pose; stamp_ns: for which it holds [ns]."""

    rotation: Array
    translation: Array
    stamp_ns: int = 0

    def apply(self, points: ArrayLike) -> Array:
        """Return points (..., 3) after the transform; not finite where they are not."""
        if self is NO_TRANSFORM:
            return np.asarray(points, dtype=float)
        with np.errstate(invalid='ignore', over='ignore'):
            moved: Array = np.asarray(points, dtype=float) @ self.rotation.T + self.translation
        return moved

    def compose(self, inner: Transform) -> Transform:
        """Return a pose after the transform."""
        return Transform(self.rotation @ inner.rotation, self.apply(inner.translation), self.stamp_ns)

    def inverse(self) -> Transform:
        """Return the transform back."""
        return Transform(self.rotation.T, -self.rotation.T @ self.translation, self.stamp_ns)


NO_TRANSFORM = Transform(np.eye(3), np.zeros(3))


def compute_rotation(quaternion: Any) -> Array:
    """Return the matrix (3, 3) of a geometry_msgs/Quaternion of any length; one that was never set, all 0, is no rotation."""
    x, y, z, w = np.array([quaternion.x, quaternion.y, quaternion.z, quaternion.w], dtype=float)
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    rotation: Array = np.eye(3) + 2.0 * (w * cross + cross @ cross) / (x * x + y * y + z * z + w * w or 1.0)
    return rotation


def make_heights(middle: ArrayLike, size: ArrayLike) -> Array:
    """Return lowest and highest points (..., 2) of bodies about their middles along the normal [m]; unbounded without a size."""
    half = np.where(np.asarray(size) >= FLAT, np.asarray(size) / 2.0, np.inf)
    heights: Array = np.stack((middle - half, middle + half), axis=-1)
    return heights


def lift(positions: ArrayLike, height: ArrayLike, plane: str) -> Array:
    """Return the points (..., 3) of positions in the plane (..., 2) at a height [m]; velocities are lifted with height 0."""
    axes, normal = _AXES[plane]
    array = np.asarray(positions, dtype=float)
    points = np.empty((*array.shape[:-1], 3))
    points[..., axes] = array
    points[..., normal] = height
    return points
