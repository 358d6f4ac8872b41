"""The tangent graph: a shortest path among circles consists of straight runs that touch circles, joined by arcs along them.

Node 2 k + 1 is circle k passed anticlockwise, node 2 k the same circle passed clockwise. Goals and hand follow as circles of
radius 0, passed anticlockwise. A run from circle i to circle j, with D = c_j - c_i and w = s_j r_j - s_i r_i where s is 1
(anticlockwise) or -1, has the length l = sqrt(|D|^2 - w^2), and its heading u is D turned by the angle -atan2(w, l). It leaves
circle i at c_i + s_i r_i n and reaches circle j at c_j + s_j r_j n, where n is u turned by -90 degrees.
"""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import dijkstra

from foc_ros.core.kernels import Flags, FlagTable, Indices, Matrix, Register, Table, Vector, compiled_exactly, freeze
from foc_ros.core.types import Array

from .sides import TURN, count_crossing

GRAZE = 1e-9
"""A run may pass this much nearer to a circle than its radius [m]: circles in a row share tangents, up to rounding."""
TURN_BACK = 1e-9
"""An arc may have this negative angle [rad]: it lies between runs of circles in a row, which share a tangent, up to rounding."""


class Circles(NamedTuple):
    """n circles.

    centre (n, 2) and radius (n,) [m]; is_outer (n,): whether a circle lies in no other one (the first of equal ones is outer);
    holds (n, n): whether a circle holds the centre of another one; overlap_bearing (n, n): direction of the outer circles that
    overlap a circle [rad], NaN for other circles; cluster (n,): equal numbers for circles that are linked by overlaps.
    """

    centre: Matrix
    radius: Vector
    is_outer: Flags
    holds: FlagTable
    overlap_bearing: Matrix
    cluster: Indices


class Runs(NamedTuple):
    """m straight runs that no circle blocks, from a circle, a goal or the hand to another.

    tail, head (m,): nodes at start and end; start, end, heading (m, 2): positions [m] and unit vectors; length (m,) [m];
    leave_angle, reach_angle (m,): where the run leaves the circle at its start and reaches the one at its end, in [0, 2 pi];
    clear_angle (m,): angle of the arc from the end along the circle to the next overlapping circle [rad]. crossings (m, n): of
    the ray of each circle, on the way from angle 0 of the circle at the start along the run to its end; end_crossings (m, n): on
    the way from angle 0 of the circle at the end to the end of the run.
    """

    tail: Indices
    head: Indices
    start: Matrix
    end: Matrix
    heading: Matrix
    length: Vector
    leave_angle: Vector
    reach_angle: Vector
    clear_angle: Vector
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
    """Circles, goals (g, 2) [m], runs in the order of the nodes that they leave, and arcs between them.

    ends (e,): nodes at which runs may end; first_run (2 n + 1,): the first run from each node; the runs from the last of these
    on leave the hand. rest (g, m): least length of a path from the end of each run to each goal [m], infinite if there is none.
    """

    circles: Circles
    goals: Matrix
    ends: Indices
    runs: Runs
    arcs: Arcs
    first_run: Indices
    rest: Matrix


class Tangent(NamedTuple):
    """A straight run between the circles in two rows: where it touches them, from their centres [m], heading, length [m]."""

    tail_row: int
    head_row: int
    tail_x: float
    tail_y: float
    head_x: float
    head_y: float
    heading_x: float
    heading_y: float
    length: float


def build_tangent_graph(centre: Array, radius: Array, goals: Array) -> TangentGraph:
    """Build the graph of circles (n, 2), (n,) and goals (g, 2) [m], without a hand.

    The last graphs are kept, for scenes in which only the hand moves.
    """
    return _build_from_bytes(centre.tobytes(), radius.tobytes(), goals.tobytes())


