# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What a table of obstacles has to hold that a user has made by hand."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from foc_ros.core.errors import SceneError
from foc_ros.core.obstacle_table import Obstacles
from foc_ros.core.support import check_array
from foc_ros.core.types import Array


def check_obstacles(table: Obstacles) -> Obstacles:
    """Return a table that a user has made, if all of its rows can be used; raise SceneError for the first field that cannot."""
    n, size = len(table), table.vertices.shape[1:2]
    shapes = {'centre': (n, 2), 'radius': (n,), 'radius_stddev': (n,), 'velocity': (n, 2), 'centre_covariance': (n, 2, 2)}
    for name, shape in (shapes | {'vertices': (n, *size, 2), 'corners': (n,)}).items():
        check_array(f'obstacles.{name}', getattr(table, name), shape)
    if table.heights.shape != (n, 2):
        raise SceneError('obstacles.heights', f'numbers of shape ({n}, 2)', f'shape {table.heights.shape}')
    refused = {
        'radius: a number >= 0': table.radius < 0.0,
        'radius_stddev: a number >= 0': table.radius_stddev < 0.0,
        'centre_covariance: a symmetric matrix without negative eigenvalues': ~_are_covariances(table.centre_covariance),
        f'corners: a number in [1, {size[0]}]': (table.corners < 1) | (table.corners > size[0]),
        'heights: the lowest point below the highest': ~(table.heights[:, 0] < table.heights[:, 1]),
    }
    for rule, is_refused in refused.items():
        field, expected = rule.split(': ')
        for row in np.flatnonzero(is_refused).tolist():
            raise SceneError(f'obstacles.{field}[{row}]', expected, getattr(table, field)[row].tolist())
    for row, (vertices, count) in enumerate(zip(table.vertices, table.corners, strict=True)):
        edges = np.roll(vertices[:count], -1, axis=0) - vertices[:count]
        following = np.roll(edges, -1, axis=0)
        turns = np.arctan2(edges[:, 0] * following[:, 1] - edges[:, 1] * following[:, 0], (edges * following).sum(axis=1))
        if count > 2 and (turns.min() < -1e-9 or turns.sum() > 7.0):  # once round is 2 pi
            raise SceneError(f'obstacles.vertices[{row}]', 'a convex polygon, anticlockwise', vertices[:count].tolist())
    if len(set(table.ids)) < n:
        raise SceneError('obstacles.ids', 'a different name for each obstacle', table.ids)
    return table


def _are_covariances(matrices: Array) -> NDArray[np.bool_]:
    """Tell which matrices (n, 2, 2) are symmetric, and have no eigenvalues below zero by more than rounding."""
    smallest, largest = np.linalg.eigvalsh(matrices).T
    is_symmetric = np.isclose(matrices, matrices.swapaxes(1, 2), atol=0.0).all(axis=(1, 2))
    flags: NDArray[np.bool_] = is_symmetric & (smallest >= -1e-9 * np.abs(largest))
    return flags
