# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Outlines: convex polygons around rounded polygons, and straight lines that they block.

The outline of a rounded polygon touches it along each of its edges and at some directions between them. Where two shapes leave a
narrow gap, both outlines also touch their shape where the other one is nearest. So two outlines leave a gap open if and only if
the shapes do.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from foc_ros.core.obstacle_table import Obstacles
from foc_ros.core.obstacles.geometry import measure_offsets
from foc_ros.core.types import Array

Flags = NDArray[np.bool_]

NARROW = 0.04
"""An outline stands out of its shape by less than this share of the radius; a gap is narrow below this share of both radii."""
SAME = 1e-7
"""Edges whose directions differ by less count as one [rad]."""
CHUNK = 512
"""So many lines are compared with the outlines at once: larger arrays do not fit into the cache."""
KEPT = 32
"""Number of results that are kept: goals inside different obstacles have graphs of their own."""
GRAZE = 1e-9
"""A line may enter an outline this deep [m]: shapes in a row share tangents, up to rounding."""


@dataclass(frozen=True, eq=False)
class Outlines:
    """The outlines of n shapes, each with e vertices, of which the last may be repeated.

    vertices (n, e, 2): anticlockwise [m]; normals (n, e, 2), offsets (n, e): the outline consists of the points p with
    normal . p <= offset for each edge [m], edge k ending at vertex k; count (n,): number of vertices without repetitions.
    centre (n, 2): of the obstacles; middle (n, 2): a point inside [m]; inner, extent (n,): the least distance of an edge from it,
    and the largest of a vertex [m].
    """

    centre: Array
    vertices: Array
    normals: Array
    offsets: Array
    count: NDArray[np.intp]
    middle: Array
    inner: Array
    extent: Array

    def __len__(self) -> int:
        return len(self.count)

    def take(self, rows: NDArray[np.intp] | Flags) -> Outlines:
        """Return some of the outlines."""
        return Outlines(*[array[rows] for array in vars(self).values()])

    def measure_scale(self, point: Array) -> Array:
        """Return the size (n,), as a multiple, at which each outline does not hold a point (2,) [m]: 1 unless it holds it now."""
        reach = (self.normals * self.middle[:, None]).sum(axis=2)
        scale: Array = np.minimum((self.normals @ point - reach) / (self.offsets - reach), 1.0).max(axis=1, initial=0.0)
        return np.where(scale < 1.0, scale * (1.0 - SAME), 1.0)

    def shrink(self, scale: Array) -> Outlines:
        """Return the outlines, shrunk towards their middle to a multiple (n,) of their size."""
        if (scale == 1.0).all():
            return self
        reach = (self.normals * self.middle[:, None]).sum(axis=2)
        return replace(
            self,
            vertices=self.middle[:, None] + scale[:, None, None] * (self.vertices - self.middle[:, None]),
            offsets=reach + scale[:, None] * (self.offsets - reach),
            inner=scale * self.inner,
            extent=scale * self.extent,
        )

    def hold(self, points: Array, owner: NDArray[np.intp]) -> Flags:
        """Tell which of points (q, 2) [m] lie in an outline other than their owner (q,), (q,)."""
        apart = points[:, None] - self.middle
        is_near = apart[..., 0] ** 2 + apart[..., 1] ** 2 < self.extent**2
        is_near[np.arange(len(points)), owner] = False
        row, column = np.nonzero(is_near)
        flags = np.zeros(len(points), dtype=np.bool_)
        flags[row[self.take(column).cut(points[row], points[row])]] = True
        return flags

    def block(self, begin: Array, end: Array) -> Flags:
        """Tell which straight lines from begin (m, 2) to end (m, 2) [m] some outline blocks, (m,)."""
        if len(begin) > CHUNK:
            return np.concatenate(
                [self.block(begin[at : at + CHUNK], end[at : at + CHUNK]) for at in range(0, len(begin), CHUNK)]
            )
        line = end - begin
        length = np.hypot(*line.T)
        ahead = line / np.maximum(length, np.finfo(float).tiny)[:, None]
        aside = np.column_stack([-ahead[:, 1], ahead[:, 0]])
        along = ahead @ self.middle.T - (ahead * begin).sum(axis=1)[:, None]
        beyond = along - np.clip(along, 0.0, length[:, None])
        square = (aside @ self.middle.T - (aside * begin).sum(axis=1)[:, None]) ** 2 + beyond**2
        flags: Flags = (square < np.maximum(self.inner - GRAZE, 0.0) ** 2).any(axis=1)
        row, column = np.nonzero((square < self.extent**2) & ~flags[:, None])
        flags[row[self.take(column).cut(begin[row], end[row])]] = True
        return flags

    def cut(self, begin: Array, end: Array) -> Flags:
        """Tell whether each outline blocks a straight line of its own, from begin (n, 2) to end (n, 2) [m]; (n,)."""
        x, y, bar = self.normals[..., 0], self.normals[..., 1], self.offsets - GRAZE
        before, after = (x * point[:, :1] + y * point[:, 1:] - bar for point in (begin, end))
        is_out, ends_out = before >= 0.0, after >= 0.0
        share = before / np.where(is_out == ends_out, 1.0, before - after)
        enters = np.where(is_out, np.where(ends_out, np.inf, share), 0.0).max(axis=1, initial=0.0)
        leaves = np.where(ends_out & ~is_out, share, 1.0).min(axis=1, initial=1.0)
        flags: Flags = enters < leaves
        return flags


