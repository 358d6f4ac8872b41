"""The tangent graph: a shortest path among circles consists of straight runs that touch circles, joined by arcs along them.

Node 2 k + 1 is circle k passed anticlockwise, node 2 k the same circle passed clockwise. Goals and hand are circles of radius 0 behind
the others, passed anticlockwise. A run from circle i to circle j, with D = c_j - c_i and w = s_j r_j - s_i r_i where s is 1
(anticlockwise) or -1, has the length l = sqrt(|D|^2 - w^2), and its heading u is D turned by the angle -atan2(w, l). It leaves
circle i at c_i + s_i r_i n and reaches circle j at c_j + s_j r_j n, where n is u turned by -90 degrees.
"""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from foc_ros.core.kernels import Flags, FlagTable, Indices, Matrix, Table, Tensor, Vector, compiled_exactly
from foc_ros.core.types import Array

from .sides import TURN, count_crossing

GRAZE = 1e-9
"""A run may pass this much nearer to a circle than its radius [m]: circles in a row share tangents, up to rounding."""

TURN_BACK = 1e-9
"""An arc may have this negative angle [rad]: it lies between runs of circles in a row, which share a tangent, up to rounding."""


class Circles(NamedTuple):
    """n circles.

    centre (n, 2) and radius (n,) [m]; is_outer (n,): whether a circle lies in no other one (of equal circles the first is outer);
    holds (n, n): whether a circle holds the centre of another; overlap_bearing (n, n): direction of the outer circles that overlap
    a circle [rad], NaN for other circles; cluster (n,): equal numbers for circles that are linked by overlaps.
    """

    centre: Matrix
    radius: Vector
    is_outer: Flags
    holds: FlagTable
    overlap_bearing: Matrix
    cluster: tuple[int, ...]


class Runs(NamedTuple):
    """m straight runs that no circle blocks.

    head (m,): node at the end; start, end, heading (m, 2): positions [m] and unit vectors; length (m,) [m]; leave_angle,
    reach_angle (m,): where the run leaves the circle at its start and reaches the one at its end, in [0, 2 pi]; clear_angle (m,):
    angle of the arc from the end along the circle to the next overlapping circle. crossings (m, 2, n): crossings of the ray of
    each circle on the way from angle 0 of the circle at the start along the run to its end, and on the way from angle 0 of the
    circle at the end to the end of the run.
    """

    head: Indices
    start: Matrix
    end: Matrix
    heading: Matrix
    length: Vector
    leave_angle: Vector
    reach_angle: Vector
    clear_angle: Vector
    crossings: Tensor


class TangentGraph(NamedTuple):
    """Circles, g goals (g, 2), the runs in the order of the nodes that they leave, and the first run of each of the 2 n nodes.

    The runs from first_run[2 n] on leave the hand.
    """

    circles: Circles
    goals: Matrix
    runs: Runs
    first_run: tuple[int, ...]


def build_tangent_graph(centre: Array, radius: Array, goals: Array) -> TangentGraph:
    """Build the graph of circles (n, 2), (n,) and goals (g, 2) [m]. The last ones are kept, for scenes in which only the hand moves."""
    return _build_from_bytes(centre.tobytes(), radius.tobytes(), goals.tobytes())


def connect_hand(graph: TangentGraph, hand: Array) -> TangentGraph:
    """Return the graph with the runs from a hand (2,) [m] to all circles and goals."""
    n, g = len(graph.circles.radius), len(graph.goals)
    head = np.concatenate((np.flatnonzero(np.repeat(graph.circles.is_outer, 2)), 2 * (n + np.arange(g)) + 1))
    points = np.vstack((graph.goals, hand))
    runs = _measure_runs(graph.circles, points, *_find_free(graph.circles, points, np.full(len(head), 2 * (n + g) + 1), head))
    return graph._replace(runs=Runs(*map(np.concatenate, zip(graph.runs, runs, strict=True))))


def measure_arc(leave_angle: float, reach_angle: float, sense: int) -> float:
    """Return the angle [rad] of the arc along a circle from where one run reaches it to where the next run leaves it."""
    angle = sense * (leave_angle - reach_angle)
    return angle + TURN if angle < -TURN_BACK else angle


@lru_cache(maxsize=8)
def _build_from_bytes(centre: bytes, radius: bytes, goals: bytes) -> TangentGraph:
    circles = _build_circles(np.frombuffer(centre).reshape(-1, 2), np.frombuffer(radius))
    points, n = np.frombuffer(goals).reshape(-1, 2), len(circles.radius)
    tail, head = _find_free(circles, points, *_list_pairs(circles.is_outer, len(points)))
    # the same run backwards touches both circles in the other sense
    is_between = head < 2 * n
    tail, head = np.concatenate((tail, head[is_between] ^ 1)), np.concatenate((head, tail[is_between] ^ 1))
    order = np.argsort(tail, kind='stable')
    first_run = tuple(np.searchsorted(tail[order], np.arange(2 * n + 1)).tolist())
    return TangentGraph(circles, points, _measure_runs(circles, points, tail[order], head[order]), first_run)


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
    cluster = tuple([row.index(True) for row in is_linked.tolist()])
    return Circles(centre, radius, is_outer, distance < radius[:, None], bearing, cluster)


