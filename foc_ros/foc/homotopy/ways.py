"""Classes in order of length: best-first search over the roadmap, each state with what it has crossed.

A state is a run of the roadmap plus a signature: for every named obstacle how often the ray from its centre has been crossed.
Two paths between the same ends pass the named obstacles on the same sides exactly when their signatures agree (Bhattacharya,
Likhachev and Kumar, "Topological constraints in search-based robot path planning", 2012), so the first path that arrives with a
signature is the shortest of its class, and classes come out in the order of their length without a list of all sign patterns.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from heapq import heapify, heappop, heappush
from typing import NamedTuple

import numpy as np

from foc_ros.foc.records import Array

from .crossing import BIAS, BITS, packed, unpacked
from .roadmap import Roadmap, hand_runs
from .tangents import TURN, Lists, Runs

BACK = 1e-9
"""An arc may turn back this much [rad]: runs of neighbours that share a tangent follow each other without one."""
COAST_S = 0.2
"""A path that leaves at an angle p to the velocity v ranks as if |v| (1 - cos p) times this longer: a hand coasts first."""


class Way(NamedTuple):
    """One path: key by which it ranks [m]; runs, rows of the plan's table; crossings of the rays from the named circles."""

    key: float
    runs: tuple[int, ...]
    crossings: list[int]


@dataclass(frozen=True, eq=False)
class Plan:
    """A roadmap with the hand in it.

    start: the hand's runs; penalty: what the turn into each of these costs [m]; table: all runs, the hand's last.
    """

    roadmap: Roadmap
    start: Runs
    penalty: Array
    table: Lists


class _Maze(NamedTuple):
    """What each step asks for.

    Per run: to_go: least distance left to the goal [m]; crossed and way_in: its crossings; per circle: those of a whole turn.
    """

    to_go: list[float]
    crossed: list[int]
    way_in: list[int]
    whole: list[int]


def plan(roadmap: Roadmap, hand: complex, velocity: complex) -> Plan:
    """Put a hand with a velocity [m/s] into a roadmap."""
    start = hand_runs(roadmap.circles, hand)
    penalty = COAST_S * (abs(velocity) - (start.heading * velocity.conjugate()).real)
    return Plan(roadmap, start, penalty, roadmap.runs.lists.followed_by(start.lists))


def ways(plan: Plan, goal: int, named: tuple[int, ...], bound: float, states: int) -> Iterator[Way | None]:
    """Yield the shortest way of each class, shortest first; at the end None if there were too many states.

    goal: its number; named: the circles that tell classes apart; bound: on the key [m]; states: to look at at most. A path that
    winds about a named circle on the way is not followed.
    """
    n = plan.roadmap.circles.n
    node, departures, radius = 2 * (n + goal) + 1, plan.roadmap.departures[goal], plan.roadmap.radius
    heads, length, leave, reach, clear = plan.table[:5]
    maze = _maze(plan, goal, named)
    to_go, crossed, way_in, whole = maze
    ones = sum(1 << BITS * digit for digit in range(len(named)))
    zero, fours, eights = BIAS * ones, 4 * ones, 8 * ones
    heap = _first(plan, node, zero, maze)
    met = len(heads)
    trail: list[tuple[int, int]] = []
    seen: set[tuple[int, int]] = set()
    while heap and len(trail) < states:
        _, _, key, signature, run, parent = heappop(heap)
        if (signature, run) in seen:
            continue
        seen.add((signature, run))
        trail.append((run, parent))
        if heads[run] == node:
            yield Way(key, _trace(trail), unpacked(signature, len(named)))
            continue
        here, circle, anticlockwise, arrival, free = len(trail) - 1, heads[run] >> 1, heads[run] & 1, reach[run], clear[run]
        along = signature - way_in[run]
        for following in departures[heads[run]]:
            angle = leave[following] - arrival if anticlockwise else arrival - leave[following]
            after = along + crossed[following]
            if angle < -BACK:
                angle += TURN
                after += whole[circle] if anticlockwise else -whole[circle]
            if angle <= free and not (after + ones) & eights and not fours & ~after and (after, following) not in seen:
                onward = key + radius[circle] * angle + length[following]
                if onward + to_go[following] < bound:
                    heappush(heap, (onward + to_go[following], met, onward, after, following, here))
                    met += 1
    if heap:
        yield None


def _first(plan: Plan, node: int, zero: int, maze: _Maze) -> list[tuple[float, int, float, int, int, int]]:
    """Return a heap of the hand's runs to circles and goal: least key of a path, number, key, signature, run, no parent."""
    heads, first = plan.table.head, len(plan.roadmap.runs.head)
    heap = [
        (key + maze.to_go[run], run, key, zero + maze.crossed[run], run, -1)
        for run, key in enumerate((plan.start.length + plan.penalty).tolist(), first)
        if heads[run] < 2 * plan.roadmap.circles.n or heads[run] == node
    ]
    heapify(heap)
    return heap


def _trace(trail: list[tuple[int, int]]) -> tuple[int, ...]:
    """Return the runs from the hand to the last state."""
    runs, state = [], len(trail) - 1
    while state >= 0:
        run, state = trail[state]
        runs.append(run)
    return tuple(reversed(runs))


def _maze(plan: Plan, goal: int, named: tuple[int, ...]) -> _Maze:
    to_go, crossed, way_in, whole = _inner_maze(plan.roadmap, goal, named)
    target = complex(plan.roadmap.circles.centre[plan.roadmap.circles.n + goal])
    start = plan.start
    own = [abs(end - target) for end in start.lists.end]
    return _Maze(to_go + own, crossed + packed(start.crossing[:, named]), way_in + packed(start.way_in[:, named]), whole)


@lru_cache(maxsize=64)
def _inner_maze(roadmap: Roadmap, goal: int, named: tuple[int, ...]) -> _Maze:
    """Return the part that does not depend on the hand."""
    circles, runs = roadmap.circles, roadmap.runs
    to_go = np.abs(runs.end - circles.centre[circles.n + goal]).tolist()
    whole = circles.held[: circles.n, named].astype(np.int64)
    return _Maze(to_go, packed(runs.crossing[:, named]), packed(runs.way_in[:, named]), packed(whole))
