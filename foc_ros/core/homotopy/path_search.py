"""Best-first search over the tangent graph for the shortest path of each homotopy class.

A state is a run and a signature: for every named obstacle, how often the path has crossed the ray from its centre. Two paths
between the same ends pass the named obstacles on the same sides if and only if their signatures agree (Bhattacharya, Likhachev
and Kumar, "Topological constraints in search-based robot path planning", 2012). The first path that arrives with a signature is
therefore the shortest one of its class.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from heapq import heappop, heappush
from itertools import groupby
from typing import NamedTuple

import numpy as np

from foc_ros.core.deadline import NEVER, Deadline
from foc_ros.core.kernels import Indices, Matrix, Register, Table, Vector, compiled_exactly, freeze
from foc_ros.core.obstacles.rounded_polygon import TURN

from .arcs import measure_arc_between
from .tangent_graph import TangentGraph

COAST_S = 0.2
"""A path that leaves at an angle p to the velocity v ranks as if |v| (1 - cos p) times this longer: a hand coasts first."""
TIE = 2e-9
"""Paths are given together if their keys differ by less [m]: they may rank alike to the nanometre."""
FIRST_STATES = 500
"""States that a search looks at before it looks at the clock; the next one takes twice as many. 1000 took up to 1.5 ms."""
GROWTH = 4.0
"""A search with twice as many states takes up to this times as long; it does not begin if there is less time left."""


class PathQuery(NamedTuple):
    """Which paths to look for.

    goal: row; velocity (2,): of the hand [m/s]; named (k,): the shapes of the graph that signatures count; bearing_change (k,):
    direction of the goal less direction of the hand, as seen from these [rad]; is_complete: whether signatures distinguish all
    classes (if not, paths that arrive by different runs may be of different classes); max_key [m]; max_states: number to look
    at; max_paths: number of paths at which the search ends, as there are no more classes.
    """

    goal: int
    velocity: Vector
    named: Indices
    bearing_change: Vector
    is_complete: bool
    max_key: float
    max_states: int
    max_paths: int


class Arrival(NamedTuple):
    """A path that has reached the goal.

    key: length plus what coasting adds [m]; runs: of the graph; swept (k,): angles about the named shapes [rad].
    """

    key: float
    runs: tuple[int, ...]
    swept: list[float]


class Arrivals(NamedTuple):
    """The a paths that have reached the goal.

    key (a,) [m]; group (a,): equal numbers for equally long paths; swept (a, k) [rad]; runs: of all paths, each from the goal to
    the hand; first (a + 1,): where those of each path begin. is_last: whether there are no more paths; is_cut: whether states
    were left at the end.
    """

    key: Vector
    group: Indices
    swept: Matrix
    runs: Indices
    first: Indices
    is_last: bool
    is_cut: bool


def find_shortest_paths(
    graph: TangentGraph, query: PathQuery, expected: int, notes: Counter[str], deadline: Deadline = NEVER
) -> Iterator[list[Arrival]]:
    """Yield the shortest paths to a goal, one for each signature, in the order of their keys, equally long ones together.

    expected: number of groups to look for at first; if more are asked for, the search is repeated, with more states if these were
    too few. deadline: no search begins after it, except the first. notes: `search_cut` is increased if states are left at the
    end, `search_late` if the deadline ends the search.
    """
    given, most, states = 0, expected, min(FIRST_STATES, query.max_states)
    while True:
        before_s = deadline.left_s
        found = find_arrivals(graph, freeze(query._replace(max_states=states)), most)
        needs_states = found.is_cut and states < query.max_states
        left_s = deadline.left_s
        is_late = (left_s < 0.0 or left_s < GROWTH * (before_s - left_s)) and (needs_states or not found.is_last)
        # more states may add paths to the last group
        complete = int(found.group[-1]) if needs_states and not is_late and len(found.group) else most
        runs, first = found.runs.tolist(), found.first.tolist()
        arrivals = zip(found.group.tolist(), found.key.tolist(), found.swept.tolist(), first, first[1:], strict=False)
        for group, tied in groupby(arrivals, key=lambda each: each[0]):
            if given <= group < complete:
                yield [Arrival(key, tuple(runs[begin:end][::-1]), swept) for _, key, swept, begin, end in tied]
        if is_late or (found.is_last and not needs_states):
            notes['search_late' if is_late else 'search_cut'] += is_late or found.is_cut
            return
        if needs_states:
            states = min(2 * states, query.max_states)
            given = max(given, complete) if len(found.group) else given
        else:
            given, most = most, 2 * most


@compiled_exactly
def extend_signature(graph: TangentGraph, named: Indices, before: int, run: int, signature: Register) -> None:
    """Add what a path crosses on a run, and on the arc from the run before, to a signature (k,); before: -1 if there is none."""
    runs = graph.runs
    for k, shape in enumerate(named):
        signature[k] += runs.crossings[run, shape]
    if before >= 0:
        node = runs.head[before]
        sense = 2 * (node & 1) - 1
        _, is_past_beginning = measure_arc_between(graph.outlines, runs, before, run)
        for k, shape in enumerate(named):
            signature[k] -= runs.end_crossings[before, shape]
            # an arc that passes the beginning of the boundary goes round all centres that the shape holds once more
            if is_past_beginning and graph.shapes.holds[node >> 1, shape]:
                signature[k] += sense


@compiled_exactly
def is_known(signatures: Table, older: Indices, state: int) -> bool:
    """Tell whether the signature of a state (row) is also that of an older one."""
    other = older[state]
    while other >= 0 and (signatures[other] != signatures[state]).any():
        other = older[other]
    return bool(other >= 0)


@compiled_exactly
def find_arrivals(graph: TangentGraph, query: PathQuery, most: int) -> Arrivals:
    """Find the shortest paths to a goal, until there are `most` groups of equally long ones.

    The estimate for a path is its key plus the length of the shortest path from its end to the goal, whatever the signature. A
    path that winds about a named shape is not followed.
    """
    n, runs, k = len(graph.shapes.extent), graph.runs, len(query.named)
    rest, arcs = graph.rest[query.goal], graph.arcs
    goal_node, hand_runs = 2 * (n + query.goal) + 1, graph.first_run[-1]
    # of each state: run, state before it, signature, and the state that was the last one with this run
    states, run_of, parent_of = 0, np.empty(query.max_states, np.intp), np.empty(query.max_states, np.intp)
    signatures, older = np.empty((query.max_states, k), np.intp), np.empty(query.max_states, np.intp)
    newest = np.full(len(rest) + 1, -1)
    # estimate, number of the entry, key, run, state before it
    frontier, entries = [(0.0, 0, 0.0, 0, -1) for _ in range(0)], 0
    for run in range(hand_runs, len(rest)):
        if rest[run] < np.inf:
            along = runs.heading[run, 0] * query.velocity[0] + runs.heading[run, 1] * query.velocity[1]
            key = runs.length[run] + COAST_S * (np.hypot(query.velocity[0], query.velocity[1]) - along)
            heappush(frontier, (key + rest[run], entries, key, run, -1))
            entries += 1
    arrived, keys, groups, group, is_open = [0 for _ in range(0)], [0.0 for _ in range(0)], [0 for _ in range(0)], 0, False
    while frontier and states < query.max_states and len(arrived) < query.max_paths and group < most:
        if is_open and frontier[0][0] >= keys[-1] + TIE:
            group, is_open = group + 1, False
            continue
        _, _, key, run, parent = heappop(frontier)
        place = len(rest) if query.is_complete and runs.head[run] == goal_node else run
        run_of[states], parent_of[states], older[states] = run, parent, newest[place]
        signatures[states], before = 0, -1
        if parent >= 0:
            signatures[states], before = signatures[parent], run_of[parent]
        extend_signature(graph, query.named, before, run, signatures[states])
        if (np.abs(signatures[states]) > 1).any() or is_known(signatures, older, states):
            continue
        newest[place] = states
        if runs.head[run] < 2 * n:
            for arc in range(arcs.first[run], arcs.first[run + 1]):
                following, extended = arcs.after[arc], key + arcs.step[arc]
                if extended + rest[following] < query.max_key:
                    heappush(frontier, (extended + rest[following], entries, extended, following, states))
                    entries += 1
        elif runs.head[run] == goal_node and (np.abs(query.bearing_change + TURN * signatures[states]) < TURN).all():
            arrived.append(states)
            keys.append(key)
            groups.append(group)
            is_open = True
        states += 1
    swept, first, path = np.empty((len(arrived), k)), np.zeros(len(arrived) + 1, np.intp), [0 for _ in range(0)]
    for row, arrival in enumerate(arrived):
        swept[row] = query.bearing_change + TURN * signatures[arrival]
        state = arrival
        while state >= 0:
            path.append(run_of[state])
            state = parent_of[state]
        first[row + 1] = len(path)
    is_last = group < most
    is_cut = is_last and len(frontier) > 0 and len(arrived) < query.max_paths
    return Arrivals(np.array(keys), np.array(groups), swept, np.array(path), first, is_last, is_cut)
