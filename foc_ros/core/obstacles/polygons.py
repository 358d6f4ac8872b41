# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The polygons of boxes and of hulls of points."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from foc_ros.core.types import Array

FLAT = 1e-9
"""Size [m] from which a box or a hull extends in a direction."""


def tabulate_boxes(size: ArrayLike, yaw: ArrayLike) -> tuple[Array, NDArray[np.intp]]:
    """Return vertices (n, V, 2) and corners (n,), as in `Obstacles`, of boxes of full lengths (n, 2) [m] at angles (n,) [rad].

    A box that has no size along one of its axes has two vertices, and one without any size has one.
    """
    lengths, angle = np.reshape(np.asarray(size, dtype=float), (-1, 2)), np.reshape(np.asarray(yaw, dtype=float), -1)
    is_long = lengths >= FLAT
    corners = np.array([1, 2, 4], dtype=np.intp)[is_long.sum(axis=1)]
    vertices = np.where(is_long, lengths / 2.0, 0.0)[:, None] * [[1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0], [1.0, -1.0]]
    vertices[corners == 2, 1] = vertices[corners == 2, 2]
    axes = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]]).transpose(2, 0, 1)
    turned = np.where((np.arange(4) < corners[:, None])[..., None], vertices @ axes, 0.0)
    return turned[:, : corners.max(initial=1)], corners


def make_box_polygon(size: ArrayLike, yaw: float) -> Array:
    """Return the vertices (v, 2) [m] of a box of full lengths (2,) [m] at an angle [rad], anticlockwise, from its centre."""
    vertices: Array = tabulate_boxes(size, yaw)[0][0]
    return vertices


def make_hull_polygon(points: Array) -> tuple[Array, Array]:
    """Return the mean of the corners of the convex hull of points (q, 2) [m], and these (v, 2), anticlockwise, from there [m]."""
    from scipy.spatial import ConvexHull, QhullError  # its import takes longer than to read a scene without hulls

    try:
        corners = points[ConvexHull(points).vertices]
        corners = corners[np.hypot(*(corners - np.roll(corners, 1, axis=0)).T) >= FLAT]  # points that differ by rounding alone
    except (QhullError, ValueError):  # fewer than three points, or all on one line
        along = points - points.mean(axis=0)
        direction = along[np.hypot(along[:, 0], along[:, 1]).argmax()]
        ends = np.array([points[(along @ direction).argmin()], points[(along @ direction).argmax()]])
        corners = ends if np.hypot(*(ends[1] - ends[0])) >= FLAT else ends[:1]
    centre: Array = corners.mean(axis=0)
    return centre, corners - centre