def connect_hand(graph: TangentGraph, hand: Array) -> TangentGraph:
    """Return the graph with the runs from a hand (2,) [m] to all circles and goals."""
    points, m = np.concatenate((graph.goals, hand[None])), len(graph.runs.head)
    tail = np.full(len(graph.ends), 2 * (len(graph.circles.radius) + len(graph.goals)) + 1)
    found = find_runs(graph.circles, points, tail, graph.ends)
    runs = freeze(Runs._make([np.concatenate(pair) for pair in zip(graph.runs, found, strict=True)]))
    arcs = freeze(find_arcs(graph.circles, runs, graph.first_run, m))
    rest = np.concatenate((graph.rest, measure_rest_from_hand(graph, arcs, found.head)), axis=1)
    first = np.concatenate((graph.arcs.first, arcs.first[1:] + len(graph.arcs.after)))
    arcs = Arcs(first, np.concatenate((graph.arcs.after, arcs.after)), np.concatenate((graph.arcs.step, arcs.step)))
    return freeze(graph._replace(runs=runs, arcs=arcs, rest=rest))


@compiled_exactly
def measure_arc(leave_angle: float, reach_angle: float, sense: int) -> float:
    """Return the angle [rad] of the arc along a circle from where one run reaches it to where the next run leaves it."""
    angle = sense * (leave_angle - reach_angle)
    return angle + TURN if angle < -TURN_BACK else angle


@lru_cache(maxsize=8)
def _build_from_bytes(centre: bytes, radius: bytes, goals: bytes) -> TangentGraph:
    circles = freeze(_build_circles(np.frombuffer(centre).reshape(-1, 2), np.frombuffer(radius)))
    points, n = np.frombuffer(goals).reshape(-1, 2), len(circles.radius)
    nodes = np.flatnonzero(np.repeat(circles.is_outer, 2))
    ends = np.append(nodes, 2 * (n + np.arange(len(points))) + 1)
    runs = freeze(find_runs(circles, points, *_list_pairs(nodes, ends)))
    first_run = np.searchsorted(runs.tail, np.arange(2 * n + 1))
    arcs = find_arcs(circles, runs, first_run, 0)
    rest = [_measure_rest(arcs, runs.head == 2 * (n + goal) + 1) for goal in range(len(points))]
    return freeze(TangentGraph(circles, points, ends, runs, arcs, first_run, np.array(rest).reshape(len(points), len(runs.head))))


def _list_pairs(nodes: Indices, ends: Indices) -> tuple[Indices, Indices]:
    """List the nodes at both ends of possible runs from nodes (k,) to ends (e,), in the order of the first."""
    tail, head = np.repeat(nodes, len(ends)), np.tile(ends, len(nodes))
    is_pair = tail >> 1 != head >> 1
    return tail[is_pair], head[is_pair]


def _measure_rest(arcs: Arcs, is_last: Flags) -> Vector:
    """Return the least lengths (m,) [m] of the paths from the ends of the runs to a goal, at which some of the runs end."""
    if not is_last.any():
        return np.full(len(is_last), np.inf)
    backwards = csr_matrix((np.maximum(arcs.step, 0.0), arcs.after, arcs.first), 2 * is_last.shape).T
    rest: Vector = dijkstra(backwards, indices=np.flatnonzero(is_last), min_only=True)
    return rest


def _build_circles(centre: Matrix, radius: Vector) -> Circles:
    """Find out how circles (n, 2), (n,) [m] hold and overlap each other."""
    n = len(radius)
    x, y = (centre - centre[:, None]).transpose(2, 0, 1)
    distance, is_other = np.hypot(x, y), ~np.eye(n, dtype=bool)
    is_linked = distance < radius[:, None] + radius
    is_within = (distance + radius[:, None] <= radius) & is_other
    # of circles that lie within each other, so equal ones, the first is outer
    is_outer = ~(is_within & ~(is_within.T & np.triu(is_other))).any(axis=1)
    bearing = np.where(is_linked & is_outer & is_other, np.arctan2(y, x), np.nan)
    for _ in range(n.bit_length()):
        is_linked = (is_linked.astype(float) @ is_linked) > 0.0
    cluster = np.array([row.index(True) for row in is_linked.tolist()], dtype=np.intp)
    return Circles(centre, radius, is_outer, distance < radius[:, None], bearing, cluster)


