"""Straight runs that touch two circles: which exist, which are free, and what they cross.

Points are complex numbers: a tangent is a product. A run from circle i, passed anticlockwise (s_i = 1) or clockwise (-1), to
circle j with D = c_j - c_i and w = s_j r_j - s_i r_i has the length l = sqrt(|D|^2 - w^2) and the direction u = (l - 1j w) D /
|D|^2. It touches circle k at c_k - 1j s_k r_k u. Hand and goals are circles of radius 0, passed anticlockwise.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from foc_ros.foc.records import Array

from .circles import Circles
from .crossing import Complex, Counts, Flags, along_circle, straight

Index = NDArray[np.int64]
TURN = 2.0 * np.pi


class Lists(NamedTuple):
    """A table of runs as lists, for walking through it one by one; as in Runs."""

    head: list[int]
    length: list[float]
    leave: list[float]
    reach: list[float]
    clear: list[float]
    start: list[complex]
    end: list[complex]
    heading: list[complex]

    def followed_by(self, more: Lists) -> Lists:
        """Return the rows of both."""
        return Lists(
            self.head + more.head,
            self.length + more.length,
            self.leave + more.leave,
            self.reach + more.reach,
            self.clear + more.clear,
            self.start + more.start,
            self.end + more.end,
            self.heading + more.heading,
        )


@dataclass(frozen=True, eq=False)
class Runs:
    """A table of free runs.

    tail, head: nodes; node 2 k + (s > 0) is circle k passed in sense s; length [m]; heading, complex of length 1; start, end,
    complex [m]; leave, reach: angles of these on their circles, in [0, 2 pi]; clear: angle by which a path may follow the
    circle from the end before it meets an overlapping one; crossing (runs, n): of the rays from the centres, by the run, plus
    by the way to its start and less by the way to its end, each along its circle anticlockwise from angle 0.
    """

    tail: Index
    head: Index
    length: Array
    heading: Complex
    start: Complex
    end: Complex
    leave: Array
    reach: Array
    clear: Array
    crossing: Counts

    @cached_property
    def lists(self) -> Lists:
        """The table as lists."""
        return Lists(*(getattr(self, name).tolist() for name in Lists._fields))


class Tries(NamedTuple):
    """Runs to try: from circle i in sense s_i to circle j in sense s_j; others (runs, n): the circles that may be in the way."""

    i: Index
    s_i: Index
    j: Index
    s_j: Index
    others: Flags


@lru_cache(maxsize=64)
def pairs(n: int, goals: int) -> Tries:
    """Return the runs between n circles, in one direction each, and from circles to goals, which are the circles after them."""
    both = (-1, 1)
    between = [(i, s, j, t) for i in range(n) for j in range(i + 1, n) for s in both for t in both]
    return _tries(n, between + [(i, s, n + k, 1) for k in range(goals) for i in range(n) for s in both])


@lru_cache(maxsize=64)
def spokes(n: int, goals: int) -> Tries:
    """Return the runs from the hand, the circle after the last goal, to circles and goals."""
    return _tries(n, [(n + goals, 1, j, t) for j in range(n + goals) for t in ((-1, 1) if j < n else (1,))])


def _tries(n: int, rows: list[tuple[int, int, int, int]]) -> Tries:
    i, s_i, j, s_j = np.array(rows, dtype=np.int64).reshape(-1, 4).T.copy()
    circle = np.arange(n)
    return Tries(i, s_i, j, s_j, (circle != i[:, None]) & (circle != j[:, None]))


def free_tangents(field: Circles, c: Complex, r: Array, tries: Tries) -> tuple[Index, Array, Complex]:
    """Return which of the runs exist and are free, their lengths [m] and directions; c, r: of circles, goals and perhaps hand."""
    i, s_i, j, s_j, others = tries
    D, w = c[j] - c[i], s_j * r[j] - s_i * r[i]
    square = D.real**2 + D.imag**2
    length = np.sqrt((square - w**2).clip(0.0))
    here = (square == 0.0) & (r[i] == 0.0) & (r[j] == 0.0)  # a hand at its goal: no way to go is a way too
    u = np.where(here, 1.0, (length - 1j * w) * D / square.clip(1e-300))
    seen = (c[: field.n] - (c[i] - 1j * (s_i * r[i]) * u)[:, None]) * u.conj()[:, None]
    beyond = seen.real - seen.real.clip(0.0, length[:, None])
    blocked = ((beyond**2 + seen.imag**2 < field.bar) & others).any(axis=1)
    free = np.flatnonzero(((length > 0.0) | here) & ~blocked)
    if not field.outer.all():
        outer = np.append(field.outer, True)
        free = free[outer[i[free]] & outer[j[free]]]
    return free, length[free], u[free]


def runs(field: Circles, c: Complex, r: Array, ends: tuple[Index, Index, Index, Index], length: Array, u: Complex) -> Runs:
    """Tabulate free runs; ends: from, sense, to, sense."""
    i, s_i, j, s_j = ends
    from_i, from_j = -1j * (s_i * r[i]) * u, -1j * (s_j * r[j]) * u
    start, end = c[i] + from_i, c[j] + from_j
    leave, reach = np.angle(from_i) % TURN, np.angle(from_j) % TURN
    start_seen, way_out = _seen(field, i, start, from_i)
    end_seen, way_in = _seen(field, j, end, from_j)
    crossing = way_out + straight(start_seen, end_seen) - way_in
    clear = np.full(len(i), TURN)
    if field.overlapping:
        on = np.flatnonzero(j < field.n)
        ahead = s_j[on, None] * (field.blocker[j[on]] - reach[on, None]) % TURN
        clear[on] = np.fmin(TURN, np.fmin.reduce(ahead, axis=1, initial=TURN))
    return Runs(2 * i + (s_i > 0), 2 * j + (s_j > 0), length, u, start, end, leave, reach, clear, crossing)


def _seen(field: Circles, circle: Index, point: Complex, offset: Complex) -> tuple[Complex, Counts]:
    """Return points on circles as seen from the centres, and crossings on the way there; offset: from the circle's own centre."""
    seen = point[:, None] - field.centre[: field.n]
    way = np.zeros(seen.shape, dtype=np.int64)
    on = np.flatnonzero(circle < field.n)
    if len(on):
        own = circle[on]
        seen[on, own] = offset[on]
        east = (field.centre[own] + field.radius[own])[:, None] - field.centre[: field.n]
        way[on] = along_circle(east, seen[on], field.held[own])
    return seen, way