@dataclass(frozen=True)
class _Shapes:
    """Obstacles with radii (n,) as the argument of a cache: those at the same places with equal shapes and radii are equal."""

    key: tuple[bytes, ...]
    obstacles: Obstacles = field(compare=False)
    radius: Array = field(compare=False)

    @classmethod
    def of(cls, obstacles: Obstacles, radius: Array) -> _Shapes:
        arrays = obstacles.centre, obstacles.vertices, obstacles.corners, radius
        return cls(tuple([array.tobytes() for array in arrays]), obstacles, radius)


def measure_gaps(obstacles: Obstacles) -> tuple[Array, Array]:
    """Return how far the polygons of each two obstacles lie apart (n, n) [m], and the vectors (n, n, 2) [m] across the gaps.

    These lead from the second polygon to the first. The distance of an obstacle from itself is infinite.
    """
    return _measure_gaps(_Shapes.of(obstacles, np.zeros(0)))


def outline_obstacles(obstacles: Obstacles, radius: Array) -> Outlines:
    """Return the outlines of obstacles of a radius (n,) [m]; the same object for obstacles that stay the same."""
    return _outline(_Shapes.of(obstacles, radius))


@lru_cache(maxsize=KEPT)
def _measure_gaps(shapes: _Shapes) -> tuple[Array, Array]:
    obstacles = shapes.obstacles
    n, most = obstacles.vertices.shape[:2]
    offset, distance = measure_offsets((obstacles.centre[:, None] + obstacles.vertices).reshape(-1, 2), obstacles)
    is_corner = np.arange(most) < obstacles.corners[:, None]
    distance = np.where(is_corner[..., None], np.maximum(distance.reshape(n, most, n), 0.0), np.inf)
    nearest, rows = distance.argmin(axis=1), np.arange(n)
    gap, apart = distance[rows[:, None], nearest, rows], offset.reshape(n, most, n, 2)[rows[:, None], nearest, rows]
    # of two polygons, the vertex that is nearest to the other one may belong to either
    is_other = gap > gap.T
    gap, apart = np.where(is_other, gap.T, gap), np.where(is_other[..., None], -apart.transpose(1, 0, 2), apart)
    np.fill_diagonal(gap, np.inf)
    return gap, apart


@lru_cache(maxsize=KEPT)
def _outline(shapes: _Shapes) -> Outlines:
    obstacles, radius = shapes.obstacles, shapes.radius
    gap, apart = measure_gaps(obstacles)
    both = radius[:, None] + radius
    is_narrow = (gap > both) & (gap < (1.0 + NARROW) * both)
    towards = np.arctan2(-apart[..., 1], -apart[..., 0])
    traced = []
    for row, (polygon, size) in enumerate(zip(obstacles.vertices, radius.tolist(), strict=True)):
        touching = towards[row, is_narrow[row]].tobytes()
        traced.append(_trace(polygon[: obstacles.corners[row]].tobytes(), size, touching))
    count = np.array([len(points) for points, _ in traced], dtype=np.intp)
    shape = len(traced), int(count.max(initial=1)), 2
    rows = np.minimum(np.arange(shape[1]), count[:, None] - 1)
    points = np.reshape([each[kept] for (each, _), kept in zip(traced, rows, strict=True)], shape) + obstacles.centre[:, None]
    normals = np.reshape([each[kept] for (_, each), kept in zip(traced, rows, strict=True)], shape)
    is_vertex = np.arange(points.shape[1]) < count[:, None]
    middle = np.where(is_vertex[..., None], points, 0.0).sum(axis=1) / count[:, None]
    offsets = (normals * points).sum(axis=2)
    inner = (offsets - (normals * middle[:, None]).sum(axis=2)).min(axis=1, initial=np.inf)
    extent = np.hypot(*(points - middle[:, None]).transpose(2, 0, 1)).max(axis=1, initial=0.0)
    return Outlines(obstacles.centre, points, normals, offsets, count, middle, inner, extent)


@lru_cache(maxsize=256)
def _trace(vertices: bytes, radius: float, touching: bytes) -> tuple[Array, Array]:
    """Return the vertices (e, 2) [m] of the outline of a rounded polygon (v, 2), and the normals (e, 2) of the edges before them.

    touching: directions [rad] in which the outline touches the shape, in addition to those of the edges.
    """
    polygon = np.frombuffer(vertices).reshape(-1, 2)
    edges = np.roll(polygon, -1, axis=0) - polygon
    edges = edges[np.hypot(*edges.T) > GRAZE]
    directions = np.sort(np.arctan2(-edges[:, 0], edges[:, 1])) if len(edges) else np.zeros(1)
    wide = np.diff(directions, append=directions[0] + 2.0 * np.pi)
    # 12 edges or more go round a circle, and the outline stands out of the shape by 1 mm at most
    widest = min(np.pi / 6.0, 2.0 * np.arccos(radius / (radius + 0.001)))
    parts = np.maximum(np.ceil(wide / widest - SAME), 1.0).astype(int)
    arcs = [first + turn * np.arange(k) / k for first, turn, k in zip(directions, wide, parts, strict=True)]
    angles = np.sort(np.mod(np.concatenate([*arcs, np.frombuffer(touching)]), 2.0 * np.pi))
    angles = angles[np.diff(angles, append=angles[0] + 2.0 * np.pi) > SAME]
    half = np.diff(angles, append=angles[0] + 2.0 * np.pi) / 2.0
    middle = np.column_stack([np.cos(angles + half), np.sin(angles + half)])
    corner = polygon[(middle @ polygon.T).argmax(axis=1)]
    return corner + (radius / np.cos(half))[:, None] * middle, np.column_stack([np.cos(angles), np.sin(angles)])
