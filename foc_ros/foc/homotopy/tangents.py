"""Straight runs that touch two circles: which exist, which are free, and what they cross.

Points are complex numbers: a tangent is a product. A run from circle i, passed anticlockwise (s_i = 1) or clockwise (-1), to
circle j with D = c_j - c_i and w = s_j r_j - s_i r_i has the length l = sqrt(|D|^2 - w^2) and the direction u = (l - 1j w) D /
|D|^2. It touches circle k at c_k - 1j s_k r_k u. Hand and goals are circles of radius 0, passed anticlockwise.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from foc_ros.foc.compiled import (
    Flags,
    FlagTable,
    Indices,
    Matrix,
    Points,
    PointTable,
    Table,
    Vector,
    compiled_exactly,
)

from .crossing import along_circle, straight

TURN = 2.0 * np.pi
LENGTH, LEAVE, REACH, CLEAR = range(4)
"""Columns of `Runs.spans`."""
START, END, HEADING = range(3)
"""Columns of `Runs.places`."""


@dataclass(frozen=True, eq=False)
class Runs:
    """A table of m free runs.

    tail, head (m,): nodes. spans (m, 4): length [m]; angles of the points where it leaves and reaches its circles, in [0, 2 pi];
    angle by which a path may follow the circle from the end before it meets an overlapping one. places (m, 3), complex: start,
    end [m], heading of length 1. Of the rays from the centres, (m, n): crossing by the run and by the way to its start, along its
    circle anticlockwise from angle 0; way_in: crossings by the way to its end likewise.
    """

    tail: Indices
    head: Indices
    spans: Matrix
    places: PointTable
    crossing: Table
    way_in: Table

    def followed_by(self, more: Runs) -> Runs:
        """Return the rows of both."""
        return Runs(
            np.concatenate((self.tail, more.tail)),
            np.concatenate((self.head, more.head)),
            np.concatenate((self.spans, more.spans)),
            np.concatenate((self.places, more.places)),
            np.concatenate((self.crossing, more.crossing)),
            np.concatenate((self.way_in, more.way_in)),
        )


@compiled_exactly
def tangent(a: complex, r_a: float, b: complex, r_b: float) -> tuple[float, complex]:
    """Return length, 0 where there is none, and direction of the run between circles; radii negative where passed clockwise."""
    D, w = b - a, r_b - r_a
    square = D.real * D.real + D.imag * D.imag
    length = np.sqrt(max(square - w * w, 0.0))
    return length, complex(length, -w) * D / max(square, 1e-300)


@compiled_exactly
def signed(radius: Vector, node: int) -> float:
    """Return the radius of a node's circle, negative where it is passed clockwise."""
    r: float = radius[node >> 1]
    return r if node & 1 else -r


@compiled_exactly
def within(hand: complex, goals: Points, reach: Vector, start: complex, end: complex, length: float) -> bool:
    """Tell whether the way from the hand over a run to some goal is shorter than the goal's reach (g,)."""
    spare = (reach - np.abs(end - goals)).max()
    return bool(abs(start - hand) + length < spare)


@compiled_exactly
def blocked(c: Points, bar: Vector, i: int, j: int, start: complex, u: complex, length: float) -> bool:
    """Tell whether a run from circle i to circle j comes too near to another; bar (n,): square of the distance that is."""
    for k in range(len(bar)):
        if k not in (i, j):
            seen = (c[k] - start) * u.conjugate()
            beyond = seen.real - min(max(seen.real, 0.0), length)
            if beyond * beyond + seen.imag * seen.imag < bar[k]:
                return True
    return False


@compiled_exactly
def free_tangents(
    c: Points,
    r: Vector,
    bar: Vector,
    outer: Flags,
    tail: Indices,
    head: Indices,
    hand: complex,
    goals: Points,
    reach: Vector,
) -> Indices:
    """Return the rows of the tries (m,) that are tangents between outer circles, within the ellipse, and not blocked."""
    kept, count = np.empty(len(tail), np.intp), 0
    for run in range(len(tail)):
        i, j, r_i = tail[run] >> 1, head[run] >> 1, signed(r, tail[run])
        if (i < len(bar) and not outer[i]) or (j < len(bar) and not outer[j]):
            continue
        length, u = tangent(c[i], r_i, c[j], signed(r, head[run]))
        start = c[i] - 1j * r_i * u
        end = start + length * u
        if (
            length > 0.0
            and (within(hand, goals, reach, start, end, length) or within(hand, goals, reach, end, start, length))
            and not blocked(c, bar, i, j, start, u, length)
        ):
            kept[count] = run
            count += 1
    return kept[:count].copy()


@compiled_exactly
def ahead(blocker: Vector, at: float, sense: int) -> float:
    """Return the angle from a point of a circle to the next overlapping circle, a whole turn where there is none."""
    clear = TURN
    for k in range(len(blocker)):
        if not np.isnan(blocker[k]):
            clear = min(clear, sense * (blocker[k] - at) % TURN)
    return clear


@compiled_exactly
def table(
    c: Points, r: Vector, held: FlagTable, blocker: Matrix, tail: Indices, head: Indices
) -> tuple[Matrix, PointTable, Table, Table]:
    """Return spans, places, crossing and way_in of `Runs` for given runs; held, blocker: of `Circles`."""
    m, n = len(tail), len(blocker)
    spans, places = np.empty((m, 4)), np.empty((m, 3), np.complex128)
    crossing, way_in = np.zeros((m, n), np.intp), np.zeros((m, n), np.intp)
    for run in range(m):
        i, j, r_i, r_j = tail[run] >> 1, head[run] >> 1, signed(r, tail[run]), signed(r, head[run])
        length, u = tangent(c[i], r_i, c[j], r_j)
        from_i, from_j = -1j * r_i * u, -1j * r_j * u
        start, end = c[i] + from_i, c[j] + from_j
        places[run, START], places[run, END], places[run, HEADING] = start, end, u
        spans[run, LENGTH] = length
        spans[run, LEAVE] = np.arctan2(from_i.imag, from_i.real) % TURN
        spans[run, REACH] = np.arctan2(from_j.imag, from_j.real) % TURN
        spans[run, CLEAR] = ahead(blocker[j], spans[run, REACH], 2 * (head[run] & 1) - 1) if j < n else TURN
        for k in range(n):
            from_k, to_k = from_i if k == i else start - c[k], from_j if k == j else end - c[k]
            crossing[run, k] = straight(from_k, to_k)
            if i < n:
                crossing[run, k] += along_circle(c[i] + r[i] - c[k], from_k, held[i, k])
            if j < n:
                way_in[run, k] = along_circle(c[j] + r[j] - c[k], to_k, held[j, k])
    return spans, places, crossing, way_in


@compiled_exactly
def spread(
    c: Points,
    r: Vector,
    bar: Vector,
    outer: Flags,
    held: FlagTable,
    blocker: Matrix,
    tail: Indices,
    head: Indices,
    hand: complex,
) -> tuple[Indices, Matrix, PointTable, Table, Table]:
    """Return which runs from a hand, the circle after the last goal, are free, and their `table`."""
    centre, radius = np.append(c, hand), np.append(r, 0.0)
    kept = free_tangents(centre, radius, bar, outer, tail, head, hand, np.zeros(1, np.complex128), np.full(1, np.inf))
    spans, places, crossing, way_in = table(centre, radius, held, blocker, tail[kept], head[kept])
    return kept, spans, places, crossing, way_in
