"""Which shapes contain the centre of another, overlap, and cover its boundary.

Of two shapes that overlap, each part of one that protrudes from the other begins and ends with a tangent. The boundary is cut
where the other shape covers it.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from foc_ros.core.kernels import Flags, FlagTable, Indices, Matrix, Vector, compiled_exactly
from foc_ros.core.obstacles.boundary import find_approach, find_exit
from foc_ros.core.obstacles.rounded_polygon import find_offset

from .tangents import GRAZE, Outlines, count_starts, find_tangent_between


class Shapes(NamedTuple):
    """How n shapes hold, overlap and cover each other.

    extent (n,): largest distance of the boundary from the centre [m]; beginning (n, 2): first point of the boundary, from the
    centre [m]; is_outer (n,): whether a shape lies in no other one (the first of equal ones is outer); holds (n, n): whether a
    shape holds the centre of another one; overlaps (n, n): whether outer shapes overlap; cluster (n,): equal numbers for shapes
    that are linked by overlaps. cut (c,): lengths along the boundaries at which another shape covers them [m], one for each
    covered part; first_cut (n + 1,): where those of each shape begin.
    """

    extent: Vector
    beginning: Matrix
    is_outer: Flags
    holds: FlagTable
    overlaps: FlagTable
    cluster: Indices
    cut: Vector
    first_cut: Indices


@compiled_exactly
def find_cuts(outlines: Outlines, overlaps: FlagTable) -> tuple[Vector, Indices]:
    """Return the cuts of `Shapes` and where those of each shape begin.

    Where a tangent leaves one of two shapes that overlap and where it reaches the other, these stand out of each other. The line
    from such a point to a common point of both leaves the other shape where the first one covers its boundary.
    """
    n, most = len(overlaps), 0
    for i in range(n):
        for j in range(n):
            if overlaps[i, j]:
                most += 2 * count_starts(outlines, 2 * i + 1, 2 * j + 1)
    row, place, count = np.empty(most, np.intp), np.empty(most), 0
    for i in range(n):
        for j in range(n):
            starts = count_starts(outlines, 2 * i + 1, 2 * j + 1) if overlaps[i, j] else 0
            if starts == 0:
                continue
            x, y = outlines.centre[j, 0] - outlines.centre[i, 0], outlines.centre[j, 1] - outlines.centre[i, 1]
            near = find_approach(outlines.polygons, i, j, x, y)
            share = outlines.radius[i] / (outlines.radius[i] + outlines.radius[j])
            both_x, both_y = near.x + share * (near.other_x - near.x), near.y + share * (near.other_y - near.y)
            for start in range(starts):
                run = find_tangent_between(outlines, 2 * i + 1, 2 * j + 1, start)
                if run.length <= 0.0:
                    continue
                for own, inside, outside in (
                    (i, (both_x, both_y), (x + run.head_x, y + run.head_y)),
                    (j, (both_x - x, both_y - y), (run.tail_x - x, run.tail_y - y)),
                ):
                    offset, radius = find_offset(outlines.polygons, own, outside[0], outside[1]), outlines.radius[own]
                    # where edges lie on one line, a tangent may end on the boundary of both
                    if np.hypot(offset.x, offset.y) * offset.side > radius + GRAZE:
                        row[count] = own
                        place[count] = find_exit(outlines.polygons, outlines.boundaries, own, radius, inside, outside)
                        count += 1
    first_cut = np.zeros(n + 1, np.intp)
    for each in row[:count]:
        for k in range(each + 1, n + 1):
            first_cut[k] += 1
    cut, following = np.empty(count), first_cut.copy()
    for c in range(count):
        cut[following[row[c]]] = place[c]
        following[row[c]] += 1
    return cut, first_cut


@compiled_exactly
def build_shapes(outlines: Outlines, n: int) -> Shapes:
    """Find out how the first n outlines hold, overlap and cover each other."""
    centre, radius, polygons = outlines.centre, outlines.radius, outlines.polygons
    extent, beginning = np.empty(n), np.empty((n, 2))
    for k in range(n):
        vertices, farthest = polygons.vertices[k, : polygons.corners[k]], 0.0
        for vertex in vertices:
            farthest = max(farthest, np.hypot(vertex[0], vertex[1]))
        extent[k] = farthest + radius[k]
        for axis in range(2):
            beginning[k, axis] = vertices[0, axis] + radius[k] * outlines.boundaries.normal[k, 0, axis]
    holds, overlaps, is_within = np.zeros((n, n), np.bool_), np.zeros((n, n), np.bool_), np.zeros((n, n), np.bool_)
    for i in range(n):
        for k in range(n):
            x, y = centre[k, 0] - centre[i, 0], centre[k, 1] - centre[i, 1]
            if x * x + y * y < (extent[i] + extent[k]) ** 2:
                offset = find_offset(polygons, i, x, y)
                holds[i, k] = np.hypot(offset.x, offset.y) * offset.side < radius[i]
                overlaps[i, k] = i == k or find_approach(polygons, i, k, x, y).distance < radius[i] + radius[k]
                is_within[k, i] = overlaps[i, k] and i != k
                for vertex in polygons.vertices[k, : polygons.corners[k]]:
                    offset = find_offset(polygons, i, x + vertex[0], y + vertex[1])
                    is_within[k, i] &= np.hypot(offset.x, offset.y) * offset.side + radius[k] <= radius[i]
    # of shapes that lie within each other, so equal ones, the first is outer
    is_outer, cluster = np.ones(n, np.bool_), np.arange(n)
    for i in range(n):
        for k in range(n):
            is_outer[i] &= not is_within[i, k] or (is_within[k, i] and i < k)
            if overlaps[i, k] and cluster[i] != cluster[k]:
                low, high = min(cluster[i], cluster[k]), max(cluster[i], cluster[k])
                for each in range(n):
                    if cluster[each] == high:
                        cluster[each] = low
    for i in range(n):
        for k in range(n):
            overlaps[i, k] &= i != k and is_outer[i] and is_outer[k]
    cut, first_cut = find_cuts(outlines, overlaps)
    return Shapes(extent, beginning, is_outer, holds, overlaps, cluster, cut, first_cut)
