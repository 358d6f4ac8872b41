"""The boundary of a rounded polygon: lengths along it, tangents to it, and what comes how near to it.

A place on the boundary is told by the vertex about which it lies and the angle of its normal, counted from the beginning of the
arc about the first vertex. With phi this angle and E the length of the edges before the vertex, the length of the boundary from
its beginning to the place is r phi + E.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from foc_ros.core.kernels import Matrix, Tensor, compiled, compiled_exactly, compiled_exactly_with_caller, compiled_separately

from .rounded_polygon import TURN, Polygons, find_offset, find_support

TURN_BACK = 1e-9
"""An arc may have this negative angle [rad]: it lies between runs of shapes in a row, which share a tangent, up to rounding."""
EXACT = 1e-12
"""Distance [m] from a boundary at which the search for a point of it ends."""
MOST_STEPS = 50


class Boundaries(NamedTuple):
    """The boundaries of m polygons.

    normal (m, V, 2): unit normal at the beginning of the arc about each vertex; angle, edge (m, V + 1): the angles [rad] of all
    arcs and the lengths [m] of all edges before each vertex, and in the row after the last vertex of all.
    """

    normal: Tensor
    angle: Matrix
    edge: Matrix


class Place(NamedTuple):
    """A place on a boundary: a vertex, and the angle from the beginning of the boundary [rad]."""

    vertex: int
    angle: float


class Approach(NamedTuple):
    """Where two polygons are nearest: distance, 0 if they meet, and a point of each, from the centre of the first [m]."""

    distance: float
    x: float
    y: float
    other_x: float
    other_y: float


class Touch(NamedTuple):
    """A tangent from a point: its length [m], and the vertex and the normal where it touches."""

    length: float
    vertex: int
    normal_x: float
    normal_y: float


@compiled_exactly
def tabulate_boundaries(polygons: Polygons) -> Boundaries:
    """Return the boundaries of polygons."""
    m, most = polygons.vertices.shape[:2]
    normal, angle, edge = np.zeros((m, most, 2)), np.zeros((m, most + 1)), np.zeros((m, most + 1))
    for j in range(m):
        corners, vertex = polygons.corners[j], polygons.vertices[j]
        normal[j, 0, 0] = 1.0
        for k in range(corners):
            after = (k + 1) % corners
            x, y = vertex[after, 0] - vertex[k, 0], vertex[after, 1] - vertex[k, 1]
            length = np.hypot(x, y)
            edge[j, k + 1] = edge[j, k] + length
            if length > 0.0:
                normal[j, after, 0], normal[j, after, 1] = y / length, -x / length
        for k in range(corners - 1):
            x, y, next_x, next_y = normal[j, k, 0], normal[j, k, 1], normal[j, k + 1, 0], normal[j, k + 1, 1]
            angle[j, k + 1] = angle[j, k] + abs(np.arctan2(x * next_y - y * next_x, x * next_x + y * next_y))
        angle[j, corners] = TURN
    return Boundaries(normal, angle, edge)


@compiled_exactly_with_caller
def find_place(boundaries: Boundaries, j: int, vertex: int, x: float, y: float) -> Place:
    """Return the place about a vertex where the normal has a direction; one beyond the arc counts as its nearest end."""
    along, aside = boundaries.normal[j, vertex, 0], boundaries.normal[j, vertex, 1]
    angle, begin = np.arctan2(along * y - aside * x, along * x + aside * y) % TURN, boundaries.angle[j, vertex]
    wide = boundaries.angle[j, vertex + 1] - begin
    if angle > wide:
        angle = wide if angle - wide < TURN - angle else 0.0
    return Place(vertex, begin + angle)


@compiled_exactly_with_caller
def measure_arc(
    polygons: Polygons, boundaries: Boundaries, j: int, radius: float, begin: Place, end: Place, sense: int
) -> tuple[float, bool]:
    """Return the length [m] along a boundary from one place to another, and whether it passes the beginning of the boundary.

    sense: 1 anticlockwise, -1 clockwise.
    """
    angle = sense * (end.angle - begin.angle)
    edges = sense * (boundaries.edge[j, end.vertex] - boundaries.edge[j, begin.vertex])
    is_past_beginning = angle < -TURN_BACK or edges < 0.0
    if is_past_beginning:
        angle, edges = angle + TURN, edges + boundaries.edge[j, polygons.corners[j]]
    return radius * angle + edges, is_past_beginning


@compiled_separately
def find_segment_square(
    polygons: Polygons, j: int, x: float, y: float, heading_x: float, heading_y: float, length: float
) -> float:
    """Return the squared distance [m^2] of a straight line from polygon j, -1.0 if the line meets its inside or crosses it.

    x, y: beginning of the line, from the centre of the polygon [m]; heading: a unit vector; length [m].
    """
    nearest, corners = np.inf, polygons.corners[j]
    to_x, to_y = polygons.vertices[j, corners - 1, 0] - x, polygons.vertices[j, corners - 1, 1] - y
    along, aside = to_x * heading_x + to_y * heading_y, to_y * heading_x - to_x * heading_y
    for k in range(corners):
        along_before, aside_before = along, aside
        to_x, to_y = polygons.vertices[j, k, 0] - x, polygons.vertices[j, k, 1] - y
        along, aside = to_x * heading_x + to_y * heading_y, to_y * heading_x - to_x * heading_y
        beyond = along - min(max(along, 0.0), length)
        nearest = min(nearest, beyond * beyond + aside * aside)
        if aside * aside_before < 0.0 and 0.0 < along + (along_before - along) * aside / (aside - aside_before) < length:
            return -1.0
    if corners > 1:
        for step in (0.0, length):
            offset = find_offset(polygons, j, x + step * heading_x, y + step * heading_y)
            if offset.side < 0.0:
                return -1.0
            nearest = min(nearest, offset.x * offset.x + offset.y * offset.y)
    return nearest


@compiled
def find_segment_squares(path: Matrix, centre: Matrix, polygons: Polygons) -> Matrix:
    """Return what `find_segment_square` does for the lines between the points (q, 2) of a path, (q - 1, m) [m^2]."""
    squares = np.empty((max(len(path) - 1, 0), len(centre)))
    for i in range(len(path) - 1):
        x, y = path[i + 1, 0] - path[i, 0], path[i + 1, 1] - path[i, 1]
        length = np.hypot(x, y)
        x, y = (x / length, y / length) if length > 0.0 else (1.0, 0.0)
        for j in range(len(centre)):
            squares[i, j] = find_segment_square(polygons, j, path[i, 0] - centre[j, 0], path[i, 1] - centre[j, 1], x, y, length)
    return squares


@compiled_separately
def find_approach(polygons: Polygons, i: int, j: int, x: float, y: float) -> Approach:
    """Return where polygon i is nearest to polygon j, whose centre lies at x, y from that of i [m]."""
    found = Approach(np.inf, 0.0, 0.0, 0.0, 0.0)
    for a in range(polygons.corners[i]):
        own_x, own_y = polygons.vertices[i, a, 0], polygons.vertices[i, a, 1]
        offset = find_offset(polygons, j, own_x - x, own_y - y)
        distance = max(np.hypot(offset.x, offset.y) * offset.side, 0.0)
        if distance < found.distance:
            share = 1.0 if distance > 0.0 else 0.0
            found = Approach(distance, own_x, own_y, own_x - share * offset.x, own_y - share * offset.y)
    for b in range(polygons.corners[j]):
        own_x, own_y = polygons.vertices[j, b, 0] + x, polygons.vertices[j, b, 1] + y
        offset = find_offset(polygons, i, own_x, own_y)
        distance = max(np.hypot(offset.x, offset.y) * offset.side, 0.0)
        if distance < found.distance:
            share = 1.0 if distance > 0.0 else 0.0
            found = Approach(distance, own_x - share * offset.x, own_y - share * offset.y, own_x, own_y)
    if found.distance > 0.0:
        found = _find_crossing(polygons, i, j, x, y, found)
    return found


@compiled_separately
def _find_crossing(polygons: Polygons, i: int, j: int, x: float, y: float, nearest: Approach) -> Approach:
    """Return where an edge of polygon i crosses one of polygon j, else `nearest`; of two crossing bars no corner is inside."""
    for a in range(polygons.corners[i]):
        a_after = (a + 1) % polygons.corners[i]
        from_x, from_y = polygons.vertices[i, a, 0] - x, polygons.vertices[i, a, 1] - y
        to_x, to_y = polygons.vertices[i, a_after, 0] - x, polygons.vertices[i, a_after, 1] - y
        for b in range(polygons.corners[j]):
            b_after = (b + 1) % polygons.corners[j]
            begin_x, begin_y = polygons.vertices[j, b, 0], polygons.vertices[j, b, 1]
            edge_x, edge_y = polygons.vertices[j, b_after, 0] - begin_x, polygons.vertices[j, b_after, 1] - begin_y
            before = edge_x * (from_y - begin_y) - edge_y * (from_x - begin_x)
            after = edge_x * (to_y - begin_y) - edge_y * (to_x - begin_x)
            if before * after < 0.0:
                share = before / (before - after)
                at_x, at_y = from_x + share * (to_x - from_x), from_y + share * (to_y - from_y)
                along = (at_x - begin_x) * edge_x + (at_y - begin_y) * edge_y
                if 0.0 < along < edge_x * edge_x + edge_y * edge_y:
                    return Approach(0.0, at_x + x, at_y + y, at_x + x, at_y + y)
    return nearest


@compiled_separately
def find_exit(
    polygons: Polygons, boundaries: Boundaries, j: int, radius: float, inside: tuple[float, float], outside: tuple[float, float]
) -> float:
    """Return where a line leaves rounded polygon j, as the length along its boundary [m]; both ends from the centre [m].

    The distance of a point on the line is convex in its position, so Newton's method comes from outside and does not overshoot.
    """
    line_x, line_y, share = outside[0] - inside[0], outside[1] - inside[1], 1.0
    x, y = outside
    offset = find_offset(polygons, j, x, y)
    distance = max(np.hypot(offset.x, offset.y), EXACT)
    for _ in range(MOST_STEPS):
        rate = (offset.x * line_x + offset.y * line_y) / distance
        if offset.side < 0.0 or distance - radius < EXACT or rate <= 0.0:
            break
        share = max(share - (distance - radius) / rate, 0.0)
        x, y = inside[0] + share * line_x, inside[1] + share * line_y
        offset = find_offset(polygons, j, x, y)
        distance = max(np.hypot(offset.x, offset.y), EXACT)
    normal_x, normal_y = offset.side * offset.x / distance, offset.side * offset.y / distance
    vertex = find_support(polygons, j, normal_x, normal_y)
    place = find_place(boundaries, j, vertex, normal_x, normal_y)
    from_x, from_y = x - offset.x - polygons.vertices[j, vertex, 0], y - offset.y - polygons.vertices[j, vertex, 1]
    length = radius * place.angle + boundaries.edge[j, vertex] + from_y * normal_x - from_x * normal_y
    return float(length % (radius * TURN + boundaries.edge[j, polygons.corners[j]]))


@compiled_separately
def find_touch(polygons: Polygons, j: int, radius: float, x: float, y: float, sense: int) -> Touch:
    """Return the tangent from a point outside rounded polygon j; x, y: from the centre [m]; sense: 1 to pass it anticlockwise.

    Of the tangents to the circles about the vertices it is the one that has all the others on the side of the polygon.
    """
    w = sense * radius
    best_x, best_y, length, vertex = 0.0, 0.0, -1.0, 0
    for k in range(polygons.corners[j]):
        to_x, to_y = polygons.vertices[j, k, 0] - x, polygons.vertices[j, k, 1] - y
        square = max(to_x * to_x + to_y * to_y, 1e-300)
        ahead = np.sqrt(max(square - w * w, 0.0))
        heading_x, heading_y = (ahead * to_x + w * to_y) / square, (ahead * to_y - w * to_x) / square
        if length < 0.0 or sense * (best_x * heading_y - best_y * heading_x) < 0.0:
            best_x, best_y, length, vertex = heading_x, heading_y, ahead, k
    return Touch(length, vertex, sense * best_y, -sense * best_x)


@compiled_separately
def measure_way_round(
    polygons: Polygons,
    boundaries: Boundaries,
    j: int,
    radius: float,
    begin: tuple[float, float],
    end: tuple[float, float],
    sense: int,
) -> float:
    """Return the length [m] of two tangents and the arc between them, from one point round polygon j to another.

    begin, end: outside, from the centre [m]; sense: 1 to pass it anticlockwise.
    """
    first, last = (
        find_touch(polygons, j, radius, begin[0], begin[1], sense),
        find_touch(polygons, j, radius, end[0], end[1], -sense),
    )
    arc, _ = measure_arc(
        polygons,
        boundaries,
        j,
        radius,
        find_place(boundaries, j, first.vertex, first.normal_x, first.normal_y),
        find_place(boundaries, j, last.vertex, last.normal_x, last.normal_y),
        sense,
    )
    return first.length + arc + last.length


@compiled_separately
def find_outer_scale(polygons: Polygons, j: int, x: float, y: float) -> float:
    """Return the size, as a multiple, up to which polygon j does not hold a point that it holds at size 1; 0 for its centre.

    x, y: from the centre [m]. The size is found by bisection.
    """
    low, high = 0.0, 1.0
    for _ in range(MOST_STEPS):
        middle = (low + high) / 2.0
        offset = find_offset(polygons, j, x / middle, y / middle)
        if offset.side > 0.0 and offset.x * offset.x + offset.y * offset.y > 0.0:
            low = middle
        else:
            high = middle
    return low if low > EXACT else 0.0
