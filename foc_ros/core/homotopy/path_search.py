"""Best-first search over the tangent graph for the shortest path of each homotopy class.

A state is a run and a signature: for every named obstacle, how often the path has crossed the ray from its centre. Two paths
between the same ends pass the named obstacles on the same sides if and only if their signatures agree (Bhattacharya, Likhachev
and Kumar, "Topological constraints in search-based robot path planning", 2012). The first path that arrives with a signature is
therefore the shortest one of its class.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator
from heapq import heappop, heappush
from itertools import count
from operator import add
from typing import NamedTuple

import numpy as np

from foc_ros.core.types import Array

from .sides import TURN
from .tangent_graph import TURN_BACK, TangentGraph

COAST_S = 0.2
"""A path that leaves at an angle p to the velocity v ranks as if |v| (1 - cos p) times this longer: a hand coasts first."""
TIE = 2e-9
"""Paths are given together if their keys differ by less [m]: they may rank alike to the nanometre."""

Signature = tuple[int, ...]


class PathQuery(NamedTuple):
    """Which paths to look for.

    goal: row; velocity (2,): of the hand [m/s]; named (k,): the circles of the graph that signatures count; bearing_change (k,):
    direction of the goal less direction of the hand, as seen from these [rad]; is_complete: whether signatures distinguish all
    classes (if not, paths that arrive by different runs may be of different classes); max_key [m]; max_states: number to look at.
    """

    goal: int
    velocity: Array
    named: list[int]
    bearing_change: Array
    is_complete: bool
    max_key: float
    max_states: int


class Arrival(NamedTuple):
    """A path that has reached the goal.

    key: length plus what coasting adds [m]; runs: of the graph; swept (k,): angles about the named circles [rad].
    """

    key: float
    runs: tuple[int, ...]
    swept: list[float]


def find_shortest_paths(graph: TangentGraph, query: PathQuery, notes: Counter[str]) -> Iterator[list[Arrival]]:
    """Yield the shortest paths to a goal, one for each signature, in the order of their keys, equally long ones together.

    The estimate for a path is its key plus the length of the shortest path from its end to the goal, whatever the signature. A
    path that winds about a named circle is not followed. notes: `search_cut` is increased if states are left at the end.
    """
    rest, signatures, numbers = graph.rest[query.goal].tolist(), SignatureCounter(graph, query.named), count()
    last = set(np.flatnonzero(graph.runs.head == 2 * (len(graph.circles.radius) + query.goal) + 1).tolist())
    first_arc = np.searchsorted(graph.arcs.before, np.arange(len(rest) + 1)).tolist()
    # estimate, number of the entry, key, runs, signature without the last run
    frontier = list[tuple[float, int, float, tuple[int, ...], Signature]]()
    for run, key in enumerate(_compute_first_keys(graph, query.velocity), graph.first_run[-1]):
        if rest[run] < math.inf:
            heappush(frontier, (key + rest[run], next(numbers), key, (run,), (0,) * len(query.named)))
    known, arrived = set[tuple[int, Signature]](), list[Arrival]()
    while frontier and len(known) < query.max_states:
        if arrived and frontier[0][0] >= arrived[-1].key + TIE:
            yield arrived
            arrived = []
        _, _, key, path, signature = heappop(frontier)
        run, signature = path[-1], signatures.extend(signature, path)
        state = -1 if query.is_complete and run in last else run, signature
        if state in known or max(signature, default=0) > 1 or min(signature, default=0) < -1:
            continue
        known.add(state)
        if run in last:
            swept = (query.bearing_change + TURN * np.array(signature)).tolist()
            if all(abs(angle) < TURN for angle in swept):
                arrived.append(Arrival(key, path, swept))
            continue
        arcs = slice(first_arc[run], first_arc[run + 1])
        for following, step in zip(graph.arcs.after[arcs].tolist(), graph.arcs.step[arcs].tolist(), strict=True):
            if key + step + rest[following] < query.max_key:
                heappush(frontier, (key + step + rest[following], next(numbers), key + step, (*path, following), signature))
    if arrived:
        yield arrived
    notes['search_cut'] += bool(frontier)


def _compute_first_keys(graph: TangentGraph, velocity: Array) -> list[float]:
    """Compute the keys of the runs from the hand [m]: their lengths and what coasting adds."""
    first = slice(graph.first_run[-1], None)
    coasting = COAST_S * (math.hypot(*velocity) - graph.runs.heading[first] @ velocity)
    keys: list[float] = (graph.runs.length[first] + coasting).tolist()
    return keys


class SignatureCounter:
    """Counts how often paths cross the rays of some circles of a graph."""

    def __init__(self, graph: TangentGraph, circles: list[int]) -> None:
        self._runs = graph.runs
        self._crossings, self._holds = graph.runs.crossings[:, :, circles], graph.circles.holds[:, circles]

    def extend(self, signature: Signature, path: tuple[int, ...]) -> Signature:
        """Return the signature of a path; signature: of the path without its last run."""
        crossed = self._crossings[path[-1], 0]
        if len(path) > 1:
            before, run, node = path[-2], path[-1], self._runs.head[path[-2]]
            sense, crossed = 2 * (node & 1) - 1, crossed - self._crossings[before, 1]
            # an arc that passes angle 0 of its circle goes round all centres that the circle holds once more
            if sense * (self._runs.leave_angle[run] - self._runs.reach_angle[before]) < -TURN_BACK:
                crossed = crossed + sense * self._holds[node >> 1]
        return tuple(map(add, signature, crossed.tolist()))
