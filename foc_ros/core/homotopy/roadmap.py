"""The roadmap of taut paths: a shortest path among circles is straight runs that touch them, joined by arcs along them."""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from foc_ros.core.kernels import Flags, FlagTable, Indices, Matrix, Points, PointTable, Table, Vector, compiled_exactly
from foc_ros.core.types import Array

from .circles import Circles, together
from .crossing import Complex
from .signatures import packed
from .tangents import free_tangents, table
from .tries import EVERYWHERE, Ellipse, pairs


class Runs(NamedTuple):
    """The m free runs among circles and to goals, in the order of the nodes that they leave.

    departures (2 n + 1,): row of the first run that leaves each node of the n circles; head (m,): nodes at the ends; spans (m, 4)
    and places (m, 3): see `tangents`; crossings (m, 2 w): signatures by and to a run, in w words each; holds (n, w): digits 1
    for the centres that a circle holds.
    """

    departures: Indices
    head: Indices
    spans: Matrix
    places: PointTable
    crossings: Table
    holds: Table


class Roadmap(NamedTuple):
    """What does not depend on the hand: the circles, the runs among them and to the goals, and the circles' clusters.

    cluster (n,): number of the cluster of overlapping circles that each belongs to.
    """

    circles: Circles
    runs: Runs
    cluster: tuple[int, ...]


def roadmap(centre: Complex, radius: Array, goals: Complex) -> Roadmap:
    """Lay out circles (n,) and goals (g,). The last few are kept: a scene often stands still while the hand moves."""
    return _kept(centre.tobytes(), radius.tobytes(), goals.tobytes())


@lru_cache(maxsize=8)
def _kept(centre: bytes, radius: bytes, goals: bytes) -> Roadmap:
    return roadmap_within(np.frombuffer(centre, dtype=complex), np.frombuffer(radius), np.frombuffer(goals, dtype=complex))


def roadmap_within(centre: Complex, radius: Array, goals: Complex, ellipse: Ellipse = EVERYWHERE) -> Roadmap:
    """Lay out circles and goals with only the runs that an ellipse holds."""
    field = together(centre, radius, goals)
    return Roadmap(Circles(*field[:-1]), Runs(*runs(*field[:-1], *ellipse)), tuple(field[-1].tolist()))


@compiled_exactly
def runs(
    c: Points,
    r: Vector,
    bar: Vector,
    held: FlagTable,
    outer: Flags,
    blocker: Matrix,
    hand: complex,
    goals: Points,
    reach: Vector,
) -> tuple[Indices, Indices, Matrix, PointTable, Table, Table]:
    """Return the fields of `Runs` among circles; hand, goals, reach: of an `Ellipse`."""
    n = len(bar)
    forth = free_tangents(c, r, bar, outer, pairs(n, len(c) - 1 - n), hand, goals, reach)
    # the same run backwards touches both circles in the other sense
    back = forth[forth[:, 1] < 2 * n][:, ::-1] ^ 1
    both = np.concatenate((forth, back))
    both = both[np.argsort(both[:, 0], kind='mergesort')]
    departures = np.searchsorted(both[:, 0], np.arange(2 * n + 1))
    spans, places, crossings = table(c, r, held, blocker, both)
    return departures, both[:, 1].copy(), spans, places, crossings, packed(held[:n])
