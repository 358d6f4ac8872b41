"""From a way to points: its straight runs and arcs laid end to end, and how far along them a hand is."""

from __future__ import annotations

import numpy as np

from foc_ros.foc.compiled import Indices, Matrix, Points, PointTable, Vector, compiled, compiled_exactly

from .best_first import arc
from .tangents import END, HEADING, LENGTH, START

AT, BEND = range(2)
"""Columns of the pieces' measures."""


@compiled_exactly
def pieces(head: Indices, spans: Matrix, places: PointTable, radius: Vector, way: Indices) -> tuple[Matrix, PointTable, float]:
    """Lay out a way: a run, an arc, a run, ...

    Returns for each piece where it begins along the path [m] and its bend [1/m], anticlockwise positive, 0 for runs; the point
    at which it begins [m] and the heading there, of length 1; and the length of the path [m].
    """
    count = 2 * len(way) - 1
    measures, begins, length = np.zeros((count, 2)), np.empty((count, 2), np.complex128), 0.0
    for i in range(len(way)):
        run = way[i]
        measures[2 * i, AT] = length
        begins[2 * i, 0], begins[2 * i, 1] = places[run, START], places[run, HEADING]
        length += spans[run, LENGTH]
        if i + 1 < len(way):
            sense, circle = 2 * (head[run] & 1) - 1, head[run] >> 1
            measures[2 * i + 1, AT], measures[2 * i + 1, BEND] = length, sense / radius[circle]
            begins[2 * i + 1, 0], begins[2 * i + 1, 1] = places[run, END], places[run, HEADING]
            length += radius[circle] * max(arc(spans, run, way[i + 1], sense), 0.0)
    return measures, begins, length


@compiled_exactly
def points_at(measures: Matrix, begins: PointTable, along: Vector) -> Points:
    """Return the points of laid out pieces at lengths `along` (m,) from the beginning [m]; complex (m,)."""
    points = np.empty(len(along), np.complex128)
    for i in range(len(along)):
        piece = max(np.searchsorted(measures[:, AT], along[i], side='right') - 1, 0)
        step, turn = along[i] - measures[piece, AT], 1j * measures[piece, BEND]
        chord = step + 0j if turn == 0j else (np.exp(turn * step) - 1.0) / turn
        points[i] = begins[piece, 0] + begins[piece, 1] * chord
    return points


@compiled
def progress(length: float, speed: float, duration_s: float, steps: int) -> Vector:
    """Path length at steps 0..N (N + 1,) [m]: minimum jerk from the present speed along the path to rest at its end.

    s = L (10 t^3 - 15 t^4 + 6 t^5) + v T (t - 6 t^3 + 8 t^4 - 3 t^5) with t in [0, 1]. It would overshoot beyond v T = 2.5 L
    and begin backwards with v < 0, so v is held between. length [m], speed [m/s], duration_s [s].
    """
    carried, along = min(max(speed * duration_s, 0.0), 2.5 * length), np.empty(steps + 1)
    for step in range(steps + 1):
        t = step / steps
        rest = t**3 * (10.0 + t * (6.0 * t - 15.0))
        along[step] = min(max(length * rest + carried * t * (1.0 + t**2 * (t * (8.0 - 3.0 * t) - 6.0)), 0.0), length)
    return along


@compiled_exactly
def followed(
    head: Indices,
    spans: Matrix,
    places: PointTable,
    radius: Vector,
    way: Indices,
    velocity: complex,
    duration_s: float,
    steps: int,
) -> tuple[Points, Vector, float]:
    """Return where a hand that follows a way is at steps 0..N: points (N + 1,), lengths along the way (N + 1,), its length [m].

    head, spans, places: of `tangents.Runs`; radius: of the circles [m]; velocity of the hand now [m/s]; duration_s [s].
    """
    measures, begins, length = pieces(head, spans, places, radius, way)
    speed = (begins[0, 1] * velocity.conjugate()).real
    along = progress(length, speed, duration_s, steps)
    points = points_at(measures, begins, along)
    points[-1] = places[way[-1], END]  # without what rounding has gathered on the way
    return points, along, length


@compiled_exactly
def spaced(head: Indices, spans: Matrix, places: PointTable, radius: Vector, way: Indices, count: int) -> Points:
    """Return points at equal distances along a way, from its beginning to its end; complex (count,)."""
    measures, begins, length = pieces(head, spans, places, radius, way)
    return points_at(measures, begins, length * np.linspace(0.0, 1.0, count))
