"""The tangent graph: a shortest path among shapes consists of straight runs that touch shapes, joined by arcs along them.

The shapes are rounded convex polygons. Node 2 k + 1 is shape k passed anticlockwise, node 2 k the same shape passed clockwise.
Goals and hand follow as circles of radius 0, passed anticlockwise. A run from shape i to shape j touches the circles about a
vertex of each, p_i and p_j. With D = p_j - p_i and w = s_j r_j - s_i r_i where s is 1 (anticlockwise) or -1, it has the length
l = sqrt(|D|^2 - w^2), and its heading u is D turned by the angle -atan2(w, l). It leaves shape i at p_i + s_i r_i n and reaches
shape j at p_j + s_j r_j n, where n is u turned by -90 degrees. No other vertex of the shapes lies farther in the directions s n.

Between two shapes that do not overlap there is one such run from node to node. Of two that overlap, each part of one that stands
out of the other begins and ends with a run, and the boundary is cut where the other shape covers it.
"""

from __future__ import annotations

from functools import lru_cache
from heapq import heappop, heappush
from typing import NamedTuple

import numpy as np

from foc_ros.core.kernels import (
    Flags,
    FlagTable,
    Indices,
    Matrix,
    Register,
    Table,
    Vector,
    compiled_exactly,
    compiled_exactly_with_caller,
    freeze,
)
from foc_ros.core.obstacles.boundary import (
    TURN_BACK,
    Boundaries,
    Place,
    find_approach,
    find_exit,
    find_place,
    find_segment_square,
    measure_arc,
    tabulate_boundaries,
)
from foc_ros.core.obstacles.rounded_polygon import TURN, Polygons, find_offset, find_support
from foc_ros.core.types import Array, as_readonly

from .sides import count_crossing

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


class Runs(NamedTuple):
    """m straight runs that no shape blocks, from a shape, a goal or the hand to another.

    tail, head (m,): nodes at start and end; start, end, heading (m, 2): positions [m] and unit vectors; length (m,) [m];
    leave_vertex, leave_angle, reach_vertex, reach_angle (m,): the places where the run leaves the shape at its start and reaches
    the one at its end; clear_length (m,): length of the arc from the end along the shape to where the next one covers it [m].
    crossings (m, n): of the ray of each shape, on the way from the beginning of the boundary of the shape at the start along the
    run to its end; end_crossings (m, n): on the way from the beginning of the boundary of the shape at the end to the end of
    the run.
    """

    tail: Indices
    head: Indices
    start: Matrix
    end: Matrix
    heading: Matrix
    length: Vector
    leave_vertex: Indices
    leave_angle: Vector
    reach_vertex: Indices
    reach_angle: Vector
    clear_length: Vector
    crossings: Table
    end_crossings: Table


class Arcs(NamedTuple):
    """Pairs of runs between which a path follows an arc, in the order of the first run.

    first (m + 1,): the first pair of each of the first runs; after (t,): the second runs; step (t,): lengths of the arc and of
    the second run together [m].
    """

    first: Indices
    after: Indices
    step: Vector


class TangentGraph(NamedTuple):
    """Outlines of shapes, g goals and the hand, runs in the order of the nodes that they leave, and arcs between them.

    ends (e,): nodes at which runs may end; first_run (2 n + 1,): the first run from each node; the runs from the last of these
    on leave the hand. rest (g, m): least length of a path from the end of each run to each goal [m], infinite if there is none.
    """

    outlines: Outlines
    shapes: Shapes
    ends: Indices
    runs: Runs
    arcs: Arcs
    first_run: Indices
    rest: Matrix


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


def build_tangent_graph(centre: Array, radius: Array, goals: Array, polygons: Polygons | None = None) -> TangentGraph:
    """Build the graph of shapes (n, 2), (n,) and goals (g, 2) [m], without a hand; polygons: circles if not given.

    The last graphs are kept, for scenes in which only the hand moves.
    """
    vertices, corners = polygons or _make_points(len(radius))
    return _build_from_bytes(centre.tobytes(), radius.tobytes(), goals.tobytes(), vertices.tobytes(), corners.tobytes())


