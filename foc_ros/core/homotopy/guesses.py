"""Initial guesses: a taut path, laid out as straight runs and arcs, and the positions of a hand that moves along it in time."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from foc_ros.core.kernels import Indices, Matrix, Vector, compiled_exactly, freeze
from foc_ros.core.obstacles.rounded_polygon import TURN, Polygons, find_offsets
from foc_ros.core.types import Array, as_readonly

from .arcs import measure_arc_between
from .runs import Runs
from .search_scene import SearchScene
from .tangent_graph import TangentGraph
from .tangents import Outlines

SLOPE = 0.5
"""A hand in a margin leaves it by this much for each metre of its path, and enters the margin of its goal likewise."""
MAX_SPEED_RATIO = 2.5
"""Largest ratio of v T to L for which the timing does not overshoot."""


@compiled_exactly
def evaluate_path(begin: Vector, start: Matrix, heading: Matrix, bend: Vector, along: Vector) -> Matrix:
    """Return the points (m, 2) of a `TautPath` at lengths `along` (m,); a kernel, as NumPy takes 25 us and this takes 3 us."""
    points = np.empty((len(along), 2))
    for i in range(len(along)):
        piece = max(np.searchsorted(begin, along[i], side='right') - 1, 0)
        step, curvature = along[i] - begin[piece], bend[piece]
        ahead, aside = step, 0.0
        if curvature != 0.0:
            ahead, aside = np.sin(curvature * step) / curvature, (1.0 - np.cos(curvature * step)) / curvature
        points[i, 0] = start[piece, 0] + ahead * heading[piece, 0] - aside * heading[piece, 1]
        points[i, 1] = start[piece, 1] + ahead * heading[piece, 1] + aside * heading[piece, 0]
    return points


@compiled_exactly
def compute_progress(length: float, speed: float, duration_s: float, steps: int) -> Vector:
    """Compute the path length at steps 0..N (N + 1,) [m]: minimum jerk from a speed along the path to rest at its end.

    s = L (10 t^3 - 15 t^4 + 6 t^5) + v T (t - 6 t^3 + 8 t^4 - 3 t^5) with t in [0, 1]. The path would overshoot with v T > 2.5 L
    and begin backwards with v < 0, so v is kept between these bounds. length [m], speed [m/s], duration_s [s].
    """
    carried, along = min(max(speed * duration_s, 0.0), MAX_SPEED_RATIO * length), np.empty(steps + 1)
    for step in range(steps + 1):
        t = step / steps
        rest = t**3 * (10.0 + t * (6.0 * t - 15.0))
        along[step] = length * rest + carried * t * (1.0 + t**2 * (t * (8.0 - 3.0 * t) - 6.0))
        along[step] = min(max(along[step], 0.0), length)
    return along


class TautPath(NamedTuple):
    """A path of p pieces, a run, an arc, a run, ..., and its end.

    begin (p,): length of the path before each piece [m]; start, heading (p, 2): point [m] and direction where the piece begins;
    bend (p,): curvature [1/m], anticlockwise positive.
    """

    begin: Vector
    start: Matrix
    heading: Matrix
    bend: Vector

    @property
    def length(self) -> float:
        """Length [m]."""
        return float(self.begin[-1])

    def evaluate(self, along: Array) -> Array:
        """Return the points (m, 2) at lengths `along` (m,) from the beginning [m]."""
        return evaluate_path(self.begin, self.start, self.heading, self.bend, along)

    def space_points(self, count: int) -> Array:
        """Return points (count, 2) at equal distances from the beginning to the end."""
        return self.evaluate(self.length * np.linspace(0.0, 1.0, count))


@compiled_exactly
def lay_out_runs(outlines: Outlines, runs: Runs, path: Indices) -> TautPath:
    """Lay out a path that is given by its runs (p,): an arc along a shape has a piece about each vertex and along each edge."""
    boundaries = outlines.boundaries
    most, piece, length = len(path) * (2 * outlines.polygons.vertices.shape[1] + 4), 0, 0.0
    begin, start, heading, bend = np.empty(most), np.empty((most, 2)), np.empty((most, 2)), np.zeros(most)
    for place, run in enumerate(path):
        length += runs.length[run]
        begin[piece], start[piece], heading[piece] = length - runs.length[run], runs.start[run], runs.heading[run]
        piece, size = piece + 1, 0.0
        start[piece], heading[piece] = runs.end[run], runs.heading[run]
        if place + 1 < len(path):
            row, sense, following = runs.head[run] >> 1, 2 * (runs.head[run] & 1) - 1, path[place + 1]
            corners, radius, vertex, angle = (
                outlines.polygons.corners[row],
                outlines.radius[row],
                runs.reach_vertex[run],
                runs.reach_angle[run],
            )
            _, is_past_beginning = measure_arc_between(outlines, runs, run, following)
            while corners > 1 and (vertex != runs.leave_vertex[following] or is_past_beginning):
                after = (vertex + sense) % corners
                # an edge has the number of the vertex at its end, anticlockwise
                edge, ahead = (after, 1) if sense > 0 else (vertex, 0)
                normal_x, normal_y = boundaries.normal[row, edge, 0], boundaries.normal[row, edge, 1]
                size = radius * max(sense * (boundaries.angle[row, vertex + ahead] - angle), 0.0)
                length += size
                begin[piece], bend[piece] = length - size, sense / radius
                x, y = outlines.centre[row, 0] + radius * normal_x, outlines.centre[row, 1] + radius * normal_y
                from_edge = vertex if sense > 0 else after
                size = boundaries.edge[row, from_edge + 1] - boundaries.edge[row, from_edge]
                length += size
                begin[piece + 1] = length - size
                for each, corner in ((piece + 1, vertex), (piece + 2, after)):
                    start[each, 0], start[each, 1] = (
                        x + outlines.polygons.vertices[row, corner, 0],
                        y + outlines.polygons.vertices[row, corner, 1],
                    )
                    heading[each, 0], heading[each, 1] = -sense * normal_y, sense * normal_x
                is_past_beginning &= edge != 0
                piece, vertex, angle = piece + 2, after, boundaries.angle[row, after + 1 - ahead]
            turn = sense * (runs.leave_angle[following] - angle) + (TURN if is_past_beginning else 0.0)
            bend[piece], size = sense / radius, radius * max(turn, 0.0)
        length += size
        begin[piece] = length - size
        piece += 1
    return TautPath(begin[:piece], start[:piece], heading[:piece], bend[:piece])


def lay_out(graph: TangentGraph, path: Sequence[int]) -> TautPath:
    """Lay out a path that is given by its runs in a graph."""
    return lay_out_runs(graph.outlines, graph.runs, np.array(path, dtype=np.intp))


def timed(path: Array, velocity: Array, duration_s: float, steps: int) -> Array:
    """Return the positions (N + 1, 2) [m] at steps 0..N along a path (m, 2) [m], m >= 2, with the timing of the guesses."""
    along, step = compute_path_lengths(path), path[1] - path[0]
    heading = step / max(float(np.hypot(*step)), np.finfo(float).tiny)
    at = compute_progress(float(along[-1]), float(heading @ velocity), duration_s, steps)
    return np.column_stack([np.interp(at, along, axis) for axis in path.T])


def compute_path_lengths(path: Array) -> Array:
    """Compute the lengths (m,) [m] of a path (m, 2) [m] from its beginning to each of its points."""
    return np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(path, axis=0).T))])


def build_guess(scene: SearchScene, path: TautPath, goal: int, velocity: Array, duration_s: float, steps: int) -> Array:
    """Return the positions (N + 1, 2) [m] at steps 0..N of a hand with a velocity (2,) [m/s] that follows a path, read-only.

    The taut path enters no shape. If hand or goal lies in the margin of an obstacle, the guess leaves or enters the margin
    gradually, straight away from the obstacle, as far as other obstacles are not in the way.
    """
    along = compute_progress(path.length, float(path.heading[0] @ velocity), duration_s, steps)
    points = path.evaluate(along)
    for k in np.flatnonzero(scene.holds_hand | scene.holds_goal[goal]):
        polygon = freeze(Polygons(scene.polygons.vertices[k : k + 1], scene.polygons.corners[k : k + 1]))
        offsets, signed = find_offsets(points, scene.centre[None, k : k + 1], polygon)
        apart, distance = offsets[:, 0], signed[:, 0]
        wanted = np.full(len(points), scene.wanted_radius[k])
        if scene.holds_hand[k]:
            wanted = np.minimum(wanted, distance[0] + SLOPE * along)
        if scene.holds_goal[goal, k]:
            wanted = np.minimum(wanted, distance[-1] + SLOPE * (along[-1] - along))
        is_pushed = (distance != 0.0) & (distance < wanted)
        nearest = scene.centre[k] + (points - scene.centre[k] - apart)
        points[is_pushed] = (nearest + apart * (wanted / np.where(distance == 0.0, 1.0, distance))[:, None])[is_pushed]
    return as_readonly(points)
