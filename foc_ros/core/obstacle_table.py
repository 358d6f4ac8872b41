# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The table of obstacles: polygons with uncertain radii, centres and velocities, as all parts of the package read it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from foc_ros.core.types import Array, Record, as_readonly

UNKNOWN_HEIGHTS = as_readonly(np.array([-np.inf, np.inf]))
"""Lowest and highest point of an obstacle whose height is not known [m]: it blocks at every height."""


class Edges(NamedTuple):
    """The edges of convex polygons about their centres, padded to one number V of edges by edges without length.

    x, y: where each edge begins [m]; along_x, along_y: from there to its end [m]; inverse_square: 1 / length^2 [1/m^2], 0 without
    length; is_solid: whether the polygon has an inside. The last axis of all is that of the edges.
    """

    x: Array
    y: Array
    along_x: Array
    along_y: Array
    inverse_square: Array
    is_solid: NDArray[np.bool_]

    def take(self, key: Any) -> Edges:
        """Return the edges at an index of the axes before the last one."""
        return Edges(self.x[key], self.y[key], self.along_x[key], self.along_y[key], self.inverse_square[key], self.is_solid[key])


def tabulate_edges(vertices: Array, corners: NDArray[Any]) -> Edges:
    """Return the edges of polygons (..., V) with vertices (..., V, 2) [m], of which the first `corners` (...) are used."""
    begin = np.where((np.arange(vertices.shape[-2]) < corners[..., None])[..., None], vertices, vertices[..., :1, :])
    along = np.roll(begin, -1, axis=-2) - begin
    square = (along**2).sum(axis=-1)
    inverse = np.divide(1.0, square, out=np.zeros_like(square), where=square > 0.0)
    return Edges(begin[..., 0], begin[..., 1], along[..., 0], along[..., 1], inverse, (corners > 2)[..., None])


@dataclass(frozen=True, eq=False, repr=False)
class Obstacles(Record):
    """Rounded convex polygons in the task plane, as a table of n rows; a circle is a polygon with one vertex, at its centre.

    ids: name of each, used in labels; centre (n, 2): a point inside [m]; radius (n,): mean distance of the boundary from the
    polygon [m]; radius_stddev (n,) [m]; velocity (n, 2) [m/s]; centre_covariance (n, 2, 2) [m^2]; vertices (n, V, 2): of the
    polygons, anticlockwise, relative to the centre [m]; corners (n,): number of vertices of each, rows beyond are not used;
    heights (n, 2): lowest and highest point of each along the plane's normal [m], UNKNOWN_HEIGHTS where they are not known.
    """

    ids: tuple[str, ...]
    centre: Array
    radius: Array
    radius_stddev: Array
    velocity: Array
    centre_covariance: Array
    vertices: Array
    corners: NDArray[np.intp]
    heights: Array

    def __len__(self) -> int:
        return len(self.ids)

    def __repr__(self) -> str:
        """Count the obstacles and name the first few."""
        names = ', '.join(self.ids[:5]) + (', ...' if len(self) > 5 else '')
        return f'<Obstacles: {len(self)}{names and f" ({names})"}>'

    @cached_property
    def edges(self) -> Edges:
        """The edges of the polygons, (n, V)."""
        return tabulate_edges(self.vertices, self.corners)

    def take(self, rows: NDArray[np.intp] | list[int]) -> Obstacles:
        """Return the obstacles of the given rows, in that order."""
        index = np.asarray(rows, dtype=np.intp)
        columns = [getattr(self, name)[index] for name in COLUMNS]
        return Obstacles(tuple(self.ids[i] for i in index), *columns)

    @property
    def extent(self) -> Array:
        """Largest distance of the boundary of each obstacle from its centre, (n,) [m]."""
        farthest: Array = np.hypot(self.vertices[..., 0], self.vertices[..., 1]).max(axis=1, initial=0.0) + self.radius
        return farthest

    def grow(self, radius: float) -> Obstacles:
        """Return the obstacles with a radius [m] added to those of all, such as that of the hand."""
        return replace(self, radius=self.radius + radius) if radius else self

    def after(self, seconds: float) -> Obstacles:
        """Return the obstacles at a time `seconds` [s] later, each moved on at its velocity."""
        if not self.velocity.any():
            return self
        return replace(self, centre=self.centre + seconds * self.velocity)


COLUMNS = tuple(each.name for each in fields(Obstacles) if each.name != 'ids')
"""Arrays of a table, with a row for each obstacle."""


def make_obstacles(
    centre: ArrayLike = (),
    radius: ArrayLike = (),
    radius_stddev: ArrayLike = 0.0,
    ids: tuple[str, ...] | None = None,
    velocity: ArrayLike = 0.0,
    centre_covariance: ArrayLike = 0.0,
    polygons: Sequence[Array] | None = None,
    heights: ArrayLike = UNKNOWN_HEIGHTS,
) -> Obstacles:
    """Build `Obstacles` from array-likes; scalars hold for every row, and ids default to the numbers of the rows.

    polygons: vertices of each (v, 2), anticlockwise, relative to the centre [m]; circles if not given. heights: (n, 2) or (2,).
    """
    centres = np.asarray(centre, dtype=float).reshape(-1, 2)
    n = len(centres)
    corners = np.ones(n, dtype=np.intp) if polygons is None else np.array([len(each) for each in polygons], dtype=np.intp)
    vertices = np.zeros((n, corners.max(initial=1), 2))
    for row, each in enumerate(polygons or ()):
        vertices[row, : len(each)] = each
    return Obstacles(
        tuple(str(i) for i in range(n)) if ids is None else tuple(ids),
        centres,
        np.full(n, radius, dtype=float),
        np.full(n, radius_stddev, dtype=float),
        np.full((n, 2), velocity, dtype=float),
        np.full((n, 2, 2), centre_covariance, dtype=float),
        vertices,
        corners,
        np.full((n, 2), heights, dtype=float),
    )