def connect_hand(graph: TangentGraph, hand: Array) -> TangentGraph:
    """Return the graph with the runs from a hand (2,) [m] to all shapes and goals."""
    centre, m = graph.outlines.centre.copy(), len(graph.runs.head)
    centre[-1] = hand
    outlines = graph.outlines._replace(centre=as_readonly(centre))
    tail = np.full(len(graph.ends), 2 * len(centre) - 1)
    found = find_runs(outlines, graph.shapes, tail, graph.ends)
    runs = freeze(Runs._make([np.concatenate(pair) for pair in zip(graph.runs, found, strict=True)]))
    arcs = freeze(find_arcs(outlines, runs, graph.first_run, m))
    rest = np.concatenate((graph.rest, measure_rest_from_hand(graph, arcs, found.head)), axis=1)
    first = np.concatenate((graph.arcs.first, arcs.first[1:] + len(graph.arcs.after)))
    arcs = freeze(Arcs(first, np.concatenate((graph.arcs.after, arcs.after)), np.concatenate((graph.arcs.step, arcs.step))))
    return graph._replace(outlines=outlines, runs=runs, arcs=arcs, rest=as_readonly(rest))


@lru_cache(maxsize=8)
def _build_from_bytes(centre: bytes, radius: bytes, goals: bytes, vertices: bytes, corners: bytes) -> TangentGraph:
    n, points = len(radius) // 8, len(goals) // 16
    polygons = Polygons(np.frombuffer(vertices).reshape(n, -1 if n else 1, 2), np.frombuffer(corners, dtype=np.intp))
    outlines = _make_outlines(np.frombuffer(centre + goals).reshape(-1, 2), np.frombuffer(radius), polygons)
    shapes = freeze(build_shapes(outlines, n))
    nodes = np.flatnonzero(np.repeat(shapes.is_outer, 2))
    ends = np.append(nodes, 2 * (n + np.arange(points)) + 1)
    runs = freeze(find_runs(outlines, shapes, *_list_pairs(nodes, ends)))
    first_run = np.searchsorted(runs.tail, np.arange(2 * n + 1))
    arcs = find_arcs(outlines, runs, first_run, 0)
    rest = measure_rest(freeze(arcs), runs.head, 2 * (n + np.arange(points)) + 1)
    return freeze(TangentGraph(outlines, shapes, ends, runs, arcs, first_run, rest))


def _make_points(count: int, most: int = 1) -> Polygons:
    return Polygons(np.zeros((count, most, 2)), np.ones(count, dtype=np.intp))


def _make_outlines(centre: Array, radius: Array, polygons: Polygons) -> Outlines:
    """Return the outlines of shapes and goals, and of a hand that has no place yet."""
    rows = len(centre) + 1 - len(radius)
    points = _make_points(rows, polygons.vertices.shape[1])
    together = freeze(Polygons._make([np.concatenate(pair) for pair in zip(polygons, points, strict=True)]))
    centres, radii = np.concatenate((centre, np.zeros((1, 2)))), np.concatenate((radius, np.zeros(rows)))
    return freeze(Outlines(centres, radii, together, tabulate_boundaries(together)))


def _list_pairs(nodes: Indices, ends: Indices) -> tuple[Indices, Indices]:
    """List the nodes at both ends of possible runs from nodes (k,) to ends (e,), in the order of the first."""
    tail, head = np.repeat(nodes, len(ends)), np.tile(ends, len(nodes))
    is_pair = tail >> 1 != head >> 1
    return tail[is_pair], head[is_pair]


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
        first_cut[each + 1 :] += 1
    return place[np.argsort(row[:count], kind='mergesort')], first_cut


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
                cluster = np.where(cluster == high, low, cluster)
    for i in range(n):
        for k in range(n):
            overlaps[i, k] &= i != k and is_outer[i] and is_outer[k]
    cut, first_cut = find_cuts(outlines, overlaps)
    return Shapes(extent, beginning, is_outer, holds, overlaps, cluster, cut, first_cut)