@compiled_exactly
def find_tangent(centre: Matrix, radius: Vector, tail: int, head: int) -> Tangent:
    """Find the straight line from a node to another; its length is 0 if there is none."""
    i, j = tail >> 1, head >> 1
    x, y = centre[j, 0] - centre[i, 0], centre[j, 1] - centre[i, 1]
    r_tail, r_head = radius[i] * (2 * (tail & 1) - 1), radius[j] * (2 * (head & 1) - 1)
    square, w = x * x + y * y, r_head - r_tail
    length = np.sqrt(max(square - w * w, 0.0))
    square = max(square, 1e-300)
    u_x, u_y = (length * x + w * y) / square, (length * y - w * x) / square
    return Tangent(i, j, r_tail * u_y, -r_tail * u_x, r_head * u_y, -r_head * u_x, u_x, u_y, length)


@compiled_exactly
def is_blocked(circles: Circles, centre: Matrix, run: Tangent) -> bool:
    """Tell whether a run comes too near to another circle than it touches; centre: of circles, goals and hand [m]."""
    start_x, start_y = centre[run.tail_row, 0] + run.tail_x, centre[run.tail_row, 1] + run.tail_y
    for k in range(len(circles.radius)):
        if k not in (run.tail_row, run.head_row):
            x, y = centre[k, 0] - start_x, centre[k, 1] - start_y
            along, aside = x * run.heading_x + y * run.heading_y, y * run.heading_x - x * run.heading_y
            beyond, bar = along - min(max(along, 0.0), run.length), max(circles.radius[k] - GRAZE, 0.0)
            if beyond * beyond + aside * aside < bar * bar:
                return True
    return False


@compiled_exactly
def find_clear_angle(circles: Circles, node: int, reach_angle: float) -> float:
    """Return the angle [rad] of the arc from the end of a run to the next overlapping circle, a turn if there is none."""
    clear_angle = TURN
    if node < 2 * len(circles.radius):
        for bearing in circles.overlap_bearing[node >> 1]:
            if not np.isnan(bearing):
                clear_angle = min(clear_angle, (2 * (node & 1) - 1) * (bearing - reach_angle) % TURN)
    return clear_angle


@compiled_exactly
def count_arc_crossing(east_x: float, east_y: float, x: float, y: float, is_held: bool) -> int:
    """Count the crossings of a ray on the way along a circle, anticlockwise from its easternmost point to another point.

    Both points are relative to the centre of the ray. If the circle holds that centre, the arc sweeps between 0 and a whole
    turn about it; else the arc counts as its chord.
    """
    if not is_held:
        return count_crossing(east_x, east_y, x, y)
    if (east_y >= 0.0) == (y >= 0.0):
        return 1 if east_x * y - east_y * x < 0.0 else 0
    return 1 if east_y >= 0.0 else 0


@compiled_exactly
def count_crossings(circles: Circles, centre: Matrix, run: Tangent, crossings: Register, end_crossings: Register) -> None:
    """Count the crossings (n,) and end crossings (n,) of `Runs`; centre: of the circles, the goals and the hand [m]."""
    i, j, n = run.tail_row, run.head_row, len(circles.radius)
    for k in range(n):
        tail_x, tail_y, head_x, head_y = run.tail_x, run.tail_y, run.head_x, run.head_y
        if i != k:
            tail_x, tail_y = centre[i, 0] + tail_x - centre[k, 0], centre[i, 1] + tail_y - centre[k, 1]
        if j != k:
            head_x, head_y = centre[j, 0] + head_x - centre[k, 0], centre[j, 1] + head_y - centre[k, 1]
        crossings[k], end_crossings[k] = count_crossing(tail_x, tail_y, head_x, head_y), 0
        if i < n:
            east_x, east_y = centre[i, 0] + circles.radius[i] - centre[k, 0], centre[i, 1] - centre[k, 1]
            crossings[k] += count_arc_crossing(east_x, east_y, tail_x, tail_y, circles.holds[i, k])
        if j < n:
            east_x, east_y = centre[j, 0] + circles.radius[j] - centre[k, 0], centre[j, 1] - centre[k, 1]
            end_crossings[k] = count_arc_crossing(east_x, east_y, head_x, head_y, circles.holds[j, k])


