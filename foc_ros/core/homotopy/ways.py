"""The ways from the hand to a goal, class by class, over a roadmap that the hand enters."""

from __future__ import annotations

import numpy as np

from foc_ros.core.kernels import Flags, FlagTable, Indices, Matrix, Points, PointTable, Table, Vector, compiled_exactly

from .best_first import shortest
from .tangents import HEADING, LENGTH, free_tangents, table
from .taut import laid_out
from .tries import spokes

COAST_S = 0.2
"""A path that leaves at an angle p to the velocity v ranks as if |v| (1 - cos p) times this longer: a hand coasts first."""
NANO = 1e9


@compiled_exactly
def shortest_ways(
    centre: Points,
    radius: Vector,
    bar: Vector,
    held: FlagTable,
    outer: Flags,
    blocker: Matrix,
    departures: Indices,
    head: Indices,
    spans: Matrix,
    places: PointTable,
    crossings: Table,
    holds: Table,
    hand: complex,
    velocity: complex,
    goal: int,
    named: Indices,
    turned: Vector,
    told: bool,
    bound: float,
    states: int,
    most: int,
) -> tuple[Vector, Table, Matrix, Indices, bool]:
    """Return the shortest ways from a hand to a goal, one of each class: at least so many, as far as there are.

    centre, ..., blocker: of `Circles`; departures, ..., holds: of `Runs`; velocity: of the hand [m/s]; goal: its number; named
    (k,): circles that tell classes apart; turned (n,): from the direction of the hand to that of the goal, as seen from each
    circle [rad]; told: whether these tell all classes apart, else ways that arrive by different runs are all given; bound: on the
    key [m]; states: to look at at most. Those that rank alike with the last are all there; a path that winds about a named circle
    is no way.

    Returns keys (w,), to the nanometre, by which they rank [m]; sides (w, k) of the named circles; pieces of the ways one after
    the other, as `taut.laid_out` has them, and where those of each end (w,); whether there were too many states to find all.
    """
    n, last, c = len(bar), len(centre) - 1, centre.copy()
    c[last] = hand
    start = free_tangents(c, radius, bar, outer, spokes(n, n + goal, last), hand, np.zeros(1, np.complex128), np.full(1, np.inf))
    first_spans, first_places, first_crossings = table(c, radius, held, blocker, start)
    coasting = COAST_S * (abs(velocity) - (first_places[:, HEADING] * velocity.conjugate()).real)
    known, first = (departures, head, spans, places, crossings, holds), (start[:, 1], first_spans, first_places)
    key, node, end = first_spans[:, LENGTH] + coasting, 2 * (n + goal) + 1, centre[n + goal]
    keys, sides, trails, ends, cut = shortest(
        *known, *first, first_crossings, key, radius, end, node, named, turned, told, bound, states, most
    )
    pieces, ends = laid_out(head, spans, places, *first, radius, trails, ends)
    return np.rint(keys * NANO) / NANO, sides, pieces, ends, cut