@compiled_exactly_with_caller
def is_blocked(outlines: Outlines, shapes: Shapes, run: Tangent) -> bool:
    """Tell whether a run comes too near to another shape than it touches."""
    start_x, start_y = outlines.centre[run.tail_row, 0] + run.tail_x, outlines.centre[run.tail_row, 1] + run.tail_y
    for k in range(len(shapes.extent)):
        if k not in (run.tail_row, run.head_row):
            x, y = outlines.centre[k, 0] - start_x, outlines.centre[k, 1] - start_y
            along, aside = x * run.heading_x + y * run.heading_y, y * run.heading_x - x * run.heading_y
            beyond, bar = along - min(max(along, 0.0), run.length), max(shapes.extent[k] - GRAZE, 0.0)
            if beyond * beyond + aside * aside < bar * bar:
                bar = max(outlines.radius[k] - GRAZE, 0.0)
                if find_segment_square(outlines.polygons, k, -x, -y, run.heading_x, run.heading_y, run.length) < bar * bar:
                    return True
    return False


@compiled_exactly_with_caller
def find_clear_length(outlines: Outlines, shapes: Shapes, node: int, place: Place) -> float:
    """Return the length [m] of the arc from the end of a run to where the next shape covers it, infinite if there is none."""
    row, sense, clear_length = node >> 1, 2 * (node & 1) - 1, np.inf
    edge, radius = outlines.boundaries.edge[row], outlines.radius[row]
    at, whole = radius * place.angle + edge[place.vertex], radius * TURN + edge[outlines.polygons.corners[row]]
    for cut in shapes.cut[shapes.first_cut[row] : shapes.first_cut[row + 1]]:
        clear_length = min(clear_length, sense * (cut - at) % whole)
    return clear_length


@compiled_exactly_with_caller
def count_arc_crossing(east_x: float, east_y: float, x: float, y: float, is_held: bool) -> int:
    """Count the crossings of a ray on the way along a shape, anticlockwise from the beginning of its boundary to another point.

    Both points are relative to the centre of the ray. If the shape holds that centre, the arc sweeps between 0 and a whole turn
    about it; else the arc counts as its chord.
    """
    if not is_held:
        return count_crossing(east_x, east_y, x, y)
    if (east_y >= 0.0) == (y >= 0.0):
        return 1 if east_x * y - east_y * x < 0.0 else 0
    return 1 if east_y >= 0.0 else 0


@compiled_exactly_with_caller
def count_crossings(
    shapes: Shapes, centre: Matrix, run: Tangent, leave: Place, reach: Place, crossings: Register, end_crossings: Register
) -> None:
    """Count the crossings (n,) and end crossings (n,) of `Runs`; centre: of the shapes, the goals and the hand [m]."""
    i, j, n, first = run.tail_row, run.head_row, len(shapes.extent), shapes.beginning
    # an arc without a length counts as its chord, which rounding does not turn into a whole turn
    is_left_late, is_reached_late = leave.angle > TURN_BACK or leave.vertex > 0, reach.angle > TURN_BACK or reach.vertex > 0
    for k in range(n):
        tail_x, tail_y, head_x, head_y = run.tail_x, run.tail_y, run.head_x, run.head_y
        if i != k:
            tail_x, tail_y = centre[i, 0] + tail_x - centre[k, 0], centre[i, 1] + tail_y - centre[k, 1]
        if j != k:
            head_x, head_y = centre[j, 0] + head_x - centre[k, 0], centre[j, 1] + head_y - centre[k, 1]
        crossings[k], end_crossings[k] = count_crossing(tail_x, tail_y, head_x, head_y), 0
        if i < n:
            from_x, from_y = centre[i, 0] + first[i, 0] - centre[k, 0], centre[i, 1] + first[i, 1] - centre[k, 1]
            crossings[k] += count_arc_crossing(from_x, from_y, tail_x, tail_y, shapes.holds[i, k] and is_left_late)
        if j < n:
            from_x, from_y = centre[j, 0] + first[j, 0] - centre[k, 0], centre[j, 1] + first[j, 1] - centre[k, 1]
            end_crossings[k] = count_arc_crossing(from_x, from_y, head_x, head_y, shapes.holds[j, k] and is_reached_late)


