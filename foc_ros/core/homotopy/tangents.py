"""Straight runs that touch two circles: which exist, which are free, and what they cross.

Points are complex numbers: a tangent is a product. A run from circle i, passed anticlockwise (s_i = 1) or clockwise (-1), to
circle j with D = c_j - c_i and w = s_j r_j - s_i r_i has the length l = sqrt(|D|^2 - w^2) and the direction u = (l - 1j w) D /
|D|^2. It touches circle k at c_k - 1j s_k r_k u. Hand and goals are circles of radius 0, passed anticlockwise.
"""

from __future__ import annotations

import numpy as np

from foc_ros.core.kernels import Flags, FlagTable, Matrix, Points, PointTable, Table, Vector, compiled_exactly

from .crossing import TURN, along_circle, straight
from .signatures import DIGITS, ZERO, words

LENGTH, LEAVE, REACH, CLEAR = range(4)
"""Columns of spans: length [m]; angles of the points where a run leaves and reaches its circles, in [0, 2 pi]; angle by which a
path may follow the circle from the end before it meets an overlapping one."""
START, END, HEADING = range(3)
"""Columns of places, complex: start, end [m], heading of length 1."""


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
    before = abs(start - hand) + length
    for goal in range(len(goals)):  # noqa: SIM110  machine code has no generators
        if before < reach[goal] - abs(end - goals[goal]):
            return True
    return False


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
    c: Points, r: Vector, bar: Vector, outer: Flags, tries: Table, hand: complex, goals: Points, reach: Vector
) -> Table:
    """Return those of the tries (m, 2) that are tangents between outer circles, within the ellipse, and not blocked."""
    kept, count = np.empty_like(tries), 0
    for run in range(len(tries)):
        tail, head = tries[run]
        i, j, r_i = tail >> 1, head >> 1, signed(r, tail)
        if not (outer[i] and outer[j]):
            continue
        length, u = tangent(c[i], r_i, c[j], signed(r, head))
        start = c[i] - 1j * r_i * u
        end = start + length * u
        if (
            length > 0.0
            and (within(hand, goals, reach, start, end, length) or within(hand, goals, reach, end, start, length))
            and not blocked(c, bar, i, j, start, u, length)
        ):
            kept[count] = tries[run]
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
def crossed(
    c: Points, r: Vector, held: FlagTable, i: int, j: int, from_i: complex, from_j: complex, word: int
) -> tuple[int, int]:
    """Return a word of the crossings by and to a run from circle i to circle j; from_i, from_j: its ends from their centres.

    By the run: its own and those of the way to its start, along circle i anticlockwise from angle 0. To it: of the way to its end
    likewise.
    """
    n, start, end, by, to = held.shape[1], c[i] + from_i, c[j] + from_j, 0, 0
    for k in range(DIGITS * word, min(DIGITS * (word + 1), n)):
        from_k, to_k = from_i if k == i else start - c[k], from_j if k == j else end - c[k]
        run, way = straight(from_k, to_k), 0
        if i < n:
            run += along_circle(c[i] + r[i] - c[k], from_k, held[i, k])
        if j < n:
            way = along_circle(c[j] + r[j] - c[k], to_k, held[j, k])
        by += run + ZERO << 3 * (k % DIGITS)
        to += way + ZERO << 3 * (k % DIGITS)
    return by, to


@compiled_exactly
def table(c: Points, r: Vector, held: FlagTable, blocker: Matrix, runs: Table) -> tuple[Matrix, PointTable, Table]:
    """Return spans (m, 4), places (m, 3) and crossings (m, 2 w) by and to runs (m, 2); held, blocker: of `Circles`."""
    m, n, w = len(runs), len(blocker), words(len(blocker))
    spans, places, crossings = np.empty((m, 4)), np.empty((m, 3), np.complex128), np.empty((m, 2 * w), np.intp)
    for run in range(m):
        tail, head = runs[run]
        i, j, r_i, r_j = tail >> 1, head >> 1, signed(r, tail), signed(r, head)
        length, u = tangent(c[i], r_i, c[j], r_j)
        from_i, from_j = -1j * r_i * u, -1j * r_j * u
        places[run, START], places[run, END], places[run, HEADING] = c[i] + from_i, c[j] + from_j, u
        spans[run, LENGTH] = length
        spans[run, LEAVE] = np.arctan2(from_i.imag, from_i.real) % TURN
        spans[run, REACH] = np.arctan2(from_j.imag, from_j.real) % TURN
        spans[run, CLEAR] = ahead(blocker[j], spans[run, REACH], 2 * (head & 1) - 1) if j < n else TURN
        for word in range(w):
            crossings[run, word], crossings[run, w + word] = crossed(c, r, held, i, j, from_i, from_j, word)
    return spans, places, crossings
