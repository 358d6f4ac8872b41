"""Initial guesses: a taut path, laid out as straight runs and arcs, and the positions of a hand that moves along it in time."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from foc_ros.core.kernels import Indices, Matrix, Vector, compiled_exactly
from foc_ros.core.types import Array, as_readonly

from .search_scene import SearchScene
from .tangent_graph import Circles, Runs, TangentGraph, measure_arc

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
def lay_out_runs(circles: Circles, runs: Runs, path: Indices) -> TautPath:
    """Lay out a path that is given by its runs (p,)."""
    pieces, length = 2 * len(path), 0.0
    begin, start, heading, bend = np.empty(pieces), np.empty((pieces, 2)), np.empty((pieces, 2)), np.zeros(pieces)
    for place, run in enumerate(path):
        straight, arc, size = 2 * place, 2 * place + 1, 0.0
        start[straight], start[arc] = runs.start[run], runs.end[run]
        heading[straight], heading[arc] = runs.heading[run], runs.heading[run]
        if place + 1 < len(path):
            circle, sense = runs.head[run] >> 1, 2 * (runs.head[run] & 1) - 1
            bend[arc] = sense / circles.radius[circle]
            size = circles.radius[circle] * max(measure_arc(runs.leave_angle[path[place + 1]], runs.reach_angle[run], sense), 0.0)
        length += runs.length[run]
        begin[straight] = length - runs.length[run]
        length += size
        begin[arc] = length - size
    return TautPath(begin, start, heading, bend)


def lay_out(graph: TangentGraph, path: Sequence[int]) -> TautPath:
    """Lay out a path that is given by its runs in a graph."""
    return lay_out_runs(graph.circles, graph.runs, np.array(path, dtype=np.intp))


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

    The taut path touches no circle. If hand or goal lies in the margin of an obstacle, the guess leaves or enters the margin
    gradually, straight away from the obstacle, as far as other obstacles are not in the way.
    """
    along = compute_progress(path.length, float(path.heading[0] @ velocity), duration_s, steps)
    points = path.evaluate(along)
    for k in np.flatnonzero(scene.holds_hand | scene.holds_goal[goal]):
        apart = points - scene.centre[k]
        distance = np.hypot(*apart.T)
        wanted = np.full(len(points), scene.wanted_radius[k])
        if scene.holds_hand[k]:
            wanted = np.minimum(wanted, distance[0] + SLOPE * along)
        if scene.holds_goal[goal, k]:
            wanted = np.minimum(wanted, distance[-1] + SLOPE * (along[-1] - along))
        is_pushed = (distance > 0.0) & (distance < wanted)
        points[is_pushed] = scene.centre[k] + apart[is_pushed] * (wanted / np.maximum(distance, 1e-300))[is_pushed, None]
    return as_readonly(points)
