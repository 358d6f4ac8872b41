"""Straight runs that touch two circles: which exist, which are free, and what they cross.

Points are complex numbers: a tangent is a product. A run from circle i, passed anticlockwise (s_i = 1) or clockwise (-1), to
circle j with D = c_j - c_i and w = s_j r_j - s_i r_i has the length l = sqrt(|D|^2 - w^2) and the direction u = (l - 1j w) D /
|D|^2. It touches circle k at c_k - 1j s_k r_k u. Hand and goals are circles of radius 0, passed anticlockwise.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from foc_ros.foc.records import Array

from .circles import Circles
from .crossing import Complex, Counts, along_circle, straight
from .tries import Ellipse, Index, Tries

TURN = 2.0 * np.pi
AT_ONCE = 16
"""Circles that runs are compared with at once; in a crowd most runs meet one of the first."""


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
    circle from the end before it meets an overlapping one. Of the rays from the centres, (runs, n): crossing by the run and by
    the way to its start, along its circle anticlockwise from angle 0; way_in: crossings by the way to its end likewise.
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
    way_in: Counts

    @cached_property
    def lists(self) -> Lists:
        """The table as lists."""
        return Lists(*(getattr(self, name).tolist() for name in Lists._fields))


def free_tangents(
    field: Circles, c: Complex, r: Array, tries: Tries, ellipse: Ellipse | None = None
) -> tuple[Index, Array, Complex]:
    """Return which of the runs exist and are free, their lengths [m] and directions; c, r: of circles, goals and perhaps hand.

    ellipse: what runs have to stay in, one way or the other.
    """
    i, s_i, j, s_j, others = tries
    D, w = c[j] - c[i], s_j * r[j] - s_i * r[i]
    square = D.real**2 + D.imag**2
    length = np.sqrt((square - w**2).clip(0.0))
    u = (length - 1j * w) * D / square.clip(1e-300)
    start = c[i] - 1j * (s_i * r[i]) * u
    wanted = length > 0.0
    if not field.outer.all():
        outer = np.append(field.outer, True)
        wanted &= outer[i] & outer[j]
    if ellipse is not None:
        end = start + length * u
        wanted &= ellipse.holds(start, end, length) | ellipse.holds(end, start, length)
    free = np.flatnonzero(wanted)
    for first in range(0, field.n, AT_ONCE):
        part = slice(first, min(first + AT_ONCE, field.n))
        seen = (c[part] - start[free, None]) * u[free, None].conj()
        beyond = seen.real - seen.real.clip(0.0, length[free, None])
        blocked = (beyond**2 + seen.imag**2 < field.bar[part]) & others[free, part]
        free = free[~blocked.any(axis=1)]
    return free, length[free], u[free]


def runs(field: Circles, c: Complex, r: Array, ends: tuple[Index, Index, Index, Index], length: Array, u: Complex) -> Runs:
    """Tabulate free runs; ends: from, sense, to, sense."""
    i, s_i, j, s_j = ends
    from_i, from_j = -1j * (s_i * r[i]) * u, -1j * (s_j * r[j]) * u
    start, end = c[i] + from_i, c[j] + from_j
    leave, reach = np.angle(from_i) % TURN, np.angle(from_j) % TURN
    start_seen, way_out = _seen(field, i, start, from_i)
    end_seen, way_in = _seen(field, j, end, from_j)
    crossing = way_out + straight(start_seen, end_seen)
    clear = np.full(len(i), TURN)
    if field.overlapping:
        on = np.flatnonzero(j < field.n)
        ahead = s_j[on, None] * (field.blocker[j[on]] - reach[on, None]) % TURN
        clear[on] = np.fmin(TURN, np.fmin.reduce(ahead, axis=1, initial=TURN))
    return Runs(2 * i + (s_i > 0), 2 * j + (s_j > 0), length, u, start, end, leave, reach, clear, crossing, way_in)


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
