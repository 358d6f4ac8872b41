"""From a way to points: its straight runs and arcs laid end to end, and how far along them a hand is."""

from __future__ import annotations

import numpy as np

from foc_ros.core.kernels import Indices, Matrix, Points, PointTable, Vector, compiled, compiled_exactly

from .best_first import arc
from .tangents import END, HEADING, LEAVE, LENGTH, REACH, START

AT, BEND, X, Y, HEADING_X, HEADING_Y = range(6)
"""Columns of pieces: where a run or an arc begins along the path [m]; its bend [1/m], anticlockwise positive, 0 for runs; the
point at which it begins [m] and the heading there, of length 1. The last piece of a way is its end."""


@compiled_exactly
def laid_out(
    head: Indices,
    spans: Matrix,
    places: PointTable,
    first_head: Indices,
    first_spans: Matrix,
    first_places: PointTable,
    radius: Vector,
    trails: Indices,
    ends: Indices,
) -> tuple[Matrix, Indices]:
    """Lay out ways (w,), each a run, an arc, a run, ...

    head, ..., radius, trails, ends: as in `best_first.shortest`. Returns pieces of the ways one after the other, and where those
    of each end (w,).
    """
    pieces, begin = np.zeros((2 * len(trails), 6)), 0
    for way in range(len(ends)):
        along = 0.0
        for i in range(begin, ends[way]):
            run, start, piece = trails[i], -1 - trails[i], pieces[2 * i : 2 * i + 2]
            at = head[run] if run >= 0 else first_head[start]
            span, place = (spans[run], places[run]) if run >= 0 else (first_spans[start], first_places[start])
            piece[0, AT], piece[0, X], piece[0, Y] = along, place[START].real, place[START].imag
            along += span[LENGTH]
            piece[1, AT], piece[1, X], piece[1, Y] = along, place[END].real, place[END].imag
            piece[:, HEADING_X], piece[:, HEADING_Y] = place[HEADING].real, place[HEADING].imag
            if i + 1 < ends[way]:
                sense, r = 2 * (at & 1) - 1, radius[at >> 1]
                piece[1, BEND] = sense / r
                along += r * max(arc(spans[trails[i + 1], LEAVE], span[REACH], sense), 0.0)
        begin = ends[way]
    return pieces, 2 * ends


@compiled_exactly
def points_at(pieces: Matrix, along: Vector) -> Points:
    """Return the points of the pieces of a way at lengths `along` (m,) from its beginning [m]; complex (m,)."""
    points = np.empty(len(along), np.complex128)
    for i in range(len(along)):
        piece = pieces[max(np.searchsorted(pieces[:, AT], along[i], side='right') - 1, 0)]
        step, turn = along[i] - piece[AT], 1j * piece[BEND]
        chord = step + 0j if turn == 0j else (np.exp(turn * step) - 1.0) / turn
        points[i] = complex(piece[X], piece[Y]) + complex(piece[HEADING_X], piece[HEADING_Y]) * chord
    return points


@compiled_exactly
def spaced(pieces: Matrix, count: int) -> Points:
    """Return points at equal distances along a way, from its beginning to its end; complex (count,)."""
    return points_at(pieces, pieces[-1, AT] * np.linspace(0.0, 1.0, count))


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
