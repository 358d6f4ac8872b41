"""Straight runs: the common tangents of two shapes that no other shape blocks.

Between two shapes that do not overlap there is at most one run from node to node.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from foc_ros.core.kernels import Indices, Matrix, Register, Table, Vector, compiled_exactly, compiled_exactly_with_caller
from foc_ros.core.obstacles.boundary import TURN_BACK, Place, find_place, find_segment_square
from foc_ros.core.obstacles.rounded_polygon import TURN

from .overlaps import Shapes
from .sides import count_crossing
from .tangents import GRAZE, Outlines, Tangent, count_starts, find_only_tangent, find_tangent_between


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
