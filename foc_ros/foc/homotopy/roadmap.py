"""The roadmap of taut paths: a shortest path among circles is straight runs that touch them, joined by arcs along them."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from foc_ros.foc.compiled import Indices
from foc_ros.foc.records import Array

from .circles import Circles, circles
from .crossing import Complex
from .tangents import Runs, free_tangents, spread, table
from .tries import EVERYWHERE, Ellipse, pairs, spokes


@dataclass(frozen=True, eq=False)
class Roadmap:
    """What does not depend on the hand: the circles and the runs among them and to the goals.

    runs: in the order of their tails; departures (2 n + 1,): row of the first run that leaves each node of the n circles.
    """

    circles: Circles
    runs: Runs
    departures: Indices


def roadmap(centre: Complex, radius: Array, goals: Complex) -> Roadmap:
    """Lay out circles (n,) and goals (g,). The last few are kept: a scene often stands still while the hand moves."""
    return _kept(centre.tobytes(), radius.tobytes(), goals.tobytes())


@lru_cache(maxsize=8)
def _kept(centre: bytes, radius: bytes, goals: bytes) -> Roadmap:
    return roadmap_within(np.frombuffer(centre, dtype=complex), np.frombuffer(radius), np.frombuffer(goals, dtype=complex))


def roadmap_within(centre: Complex, radius: Array, goals: Complex, ellipse: Ellipse = EVERYWHERE) -> Roadmap:
    """Lay out circles and goals with only the runs that an ellipse holds."""
    field = circles(centre, radius, goals)
    tail, head = pairs(field.n, field.goals)
    kept = free_tangents(field.centre, field.radius, field.bar, field.outer, tail, head, *ellipse)
    tail, head = tail[kept], head[kept]
    back = head < 2 * field.n
    # the same run backwards touches both circles in the other sense
    tail, head = np.concatenate((tail, head[back] ^ 1)), np.concatenate((head, tail[back] ^ 1))
    order = np.argsort(tail, kind='stable')
    tail, head = tail[order], head[order]
    departures = np.searchsorted(tail, np.arange(2 * field.n + 1))
    columns = table(field.centre, field.radius, field.held, field.blocker, tail, head)
    return Roadmap(field, Runs(tail, head, *columns), departures)


def hand_runs(field: Circles, hand: complex) -> Runs:
    """Return the free runs from the hand, which lies in no circle, to the circles and goals."""
    tail, head = spokes(field.n, field.goals)
    seen = field.centre, field.radius, field.bar, field.outer, field.held, field.blocker
    kept, spans, places, crossing, way_in = spread(*seen, tail, head, hand)
    return Runs(tail[kept], head[kept], spans, places, crossing, way_in)
