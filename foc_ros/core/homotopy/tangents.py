"""Common tangents of two shapes, the straight lines that touch both.

The shapes are rounded convex polygons. Node 2 k + 1 is shape k passed anticlockwise, node 2 k the same shape passed clockwise.
Goals and hand follow as circles of radius 0, passed anticlockwise. A tangent from shape i to shape j touches the circles about a
vertex of each, p_i and p_j. With D = p_j - p_i and w = s_j r_j - s_i r_i where s is 1 (anticlockwise) or -1, it has the length
l = sqrt(|D|^2 - w^2), and its heading u is D turned by the angle -atan2(w, l). It leaves shape i at p_i + s_i r_i n and reaches
shape j at p_j + s_j r_j n, where n is u turned by -90 degrees. No other vertex of the shapes lies farther in the directions s n.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from foc_ros.core.kernels import Matrix, Vector, compiled_exactly, compiled_exactly_with_caller
from foc_ros.core.obstacles.boundary import Boundaries
from foc_ros.core.obstacles.rounded_polygon import Polygons, find_support

GRAZE = 1e-9
"""A run may pass this much nearer to a shape than its radius [m]: shapes in a row share tangents, up to rounding."""
MOST_STEPS = 8
"""So many steps the search for a common tangent makes from the directions of the two centres; two or three are enough."""


class Outlines(NamedTuple):
    """What runs leave and reach: n shapes, then goals and the hand as circles of radius 0, m rows in all.

    centre (m, 2), radius (m,) [m], polygons and their boundaries.
    """

    centre: Matrix
    radius: Vector
    polygons: Polygons
    boundaries: Boundaries


class Tangent(NamedTuple):
    """A straight run: the rows, the vertices and where it touches them, from the centres [m], heading, length [m]."""

    tail_row: int
    head_row: int
    tail_vertex: int
    head_vertex: int
    tail_x: float
    tail_y: float
    head_x: float
    head_y: float
    heading_x: float
    heading_y: float
    length: float


NO_TANGENT = Tangent(0, 0, 0, 0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


@compiled_exactly_with_caller
def find_tangent(outlines: Outlines, tail: int, head: int, tail_vertex: int, head_vertex: int) -> Tangent:
    """Find the straight line from a node to another about a vertex of each; its length is 0 if there is none."""
    i, j, vertices = tail >> 1, head >> 1, outlines.polygons.vertices
    tail_x, tail_y = vertices[i, tail_vertex, 0], vertices[i, tail_vertex, 1]
    head_x, head_y = vertices[j, head_vertex, 0], vertices[j, head_vertex, 1]
    x = outlines.centre[j, 0] - outlines.centre[i, 0] + (head_x - tail_x)
    y = outlines.centre[j, 1] - outlines.centre[i, 1] + (head_y - tail_y)
    r_tail, r_head = outlines.radius[i] * (2 * (tail & 1) - 1), outlines.radius[j] * (2 * (head & 1) - 1)
    square, w = x * x + y * y, r_head - r_tail
    length = np.sqrt(max(square - w * w, 0.0))
    square = max(square, 1e-300)
    u_x, u_y = (length * x + w * y) / square, (length * y - w * x) / square
    tail_x, tail_y, head_x, head_y = tail_x + r_tail * u_y, tail_y - r_tail * u_x, head_x + r_head * u_y, head_y - r_head * u_x
    return Tangent(i, j, tail_vertex, head_vertex, tail_x, tail_y, head_x, head_y, u_x, u_y, length)


@compiled_exactly_with_caller
def is_support(outlines: Outlines, row: int, vertex: int, x: float, y: float) -> bool:
    """Tell whether no vertex of an outline lies farther in a direction than the given one."""
    for k in range(outlines.polygons.corners[row]):
        to_x = outlines.polygons.vertices[row, k, 0] - outlines.polygons.vertices[row, vertex, 0]
        to_y = outlines.polygons.vertices[row, k, 1] - outlines.polygons.vertices[row, vertex, 1]
        if to_x * x + to_y * y > GRAZE:
            return False
    return True


@compiled_exactly
def find_later_support(outlines: Outlines, row: int, x: float, y: float) -> int:
    """Return the vertex of an outline that is farthest in a direction, of equal ones the last one anticlockwise."""
    vertices, best = outlines.polygons.vertices[row], find_support(outlines.polygons, row, x, y)
    bar, latest = vertices[best, 0] * x + vertices[best, 1] * y - GRAZE, -np.inf
    for k in range(outlines.polygons.corners[row]):
        late = vertices[k, 1] * x - vertices[k, 0] * y
        if vertices[k, 0] * x + vertices[k, 1] * y >= bar and late > latest:
            best, latest = k, late
    return best


@compiled_exactly
def find_tangent_between(outlines: Outlines, tail: int, head: int, start: int) -> Tangent:
    """Find the common tangent from a node to another about the vertices that are farthest in one of some directions.

    start: 0, 1, ... for the normals at which the arcs of the shape at the end begin, then of the one at the start. As the normal
    turns on from these, the farthest vertices stay the same up to the next one, so the pairs of all common tangents are among
    them. The length is 0 if there is no tangent about these vertices.
    """
    i, j, polygons, normal = tail >> 1, head >> 1, outlines.polygons, outlines.boundaries.normal
    tail_sense, head_sense = 2 * (tail & 1) - 1, 2 * (head & 1) - 1
    if start < polygons.corners[j]:
        b, sense = start, head_sense * tail_sense
        a = find_later_support(outlines, i, sense * normal[j, b, 0], sense * normal[j, b, 1])
    else:
        a, sense = start - polygons.corners[j], head_sense * tail_sense
        b = find_later_support(outlines, j, sense * normal[i, a, 0], sense * normal[i, a, 1])
    run = find_tangent(outlines, tail, head, a, b)
    is_common = is_support(outlines, i, a, tail_sense * run.heading_y, -tail_sense * run.heading_x)
    if is_common and is_support(outlines, j, b, head_sense * run.heading_y, -head_sense * run.heading_x):
        return run
    return NO_TANGENT


@compiled_exactly_with_caller
def count_starts(outlines: Outlines, tail: int, head: int) -> int:
    """Return the number of starts of `find_tangent_between`."""
    corners = outlines.polygons.corners
    return int(corners[head >> 1] + (corners[tail >> 1] if corners[tail >> 1] > 1 else 0))


@compiled_exactly
def search_tangent(outlines: Outlines, tail: int, head: int) -> Tangent:
    """Find the first common tangent from a node to another; its length is 0 if there is none."""
    for start in range(count_starts(outlines, tail, head)):
        run = find_tangent_between(outlines, tail, head, start)
        if run.length > 0.0:
            return run
    return NO_TANGENT


@compiled_exactly_with_caller
def find_only_tangent(outlines: Outlines, tail: int, head: int) -> Tangent:
    """Find the common tangent from a node to another that does not overlap it; its length is 0 if there is none.

    The vertices farthest along the normal of a tangent give the next tangent, beginning with the line between the centres.
    """
    i, j, polygons = tail >> 1, head >> 1, outlines.polygons
    tail_sense, head_sense = 2 * (tail & 1) - 1, 2 * (head & 1) - 1
    x, y = outlines.centre[j, 0] - outlines.centre[i, 0], outlines.centre[j, 1] - outlines.centre[i, 1]
    a_before, b_before = -1, -1
    for _ in range(MOST_STEPS):
        a = find_support(polygons, i, tail_sense * y, -tail_sense * x)
        b = find_support(polygons, j, head_sense * y, -head_sense * x)
        if a == a_before and b == b_before:
            break
        run, a_before, b_before = find_tangent(outlines, tail, head, a, b), a, b
        x, y = run.heading_x, run.heading_y
        if is_support(outlines, i, a, tail_sense * y, -tail_sense * x) and is_support(
            outlines, j, b, head_sense * y, -head_sense * x
        ):
            return run
    return search_tangent(outlines, tail, head)