@compiled_exactly
def find_runs(outlines: Outlines, shapes: Shapes, tail: Indices, head: Indices) -> Runs:
    """Find the runs between pairs of nodes, tails (m,) and heads (m,).

    A kernel, as each of the pairs is compared with each of the shapes: 1 ms for 64 circles, where NumPy takes 70 ms.
    """
    n, m, starts = len(shapes.extent), 0, np.zeros(len(tail), np.intp)
    for pair in range(len(tail)):
        i, j = tail[pair] >> 1, head[pair] >> 1
        if i < n and j < n and shapes.overlaps[i, j]:
            starts[pair] = count_starts(outlines, tail[pair], head[pair]) if (tail[pair] ^ head[pair]) & 1 == 0 else -1
        m += max(starts[pair], 1)
    tails, heads, crossings, end_crossings = (
        np.empty(m, np.intp),
        np.empty(m, np.intp),
        np.empty((m, n), np.intp),
        np.empty((m, n), np.intp),
    )
    start, end, heading, length = np.empty((m, 2)), np.empty((m, 2)), np.empty((m, 2)), np.empty(m)
    leave_vertex, leave_angle, reach_vertex, reach_angle = np.empty(m, np.intp), np.empty(m), np.empty(m, np.intp), np.empty(m)
    clear_length, count = np.full(m, np.inf), 0
    for pair in range(len(tail)):
        first = count
        for attempt in range(abs(starts[pair]) if starts[pair] else 1):
            if starts[pair] < 0:  # tangents that change sides part the two shapes
                continue
            if starts[pair]:
                run = find_tangent_between(outlines, tail[pair], head[pair], attempt)
            else:
                run = find_only_tangent(outlines, tail[pair], head[pair])
            is_repeated = False
            for other in range(first, count):
                is_repeated |= leave_vertex[other] == run.tail_vertex and reach_vertex[other] == run.head_vertex
            if run.length <= 0.0 or is_repeated or is_blocked(outlines, shapes, run):
                continue
            tails[count], heads[count], length[count] = tail[pair], head[pair], run.length
            i, j = run.tail_row, run.head_row
            start[count, 0], start[count, 1] = outlines.centre[i, 0] + run.tail_x, outlines.centre[i, 1] + run.tail_y
            end[count, 0], end[count, 1] = outlines.centre[j, 0] + run.head_x, outlines.centre[j, 1] + run.head_y
            heading[count, 0], heading[count, 1] = run.heading_x, run.heading_y
            tail_sense, head_sense = 2 * (tail[pair] & 1) - 1, 2 * (head[pair] & 1) - 1
            normal_x, normal_y = run.heading_y, -run.heading_x
            leave = find_place(outlines.boundaries, i, run.tail_vertex, tail_sense * normal_x, tail_sense * normal_y)
            reach = find_place(outlines.boundaries, j, run.head_vertex, head_sense * normal_x, head_sense * normal_y)
            leave_vertex[count], leave_angle[count] = leave.vertex, leave.angle
            reach_vertex[count], reach_angle[count] = reach.vertex, reach.angle
            if j < n:
                clear_length[count] = find_clear_length(outlines, shapes, head[pair], reach)
            count_crossings(shapes, outlines.centre, run, leave, reach, crossings[count], end_crossings[count])
            count += 1
    return Runs(
        tails[:count],
        heads[:count],
        start[:count],
        end[:count],
        heading[:count],
        length[:count],
        leave_vertex[:count],
        leave_angle[:count],
        reach_vertex[:count],
        reach_angle[:count],
        clear_length[:count],
        crossings[:count],
        end_crossings[:count],
    )


