"""The shape of an obstacle: a rounded convex polygon, the points within a distance of a convex polygon with V vertices.

One vertex makes a circle, two a capsule, more a box or a convex hull. Three functions are all that the package knows of a shape:
the support vertex in a direction, the point of the polygon that is nearest to a position, and lengths along the boundary. With
q(p) the nearest point of the polygon, d = p - q(p). Outside the polygon |d| grows with the rate n = d / |d|, which turns as p
moves where q is a vertex (by t / |d| along the tangent t), and keeps its direction where q is on an edge. Inside the polygon q is
the nearest point of its boundary, d points inwards, and distances count as negative: n = -d / |d| points outwards everywhere.

The boundary of the rounded shape consists of an arc about each vertex and a straight part along each edge: see `boundary`.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from foc_ros.core.kernels import Indices, Matrix, Tensor, Vector, compiled, compiled_separately, compiled_with_caller
from foc_ros.core.types import Array, Obstacles

TURN = 2.0 * np.pi


class Polygons(NamedTuple):
    """m convex polygons.

    vertices (m, V, 2): anticlockwise, relative to the centres [m]; corners (m,): number of vertices of each, the rows beyond
    are not used.
    """

    vertices: Tensor
    corners: Indices


class Offset(NamedTuple):
    """The position of a point relative to a polygon.

    x, y: d, from the nearest point of the polygon [m]; side: 1.0 outside, -1.0 inside the polygon; is_on_edge: whether the
    nearest point is on an edge.
    """

    x: float
    y: float
    side: float
    is_on_edge: bool


@compiled_with_caller
def find_support(polygons: Polygons, j: int, x: float, y: float) -> int:
    """Return the vertex of polygon j that is farthest in a direction, of equal ones the first."""
    best, farthest = 0, -np.inf
    for k in range(polygons.corners[j]):
        along = polygons.vertices[j, k, 0] * x + polygons.vertices[j, k, 1] * y
        if along > farthest:
            best, farthest = k, along
    return best


@compiled_separately
def _find_offset_from_edges(polygons: Polygons, j: int, x: float, y: float) -> Offset:
    """Return what `find_offset` does for a polygon with two vertices or more."""
    corners, nearest, is_inside = polygons.corners[j], np.inf, polygons.corners[j] > 2
    offset_x, offset_y, is_on_edge = 0.0, 0.0, False
    for k in range(corners if corners > 2 else 1):
        after = (k + 1) % corners
        from_x, from_y = x - polygons.vertices[j, k, 0], y - polygons.vertices[j, k, 1]
        edge_x = polygons.vertices[j, after, 0] - polygons.vertices[j, k, 0]
        edge_y = polygons.vertices[j, after, 1] - polygons.vertices[j, k, 1]
        share = (from_x * edge_x + from_y * edge_y) / (edge_x * edge_x + edge_y * edge_y)
        is_inside = is_inside and edge_x * from_y - edge_y * from_x > 0.0
        is_between = 0.0 < share < 1.0
        share = min(max(share, 0.0), 1.0)
        to_x, to_y = from_x - share * edge_x, from_y - share * edge_y
        square = to_x * to_x + to_y * to_y
        if square < nearest:
            nearest, offset_x, offset_y, is_on_edge = square, to_x, to_y, is_between
    return Offset(offset_x, offset_y, -1.0 if is_inside else 1.0, is_on_edge)


@compiled_with_caller
def find_offset(polygons: Polygons, j: int, x: float, y: float) -> Offset:
    """Return the position of a point relative to polygon j; x, y: relative to its centre [m]."""
    if polygons.corners[j] == 1:
        return Offset(x - polygons.vertices[j, 0, 0], y - polygons.vertices[j, 0, 1], 1.0, False)
    return _find_offset_from_edges(polygons, j, x, y)


@compiled_with_caller
def find_normal(offset: Offset, smallest: float) -> tuple[float, float, float]:
    """Return the signed distance [m], its size at least a smallest one, and the outward normal (x, y)."""
    distance = max(np.hypot(offset.x, offset.y), smallest) * offset.side
    return distance, offset.x / distance, offset.y / distance


@compiled_with_caller
def measure_extent(polygons: Polygons, j: int) -> float:
    """Return the largest distance of a vertex of polygon j from its centre [m]."""
    square = 0.0
    for k in range(polygons.corners[j]):
        square = max(square, polygons.vertices[j, k, 0] ** 2 + polygons.vertices[j, k, 1] ** 2)
    return float(np.sqrt(square))


@compiled
def measure_half_widths(polygons: Polygons) -> Vector:
    """Return half of the least width of each polygon, (m,) [m]; 0 for circles and capsules."""
    widths = np.zeros(len(polygons.corners))
    for j in range(len(widths)):
        corners, least = polygons.corners[j], np.inf
        for k in range(corners if corners > 2 else 0):
            after, width = (k + 1) % corners, 0.0
            edge_x = polygons.vertices[j, after, 0] - polygons.vertices[j, k, 0]
            edge_y = polygons.vertices[j, after, 1] - polygons.vertices[j, k, 1]
            for other in range(corners):
                x, y = (
                    polygons.vertices[j, other, 0] - polygons.vertices[j, k, 0],
                    polygons.vertices[j, other, 1] - polygons.vertices[j, k, 1],
                )
                width = max(width, (edge_x * y - edge_y * x) / np.hypot(edge_x, edge_y))
            least = min(least, width)
        widths[j] = least / 2.0 if corners > 2 else 0.0
    return widths


@compiled
def find_offsets(points: Matrix, centres: Tensor, polygons: Polygons) -> tuple[Tensor, Matrix]:
    """Return d (q, m, 2) [m] and signed distances (q, m) [m] of points (q, 2) from polygons.

    centres (q, m, 2), or (1, m, 2) if they stand still [m].
    """
    offset, distance = np.empty((len(points), centres.shape[1], 2)), np.empty((len(points), centres.shape[1]))
    for i in range(len(points)):
        at = min(i, len(centres) - 1)
        for j in range(centres.shape[1]):
            found = find_offset(polygons, j, points[i, 0] - centres[at, j, 0], points[i, 1] - centres[at, j, 1])
            offset[i, j, 0], offset[i, j, 1] = found.x, found.y
            distance[i, j] = np.hypot(found.x, found.y) * found.side
    return offset, distance


def tabulate_polygons(obstacles: Obstacles) -> Polygons:
    """Return the polygons of obstacles."""
    return Polygons(obstacles.vertices, obstacles.corners)


def measure_offsets(points: Array, obstacles: Obstacles, centres: Array | None = None) -> tuple[Array, Array]:
    """Return d (q, n, 2) and signed distances (q, n) [m] of points (q, 2) from the polygons of n obstacles.

    centres (q, n, 2) [m]: where the obstacles are at each point, if they move. Distances are from the polygons: the boundary of a
    circle is at its radius.
    """
    rows = obstacles.centre[None] if centres is None else centres
    at = np.ascontiguousarray(points, dtype=float).reshape(-1, 2)
    return find_offsets(at, np.ascontiguousarray(rows, dtype=float), tabulate_polygons(obstacles))
