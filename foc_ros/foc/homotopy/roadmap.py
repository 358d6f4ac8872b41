"""The roadmap of taut paths among circles: every straight run that touches two of them, and what it crosses.

A shortest path among circles is straight runs, each tangent to the circle it leaves and to the one it reaches, joined by arcs. Points
are complex numbers here: a tangent is a product. A run from circle i, passed anticlockwise (s_i = 1) or clockwise (-1), to circle j with
D = c_j - c_i and w = s_j r_j - s_i r_i has the length l = sqrt(|D|^2 - w^2), the direction u = (l - 1j w) D / |D|^2 and touches circle k
at c_k - 1j s_k r_k u.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from foc_ros.foc.records import Array

Complex = NDArray[np.complex128]
Index = NDArray[np.intp]
TURN = 2.0 * np.pi
GRAZE = 1e-9
"""A run may pass this much nearer to a circle than its radius [m]: neighbours in a row share tangents, up to rounding."""


@dataclass(frozen=True, eq=False)
class Roadmap:
    """Free tangent runs between the hand, n circles and g goals, and how they count about the circles' centres.

    radius (n,) [m]. Node 2 i + (s > 0) is circle i passed in sense s; the hand is circle n and goal k circle n + 1 + k, of radius 0 and sense 1. Per
    run: tail and head, its nodes; start, end, complex [m]; heading, complex of length 1; length [m]; leave, reach: angle on the circle it leaves and reaches, in [0, 2 pi); clear: angle that
    a path may follow the circle from there before it meets an overlapping one; crossing (runs, n): how often the ray from each centre
    along -x is crossed anticlockwise, by the run and by the way to its start, less that to its end, each along its circle from angle 0.
    turn (n, n): crossings of a whole turn about circle i, 1 for the centres inside.
    """

    radius: Array
    tail: Index
    head: Index
    start: Complex
    end: Complex
    heading: Complex
    length: Array
    leave: Array
    reach: Array
    clear: Array
    crossing: NDArray[np.int64]
    turn: NDArray[np.int64]


def roadmap(hand: complex, goals: Complex, centre: Complex, radius: Array) -> Roadmap:
    """Build the roadmap. hand, goals (g,) and centre (n,): complex [m]; radius (n,) > 0 [m]; hand and goals lie in no circle."""
    n = len(centre)
    c = np.concatenate([centre, [hand], goals])
    r = np.concatenate([radius, np.zeros(1 + len(goals))])
    outer = np.concatenate([_outer(centre, radius), np.ones(1 + len(goals), dtype=bool)])
    i, s_i, j, s_j = _pairs(n, len(goals)).T
    D, w = c[j] - c[i], s_j * r[j] - s_i * r[i]
    real = (np.abs(D) > np.abs(w)) & outer[i] & outer[j]
    i, s_i, j, s_j, D, w = (a[real] for a in (i, s_i, j, s_j, D, w))
    square = np.abs(D) ** 2
    length = np.sqrt(square - w**2)
    u = (length - 1j * w) * D / square
    start, end = c[i] - 1j * s_i * r[i] * u, c[j] - 1j * s_j * r[j] * u
    free = _free(start, u, length, i, j, centre, radius)
    i, s_i, j, s_j, u, length, start, end = (a[free] for a in (i, s_i, j, s_j, u, length, start, end))
    leave, reach = np.angle(-1j * s_i * u) % TURN, np.angle(-1j * s_j * u) % TURN
    inside = np.abs(c[:, None] - centre) < r[:, None]
    east = (c + r)[:, None] - centre
    start_seen, end_seen = start[:, None] - centre, end[:, None] - centre
    crossing = _crossing(start_seen, end_seen)
    crossing += _along(east[i], start_seen, inside[i], i, leave) - _along(east[j], end_seen, inside[j], j, reach)
    clear = _clear(centre, radius, outer, j, s_j, reach)
    tail, head = 2 * i + (s_i > 0), 2 * j + (s_j > 0)
    return Roadmap(radius, tail, head, start, end, u, length, leave, reach, clear, crossing, inside[:n].astype(np.int64))


@lru_cache(maxsize=128)
def _pairs(n: int, g: int) -> NDArray[np.int64]:
    """Every run to try, as rows (from, sense, to, sense): among n circles, hand n to circles and goals, circles to goals."""
    both = (-1, 1)
    rows = [(i, s, j, t) for i in range(n) for j in range(n) if i != j for s in both for t in both]
    rows += [(n, 1, j, t) for j in range(n) for t in both]
    rows += [(i, s, n + 1 + k, 1) for k in range(g) for i in range(n) for s in both]
    rows += [(n, 1, n + 1 + k, 1) for k in range(g)]
    return np.array(rows, dtype=np.int64).reshape(-1, 4)


def _outer(centre: Complex, radius: Array) -> NDArray[np.bool_]:
    """Which circles lie in no other one; of equal ones the first stays."""
    within = np.abs(centre[:, None] - centre) + radius[:, None] <= radius
    np.fill_diagonal(within, False)
    within &= ~(within.T & np.triu(np.ones_like(within)))
    outer: NDArray[np.bool_] = ~within.any(axis=1)
    return outer


def _free(start: Complex, u: Complex, length: Array, i: Index, j: Index, centre: Complex, radius: Array) -> NDArray[np.bool_]:
    """Which runs keep out of every circle but the two they touch."""
    seen = (centre - start[:, None]) * u.conj()[:, None]
    distance = np.abs(seen - np.clip(seen.real, 0.0, length[:, None]))
    blocked = distance < radius - GRAZE
    circles = np.arange(len(centre))
    blocked &= (circles != i[:, None]) & (circles != j[:, None])
    free: NDArray[np.bool_] = ~blocked.any(axis=1)
    return free


def _clear(centre: Complex, radius: Array, outer: NDArray[np.bool_], j: Index, s_j: Index, reach: Array) -> Array:
    """Angle from where each run reaches circle j, in its sense, to the first circle that overlaps with j."""
    n = len(centre)
    clear = np.full(len(j), TURN)
    between = centre - centre[:, None]
    overlap = (np.abs(between) < radius + radius[:, None]) & outer[:n]
    np.fill_diagonal(overlap, False)
    if overlap.any():
        on = np.flatnonzero(j < n)
        towards = s_j[on, None] * (np.angle(between)[j[on]] - reach[on, None])
        clear[on] = np.where(overlap[j[on]], towards % TURN, TURN).min(axis=1)
    return clear


def _crossing(a: Complex, b: Complex) -> NDArray[np.int64]:
    """How often a straight run from a to b, as seen from the centres, crosses their rays along -x anticlockwise: -1, 0 or 1."""
    up_a, up_b, left = a.imag >= 0.0, b.imag >= 0.0, a.real * b.imag - a.imag * b.real
    return (up_a & ~up_b & (left > 0.0)).astype(np.int64) - (~up_a & up_b & (left < 0.0))


def _along(east: Complex, point: Complex, inside: NDArray[np.bool_], circle: Index, angle: Array) -> NDArray[np.int64]:
    """The same for the way along a circle, anticlockwise from angle 0 to a point on it; inside: which centres the circle holds.

    From a centre outside, the arc counts as its chord. From one inside, the arc sweeps between 0 and a whole turn.
    """
    up_a, up_b, left = east.imag >= 0.0, point.imag >= 0.0, east.real * point.imag - east.imag * point.real
    count = np.where(inside, (up_a & ~up_b) | ((up_a == up_b) & (left < 0.0)), _crossing(east, point))
    own = np.flatnonzero(circle < inside.shape[1])
    count[own, circle[own]] = angle[own] > np.pi
    return count