@compiled_exactly_with_caller
def measure_arc_between(outlines: Outlines, runs: Runs, before: int, after: int) -> tuple[float, bool]:
    """Return the length [m] of the arc from a run to the next, and whether it passes the beginning of the boundary."""
    node = runs.head[before]
    row = node >> 1
    reach = Place(runs.reach_vertex[before], runs.reach_angle[before])
    leave = Place(runs.leave_vertex[after], runs.leave_angle[after])
    return measure_arc(outlines.polygons, outlines.boundaries, row, outlines.radius[row], reach, leave, 2 * (node & 1) - 1)


@compiled_exactly
def find_arcs(outlines: Outlines, runs: Runs, first_run: Indices, begin: int) -> Arcs:
    """Find the arcs from the ends of the runs from a row on, up to where the next shape covers the boundary."""
    rows = len(runs.head) - begin
    first, most = np.zeros(rows + 1, np.intp), 0
    for before in range(begin, len(runs.head)):
        node = runs.head[before]
        if node < len(first_run) - 1:
            most += first_run[node + 1] - first_run[node]
    after, step, count = np.empty(most, np.intp), np.empty(most), 0
    for row in range(rows):
        before, node = begin + row, runs.head[begin + row]
        if node < len(first_run) - 1:
            for following in range(first_run[node], first_run[node + 1]):
                length, _ = measure_arc_between(outlines, runs, before, following)
                if length <= runs.clear_length[before]:
                    after[count], step[count] = following, length + runs.length[following]
                    count += 1
        first[row + 1] = count
    return Arcs(first, after[:count], step[:count])


@compiled_exactly
def measure_rest(arcs: Arcs, head: Indices, goals: Indices) -> Matrix:
    """Return the least lengths (g, m) [m] of the paths from the ends of the runs to the nodes of goals: Dijkstra's algorithm.

    head (m,): nodes at the ends of the runs. A kernel, as this takes 10 us and SciPy 170 us.
    """
    m, rest = len(head), np.full((len(goals), len(head)), np.inf)
    # the runs before each run
    first, before, step = np.zeros(m + 2, np.intp), np.empty(len(arcs.after), np.intp), np.empty(len(arcs.after))
    for after in arcs.after:
        first[after + 2] += 1
    first = np.cumsum(first)
    for run in range(m):
        for arc in range(arcs.first[run], arcs.first[run + 1]):
            row = first[arcs.after[arc] + 1]
            before[row], step[row] = run, max(arcs.step[arc], 0.0)
            first[arcs.after[arc] + 1] += 1
    for goal in range(len(goals)):
        frontier = [(0.0, 0) for _ in range(0)]
        for run in range(m):
            if head[run] == goals[goal]:
                rest[goal, run] = 0.0
                heappush(frontier, (0.0, run))
        while frontier:
            length, run = heappop(frontier)
            if length > rest[goal, run]:
                continue
            for row in range(first[run], first[run + 1]):
                longer = length + step[row]
                if longer < rest[goal, before[row]]:
                    rest[goal, before[row]] = longer
                    heappush(frontier, (longer, before[row]))
    return rest


@compiled_exactly
def measure_rest_from_hand(graph: TangentGraph, arcs: Arcs, head: Indices) -> Matrix:
    """Return the least lengths (g, h) [m] of the paths from the ends of the runs that leave the hand to the goals.

    graph: without the hand; arcs: from the ends of the h runs; head (h,): nodes at these ends.
    """
    rest = np.full((len(graph.rest), len(head)), np.inf)
    for goal in range(len(graph.rest)):
        for row in range(len(head)):
            if head[row] == 2 * (len(graph.shapes.extent) + goal) + 1:
                rest[goal, row] = 0.0
            for arc in range(arcs.first[row], arcs.first[row + 1]):
                rest[goal, row] = min(rest[goal, row], arcs.step[arc] + graph.rest[goal, arcs.after[arc]])
    return rest
