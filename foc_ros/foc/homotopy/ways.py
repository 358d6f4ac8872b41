"""The ways from a hand to a goal, class by class, over a roadmap with the hand in it."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple

from foc_ros.foc.compiled import Indices
from foc_ros.foc.records import Array

from .best_first import shortest_ways
from .roadmap import Roadmap, hand_runs
from .tangents import HEADING, LENGTH, Runs

COAST_S = 0.2
"""A path that leaves at an angle p to the velocity v ranks as if |v| (1 - cos p) times this longer: a hand coasts first."""


class Way(NamedTuple):
    """One path: key by which it ranks [m]; runs, rows of the plan's table; crossings of the rays from the named circles."""

    key: float
    runs: Indices
    crossings: Indices


@dataclass(frozen=True, eq=False)
class Plan:
    """A roadmap with the hand in it.

    table: all runs, the hand's last; first: keys of the hand's runs [m], their lengths and what the turn into them costs.
    """

    roadmap: Roadmap
    table: Runs
    first: Array


def plan(roadmap: Roadmap, hand: complex, velocity: complex) -> Plan:
    """Put a hand with a velocity [m/s] into a roadmap."""
    start = hand_runs(roadmap.circles, hand)
    penalty = COAST_S * (abs(velocity) - (start.places[:, HEADING] * velocity.conjugate()).real)
    return Plan(roadmap, roadmap.runs.followed_by(start), start.spans[:, LENGTH] + penalty)


def ways(plan: Plan, goal: int, named: Indices, bound: float, states: int, most: int) -> Iterator[Way | None]:
    """Yield the shortest way of each class, shortest first; at the end None if there were too many states.

    goal: its number; named: the circles that tell classes apart; bound: on the key [m]; states: to look at at most; most: ways
    to look for at first, twice as many each time these were not enough. A path that winds about a named circle on the way is not
    followed.
    """
    field, table, given = plan.roadmap.circles, plan.table, 0
    runs = table.head, table.spans, table.places, table.crossing, table.way_in
    maze = plan.roadmap.departures, field.centre, field.radius, field.held
    while True:
        keys, trails, ends, crossings, cut = shortest_ways(*runs, *maze, plan.first, field.n + goal, named, bound, states, most)
        begins = [0, *ends.tolist()]
        for way, key in enumerate(keys[given:].tolist(), given):
            yield Way(key, trails[begins[way] : begins[way + 1]], crossings[way])
        if len(keys) < most:
            if cut:
                yield None
            return
        given, most = most, 2 * most
