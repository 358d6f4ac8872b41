"""The roadmap of taut paths: a shortest path among circles is straight runs that touch them, joined by arcs along them."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from foc_ros.foc.records import Array

from .circles import Circles, circles
from .crossing import Complex
from .tangents import Runs, free_tangents, runs
from .tries import Ellipse, pairs, spokes


@dataclass(frozen=True, eq=False)
class Roadmap:
    """What does not depend on the hand: the circles and the runs among them and to the goals.

    radius: of circles and goals [m]; departures: for each goal, for each node of a circle, the runs to other circles and to
    that goal.
    """

    circles: Circles
    radius: list[float]
    runs: Runs
    departures: tuple[tuple[tuple[int, ...], ...], ...]


def roadmap(centre: Complex, radius: Array, goals: Complex) -> Roadmap:
    """Lay out circles (n,) and goals (g,). The last few are kept: a scene often stands still while the hand moves."""
    return _kept(centre.tobytes(), radius.tobytes(), goals.tobytes())


@lru_cache(maxsize=8)
def _kept(centre: bytes, radius: bytes, goals: bytes) -> Roadmap:
    return roadmap_within(np.frombuffer(centre, dtype=complex), np.frombuffer(radius), np.frombuffer(goals, dtype=complex))


def roadmap_within(centre: Complex, radius: Array, goals: Complex, ellipse: Ellipse | None = None) -> Roadmap:
    """Lay out circles and goals with only the runs that an ellipse holds."""
    field = circles(centre, radius, goals)
    tries = pairs(field.n, field.goals)
    free, length, u = free_tangents(field, field.centre, field.radius, tries, ellipse)
    i, s_i, j, s_j = (column[free] for column in tries[:4])
    back = np.flatnonzero(j < field.n)
    ends = np.append(i, j[back]), np.append(s_i, -s_j[back]), np.append(j, i[back]), np.append(s_j, -s_i[back])
    made = runs(field, field.centre, field.radius, ends, np.append(length, length[back]), np.append(u, -u[back]))
    return Roadmap(field, field.radius.tolist(), made, _departures(field, made))


def _departures(field: Circles, made: Runs) -> tuple[tuple[tuple[int, ...], ...], ...]:
    leaving: list[list[list[int]]] = [[[] for _ in range(2 * field.n)] for _ in range(field.goals)]
    everywhere = range(field.goals)
    for run, (tail, head) in enumerate(zip(made.tail.tolist(), (made.head >> 1).tolist(), strict=True)):
        for goal in everywhere if head < field.n else (head - field.n,):
            leaving[goal][tail].append(run)
    return tuple(tuple(tuple(node) for node in to_goal) for to_goal in leaving)


def hand_runs(field: Circles, hand: complex) -> Runs:
    """Return the free runs from the hand, which lies in no circle, to the circles and goals."""
    c, r = np.append(field.centre, hand), np.append(field.radius, 0.0)
    tries = spokes(field.n, field.goals)
    free, length, u = free_tangents(field, c, r, tries)
    i, s_i, j, s_j = (column[free] for column in tries[:4])
    return runs(field, c, r, (i, s_i, j, s_j), length, u)