def _list_pairs(is_outer: Flags, goals: int) -> tuple[Indices, Indices]:
    """List the nodes at both ends of possible runs: between outer circles, each pair in one direction, and to goals."""
    outer, senses = np.flatnonzero(is_outer), np.arange(2)
    first, second = np.triu_indices(len(outer), 1)
    tail = np.repeat(2 * outer[first][:, None] + senses, 2, axis=1)
    head = np.tile(2 * outer[second][:, None] + senses, 2)
    to_goal = np.repeat(2 * (len(is_outer) + np.arange(goals))[None] + 1, 2, axis=1)
    from_circle = np.tile(2 * outer[:, None] + senses, goals)
    return (
        np.concatenate((tail.ravel(), from_circle.ravel())),
        np.concatenate((head.ravel(), np.tile(to_goal, (len(outer), 1)).ravel())),
    )


def _touch(circles: Circles, points: Matrix, tail: Indices, head: Indices) -> tuple[Vector, Matrix, Matrix]:
    """Return length (m,) [m] and heading (m, 2) of the runs from node to node, and (m, 2, 2) where they touch the two circles.

    points: goals, and hand if there is one. The length is 0 where there is no run; touching points are relative to the centres.
    """
    centre, radius = np.concatenate((circles.centre, points)), np.append(circles.radius, np.zeros(len(points)))
    x, y = (centre[head >> 1] - centre[tail >> 1]).T
    r_tail, r_head = (radius[node >> 1] * (2 * (node & 1) - 1) for node in (tail, head))
    square, w = x * x + y * y, r_head - r_tail
    length = np.sqrt(np.maximum(square - w * w, 0.0))
    square = np.maximum(square, 1e-300)
    u_x, u_y = (length * x + w * y) / square, (length * y - w * x) / square
    touch = np.stack((r_tail * u_y, -r_tail * u_x, r_head * u_y, -r_head * u_x), axis=1).reshape(-1, 2, 2)
    return length, np.stack((u_x, u_y), axis=1), touch


def _find_free(circles: Circles, points: Matrix, tail: Indices, head: Indices) -> tuple[Indices, Indices]:
    """Return those of the pairs of nodes, tails (m,) and heads (m,), between which there is a run that no circle blocks."""
    length, heading, touch = _touch(circles, points, tail, head)
    centre, ends = np.concatenate((circles.centre, points)), np.stack((tail >> 1, head >> 1), axis=1)
    bar = np.maximum(circles.radius - GRAZE, 0.0) ** 2
    is_free = find_unblocked(circles.centre, bar, ends, centre[ends[:, 0]] + touch[:, 0], heading, length)
    return tail[is_free], head[is_free]


@compiled_exactly
def find_unblocked(centre: Matrix, bar: Vector, ends: Table, start: Matrix, heading: Matrix, length: Vector) -> Flags:
    """Tell which runs exist and come too near to no circle; a kernel, as it is the one part that takes n^3 steps.

    centre (n, 2), bar (n,): centres and squares of the least distances; ends (m, 2): circles that the runs touch.
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
    crossings = np.zeros((len(ends), 2, len(radius)), np.intp)
    for run in range(len(ends)):
        i, j = ends[run]
        for k in range(len(radius)):
            x, y = centre[i, 0] + touch[run, 0, 0], centre[i, 1] + touch[run, 0, 1]
            start_x, start_y = (touch[run, 0, 0], touch[run, 0, 1]) if k == i else (x - centre[k, 0], y - centre[k, 1])
            x, y = centre[j, 0] + touch[run, 1, 0], centre[j, 1] + touch[run, 1, 1]
            end_x, end_y = (touch[run, 1, 0], touch[run, 1, 1]) if k == j else (x - centre[k, 0], y - centre[k, 1])
            crossings[run, 0, k] = count_crossing(start_x, start_y, end_x, end_y)
            if i < len(radius):
                east_x, east_y = centre[i, 0] + radius[i] - centre[k, 0], centre[i, 1] - centre[k, 1]
                crossings[run, 0, k] += count_arc_crossing(east_x, east_y, start_x, start_y, holds[i, k])
            if j < len(radius):
                east_x, east_y = centre[j, 0] + radius[j] - centre[k, 0], centre[j, 1] - centre[k, 1]
                crossings[run, 1, k] = count_arc_crossing(east_x, east_y, end_x, end_y, holds[j, k])
    return crossings


def _measure_runs(circles: Circles, points: Matrix, tail: Indices, head: Indices) -> Runs:
    """Return what is known of the runs between nodes, tails (m,) and heads (m,)."""
    n, centre = len(circles.radius), np.concatenate((circles.centre, points))
    length, heading, touch = _touch(circles, points, tail, head)
    ends = np.stack((tail >> 1, head >> 1), axis=1)
    place = centre[ends] + touch
    leave_angle, reach_angle = np.arctan2(touch[..., 1], touch[..., 0]).T % TURN
    clear_angle = np.full(len(head), TURN)
    if n:
        ahead = (2 * (head & 1) - 1)[:, None] * (circles.overlap_bearing[np.minimum(ends[:, 1], n - 1)] - reach_angle[:, None]) % TURN
        clear_angle[ends[:, 1] < n] = np.fmin.reduce(ahead, axis=1, initial=TURN)[ends[:, 1] < n]
    crossings = count_crossings(centre, circles.radius, circles.holds, ends, touch)
    return Runs(head, place[:, 0], place[:, 1], heading, length, leave_angle, reach_angle, clear_angle, crossings)
