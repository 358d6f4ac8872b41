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

from foc_ros.core.kernels import Flags, FlagTable, Indices, Matrix, Table, Tensor, Vector, compiled_exactly
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
    cluster: list[int]


class Runs(NamedTuple):
    """m straight runs that no circle blocks, from a circle, a goal or the hand to another.

    tail, head (m,): nodes at start and end; start, end, heading (m, 2): positions [m] and unit vectors; length (m,) [m];
    leave_angle, reach_angle (m,): where the run leaves the circle at its start and reaches the one at its end, in [0, 2 pi];
    clear_angle (m,): angle of the arc from the end along the circle to the next overlapping circle [rad]. crossings (m, 2, n):
    of the ray of each circle, on the way from angle 0 of the circle at the start along the run to its end, and on the way from
    angle 0 of the circle at the end to the end of the run.
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
    crossings: Indices


class Arcs(NamedTuple):
    """Pairs of runs between which a path follows an arc, in the order of the first run.

    before, after (t,): the two runs; step (t,): lengths of the arc and of the second run together [m].
    """

    before: Indices
    after: Indices
    step: Vector


class TangentGraph(NamedTuple):
    """Circles, goals (g, 2) [m], runs in the order of the nodes that they leave, and arcs between them.

    first_run (2 n + 1,): the first run from each node; the runs from the last of these on leave the hand. rest (g, m): least
    length of a path from the end of each run to each goal [m], infinite if there is none.
    """

    circles: Circles
    goals: Matrix
    runs: Runs
    arcs: Arcs
    first_run: Indices
    rest: Matrix


def build_tangent_graph(centre: Array, radius: Array, goals: Array) -> TangentGraph:
    """Build the graph of circles (n, 2), (n,) and goals (g, 2) [m], without a hand.

    The last graphs are kept, for scenes in which only the hand moves.
    """
    return _build_from_bytes(centre.tobytes(), radius.tobytes(), goals.tobytes())


def connect_hand(graph: TangentGraph, hand: Array) -> TangentGraph:
    """Return the graph with the runs from a hand (2,) [m] to all circles and goals."""
    circles, n, (g, m) = graph.circles, len(graph.circles.radius), graph.rest.shape
    head = np.append(np.flatnonzero(np.repeat(circles.is_outer, 2)), 2 * (n + np.arange(g)) + 1)
    runs = _find_runs(circles, np.concatenate((graph.goals, hand[None])), np.full(len(head), 2 * (n + g) + 1), head)
    both = Runs._make(np.concatenate(pair) for pair in zip(graph.runs, runs, strict=True))
    arcs = _find_arcs(circles, both, graph.first_run, np.arange(m, len(both.head)))
    rest = np.where(runs.head == 2 * (n + np.arange(g))[:, None] + 1, 0.0, np.inf)
    for goal in range(g):
        np.minimum.at(rest[goal], arcs.before - m, arcs.step + graph.rest[goal, arcs.after])
    arcs = Arcs._make(np.concatenate(pair) for pair in zip(graph.arcs, arcs, strict=True))
    return graph._replace(runs=both, arcs=arcs, rest=np.concatenate((graph.rest, rest), axis=1))


def measure_arcs(leave_angle: Vector, reach_angle: Vector, sense: Indices) -> Vector:
    """Return the angles [rad] of the arcs along circles from where one run reaches them to where the next run leaves them."""
    angle = sense * (leave_angle - reach_angle)
    return np.where(angle < -TURN_BACK, angle + TURN, angle)


@lru_cache(maxsize=8)
def _build_from_bytes(centre: bytes, radius: bytes, goals: bytes) -> TangentGraph:
    circles = _build_circles(np.frombuffer(centre).reshape(-1, 2), np.frombuffer(radius))
    points, n = np.frombuffer(goals).reshape(-1, 2), len(circles.radius)
    runs = _find_runs(circles, points, *_list_pairs(tuple(circles.is_outer.tolist()), len(points)))
    first_run = np.searchsorted(runs.tail, np.arange(2 * n + 1))
    arcs = _find_arcs(circles, runs, first_run, np.arange(len(runs.head)))
    rest = [_measure_rest(arcs, runs.head == 2 * (n + goal) + 1) for goal in range(len(points))]
    return TangentGraph(circles, points, runs, arcs, first_run, np.array(rest).reshape(len(points), len(runs.head)))


def _measure_rest(arcs: Arcs, is_last: Flags) -> Vector:
    """Return the least lengths (m,) [m] of the paths from the ends of the runs to a goal, at which some of the runs end."""
    if not is_last.any():
        return np.full(len(is_last), np.inf)
    backwards = csr_matrix((np.maximum(arcs.step, 0.0), (arcs.after, arcs.before)), 2 * is_last.shape)
    rest: Vector = dijkstra(backwards, indices=np.flatnonzero(is_last), min_only=True)
    return rest


def _find_arcs(circles: Circles, runs: Runs, first_run: Indices, rows: Indices) -> Arcs:
    """Find the arcs from the ends of some of the runs, up to the next overlapping circle."""
    rows = rows[runs.head[rows] < 2 * len(circles.radius)]
    first = first_run[runs.head[rows]]
    count = first_run[runs.head[rows] + 1] - first
    before, after = np.repeat(rows, count), np.arange(count.sum()) + np.repeat(first - np.cumsum(count) + count, count)
    node = runs.head[before]
    angle = measure_arcs(runs.leave_angle[after], runs.reach_angle[before], 2 * (node & 1) - 1)
    is_clear = angle <= runs.clear_angle[before]
    step = circles.radius[node >> 1] * angle + runs.length[after]
    return Arcs(before[is_clear], after[is_clear], step[is_clear])


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
    cluster = [row.index(True) for row in is_linked.tolist()]
    return Circles(centre, radius, is_outer, distance < radius[:, None], bearing, cluster)


@lru_cache(maxsize=8)
def _list_pairs(is_outer: tuple[bool, ...], goals: int) -> tuple[Indices, Indices]:
    """List the nodes at both ends of possible runs between outer circles and from these to goals, in the order of the first."""
    nodes = np.flatnonzero(np.repeat(is_outer, 2))
    ends = np.append(nodes, 2 * (len(is_outer) + np.arange(goals)) + 1)
    tail, head = np.repeat(nodes, len(ends)), np.tile(ends, len(nodes))
    is_pair = tail >> 1 != head >> 1
    return tail[is_pair], head[is_pair]


def _find_runs(circles: Circles, points: Matrix, tail: Indices, head: Indices) -> Runs:
    """Find the runs between pairs of nodes, tails (m,) and heads (m,); points: goals, and the hand if there is one."""
    centre, radius = np.concatenate((circles.centre, points)), np.append(circles.radius, np.zeros(len(points)))
    ends = np.stack((tail >> 1, head >> 1), axis=1)
    x, y = (centre[ends[:, 1]] - centre[ends[:, 0]]).T
    r_tail, r_head = radius[ends[:, 0]] * (2 * (tail & 1) - 1), radius[ends[:, 1]] * (2 * (head & 1) - 1)
    square, w = x * x + y * y, r_head - r_tail
    length = np.sqrt(np.maximum(square - w * w, 0.0))
    square = np.maximum(square, 1e-300)
    u_x, u_y = (length * x + w * y) / square, (length * y - w * x) / square
    heading = np.stack((u_x, u_y), axis=1)
    touch = np.stack((r_tail * u_y, -r_tail * u_x, r_head * u_y, -r_head * u_x), axis=1).reshape(-1, 2, 2)
    bar = np.maximum(circles.radius - GRAZE, 0.0) ** 2
    is_free = find_unblocked(circles.centre, bar, ends, centre[ends[:, 0]] + touch[:, 0], heading, length)
    tail, head, ends = tail[is_free], head[is_free], ends[is_free]
    length, heading, touch = length[is_free], heading[is_free], touch[is_free]
    start, end = (centre[ends] + touch).swapaxes(0, 1)
    leave_angle, reach_angle = np.arctan2(touch[..., 1], touch[..., 0]).T % TURN
    clear_angle = _find_clear_angles(circles, head, reach_angle)
    crossings = count_crossings(centre, circles.radius, circles.holds, ends, touch)
    return Runs(tail, head, start, end, heading, length, leave_angle, reach_angle, clear_angle, crossings)


def _find_clear_angles(circles: Circles, head: Indices, reach_angle: Vector) -> Vector:
    """Return the angles (m,) [rad] of the arcs from the ends of runs to the next overlapping circle, a turn if there is none."""
    clear_angle, to_circle = np.full(len(head), TURN), head < 2 * len(circles.radius)
    node = head[to_circle]
    ahead = (2 * (node & 1) - 1)[:, None] * (circles.overlap_bearing[node >> 1] - reach_angle[to_circle, None]) % TURN
    clear_angle[to_circle] = np.fmin.reduce(ahead, axis=1, initial=TURN)
    return clear_angle


@compiled_exactly
def find_unblocked(centre: Matrix, bar: Vector, ends: Table, start: Matrix, heading: Matrix, length: Vector) -> Flags:
    """Tell which runs exist and come too near to no circle.

    A kernel, as this is the one part that takes n^3 steps: 1 ms for 64 circles, where NumPy takes 70 ms. centre (n, 2), bar (n,):
    centres [m] and squares of the least distances [m^2]; ends (m, 2): the circles that the runs touch.
    """
    is_free = length > 0.0
    for run in range(len(ends)):
        for k in range(len(bar)):
            if not is_free[run]:
                break
            if k not in (ends[run, 0], ends[run, 1]):
                x, y = centre[k, 0] - start[run, 0], centre[k, 1] - start[run, 1]
                along, aside = x * heading[run, 0] + y * heading[run, 1], y * heading[run, 0] - x * heading[run, 1]
                beyond = along - min(max(along, 0.0), length[run])
                is_free[run] = beyond * beyond + aside * aside >= bar[k]
    return is_free


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
def count_crossings(centre: Matrix, radius: Vector, holds: FlagTable, ends: Table, touch: Tensor) -> Table:
    """Count the crossings (m, 2, n) of `Runs`; ends (m, 2): circles that the runs touch, touch (m, 2, 2): where."""
    n, seen = len(radius), np.empty((2, 2))
    crossings = np.zeros((len(ends), 2, n), np.intp)
    for run in range(len(ends)):
        for k in range(n):
            for end in range(2):
                i, x, y = ends[run, end], touch[run, end, 0], touch[run, end, 1]
                if i != k:
                    x, y = centre[i, 0] + x - centre[k, 0], centre[i, 1] + y - centre[k, 1]
                seen[end, 0], seen[end, 1] = x, y
                if i < n:
                    east_x, east_y = centre[i, 0] + radius[i] - centre[k, 0], centre[i, 1] - centre[k, 1]
                    crossings[run, end, k] = count_arc_crossing(east_x, east_y, x, y, holds[i, k])
            crossings[run, 0, k] += count_crossing(seen[0, 0], seen[0, 1], seen[1, 0], seen[1, 1])
    return crossings