@compiled_exactly
def find_runs(circles: Circles, points: Matrix, tail: Indices, head: Indices) -> Runs:
    """Find the runs between pairs of nodes, tails (m,) and heads (m,); points: goals, and the hand if there is one.

    A kernel, as each of the pairs is compared with each of the circles: 1 ms for 64 circles, where NumPy takes 70 ms.
    """
    n, m = len(circles.radius), len(tail)
    centre, radius = np.concatenate((circles.centre, points)), np.append(circles.radius, np.zeros(len(points)))
    tails, heads, crossings, end_crossings = (
        np.empty(m, np.intp),
        np.empty(m, np.intp),
        np.empty((m, n), np.intp),
        np.empty((m, n), np.intp),
    )
    start, end, heading, length = np.empty((m, 2)), np.empty((m, 2)), np.empty((m, 2)), np.empty(m)
    leave_angle, reach_angle, clear_angle = np.empty(m), np.empty(m), np.empty(m)
    count = 0
    for pair in range(m):
        run = find_tangent(centre, radius, tail[pair], head[pair])
        if run.length <= 0.0 or is_blocked(circles, centre, run):
            continue
        tails[count], heads[count], length[count] = tail[pair], head[pair], run.length
        i, j = tail[pair] >> 1, head[pair] >> 1
        start[count, 0], start[count, 1] = centre[i, 0] + run.tail_x, centre[i, 1] + run.tail_y
        end[count, 0], end[count, 1] = centre[j, 0] + run.head_x, centre[j, 1] + run.head_y
        heading[count, 0], heading[count, 1] = run.heading_x, run.heading_y
        leave_angle[count] = np.arctan2(run.tail_y, run.tail_x) % TURN
        reach_angle[count] = np.arctan2(run.head_y, run.head_x) % TURN
        clear_angle[count] = find_clear_angle(circles, head[pair], reach_angle[count])
        count_crossings(circles, centre, run, crossings[count], end_crossings[count])
        count += 1
    return Runs(
        tails[:count],
        heads[:count],
        start[:count],
        end[:count],
        heading[:count],
        length[:count],
        leave_angle[:count],
        reach_angle[:count],
        clear_angle[:count],
        crossings[:count],
        end_crossings[:count],
    )


@compiled_exactly
def find_arcs(circles: Circles, runs: Runs, first_run: Indices, begin: int) -> Arcs:
    """Find the arcs from the ends of the runs from a row on, up to the next overlapping circle."""
    rows = len(runs.head) - begin
    first, most = np.zeros(rows + 1, np.intp), 0
    for before in range(begin, len(runs.head)):
        node = runs.head[before]
        if node < 2 * len(circles.radius):
            most += first_run[node + 1] - first_run[node]
    after, step, count = np.empty(most, np.intp), np.empty(most), 0
    for row in range(rows):
        before, node = begin + row, runs.head[begin + row]
        if node < 2 * len(circles.radius):
            for following in range(first_run[node], first_run[node + 1]):
                angle = measure_arc(runs.leave_angle[following], runs.reach_angle[before], 2 * (node & 1) - 1)
                if angle <= runs.clear_angle[before]:
                    after[count], step[count] = following, circles.radius[node >> 1] * angle + runs.length[following]
                    count += 1
        first[row + 1] = count
    return Arcs(first, after[:count], step[:count])


@compiled_exactly
def measure_rest_from_hand(graph: TangentGraph, arcs: Arcs, head: Indices) -> Matrix:
    """Return the least lengths (g, h) [m] of the paths from the ends of the runs that leave the hand to the goals.

    graph: without the hand; arcs: from the ends of the h runs; head (h,): nodes at these ends.
    """
    rest = np.full((len(graph.goals), len(head)), np.inf)
    for goal in range(len(graph.goals)):
        for row in range(len(head)):
            if head[row] == 2 * (len(graph.circles.radius) + goal) + 1:
                rest[goal, row] = 0.0
            for arc in range(arcs.first[row], arcs.first[row + 1]):
                rest[goal, row] = min(rest[goal, row], arcs.step[arc] + graph.rest[goal, arcs.after[arc]])
    return rest
