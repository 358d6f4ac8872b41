# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Best-first search over the visibility graph for the shortest path of each homotopy class to one goal.

A state is a node and a signature: how often the path has crossed the ray from the centre of each named obstacle. Two paths
between the same ends pass these obstacles on the same sides if and only if their signatures agree (Bhattacharya, Likhachev and
Kumar, "Topological constraints in search-based robot path planning", 2012). The first path that arrives with a signature is
therefore the shortest one of its class.

A signature is one number with three bits for each named obstacle: 5 plus the number of crossings, which is -1, 0 or 1. A path
that winds further is not followed.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from heapq import heappop, heappush
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from foc_ros.core.deadline import Deadline
from foc_ros.core.obstacles.geometry import TURN
from foc_ros.core.types import Array

from .graph import Crossings, Graph, Lines, Rows
from .sides import compute_bearings, count_crossings

TIE = 2e-9
"""Paths are given together if their keys differ by less [m]: they may rank alike to the nanometre."""
BITS, NEUTRAL = 3, 5
"""Bits of a signature for each obstacle, and their value where the path has not crossed the ray."""
WORD = 20
"""Number of obstacles whose bits NumPy adds up in one integer."""
TAUT = 1e-12
"""Cross product of two successive lines of a path, or of a line and an edge, that counts as straight on [m^2]."""


class Arrival(NamedTuple):
    """A path that has reached the goal: length plus what coasting adds [m], points (m, 2) [m], swept angles (k,) [rad]."""

    key: float
    points: Array
    swept: list[float]


@dataclass(frozen=True, eq=False)
class PathQuery:
    """Which paths to look for.

    hand, goal: lines from both to the nodes of a graph; heuristic (v,): least length from each node to the goal [m]; named (k,):
    rows of the obstacles in the names; velocity (2,): of the hand [m/s]; max_states: number that the search may look at;
    deadline: looked at every 200 states; after it, the search ends once it has found a path.
    """

    graph: Graph
    hand: Lines
    goal: Lines
    heuristic: list[float]
    named: Rows
    velocity: Array
    max_states: int
    deadline: Deadline


def find_shortest_paths(query: PathQuery, notes: Counter[str]) -> Iterator[list[Arrival]]:
    """Yield the shortest path of each class, in the order of their keys, equally long ones together.

    notes: `search_cut` is increased if the search ends at the largest number of states, `search_late` if the deadline ends the
    search.
    """
    graph, goal, named, centre = query.graph, query.goal, query.named, query.graph.nodes.outlines.centre
    lines, ends = _list_lines(graph, named.tobytes()), len(query.heuristic)
    heuristic = [*query.heuristic, 0.0]
    to_goal = dict(zip(goal.nodes.tolist(), zip(goal.length.tolist(), _encode(-goal.crossings, named), strict=True), strict=True))
    ones = sum(1 << BITS * row for row in range(len(named)))
    is_within = ones << BITS - 1
    bearing_change = compute_bearings(goal.point - centre[named]) - compute_bearings(query.hand.point - centre[named])
    frontier, entries = list[tuple[float, int, float, int, int, int]](), 0
    for node, key, code in _leave_hand(query):
        if heuristic[node] < np.inf:
            heappush(frontier, (key + heuristic[node], entries, key, node, NEUTRAL * ones + code, -1))
            entries += 1
    seen, node_of, before, tied, found = set[tuple[int, int]](), list[int](), list[int](), list[Arrival](), 0
    # each named obstacle has two sides, so that there are at most 2^k classes
    while frontier and len(node_of) < query.max_states and found < 1 << len(named):
        if tied and frontier[0][0] > tied[0].key + TIE:
            yield tied
            tied = []
        if found and len(node_of) % 200 == 0 and query.deadline.has_passed:
            notes['search_late'] += 1
            break
        _, _, key, node, code, state = heappop(frontier)
        if (node, code) in seen:
            continue
        seen.add((node, code))
        node_of.append(node)
        before.append(state)
        state = len(before) - 1
        if node == ends:
            turns = [(code >> BITS * row & 7) - NEUTRAL for row in range(len(named))]
            swept = (bearing_change + TURN * np.array(turns)).tolist()
            if all(abs(angle) < TURN for angle in swept):
                tied.append(Arrival(key, _collect_points(query, node_of, before), swept))
                found += 1
            continue
        following = lines[node]
        if node in to_goal:
            following = [*following, (ends, *to_goal[node])]
        if before[state] < 0:
            following = [each for each in following if _is_taut(query, node, each[0])]
        for other, step, crossed in following:
            extended = code + crossed
            if crossed and (extended & is_within != is_within or extended & extended >> 1 & extended >> 2 & ones):
                continue  # it winds about an obstacle
            if (other, extended) not in seen:
                heappush(frontier, (key + step + heuristic[other], entries, key + step, other, extended, state))
                entries += 1
    if tied:
        yield tied
    notes['search_cut'] += len(node_of) >= query.max_states


def _leave_hand(query: PathQuery) -> Iterator[tuple[int, float, int]]:
    """Yield the lines that leave the hand: the node at the end, length plus what coasting adds [m], and crossings, encoded.

    The node after the last one of the graph is the goal.
    """
    points, outlines, hand, goal = query.graph.nodes.points, query.graph.nodes.outlines, query.hand, query.goal
    nodes, length, ends, crossings = hand.nodes, hand.length, points[hand.nodes], hand.crossings
    shrunk = outlines.shrink(np.minimum(hand.scale, goal.scale))
    if not shrunk.cut(hand.point[None], goal.point[None]).any():
        nodes, ends = np.append(nodes, len(points)), np.vstack([ends, goal.point])
        length = np.append(length, np.hypot(*(goal.point - hand.point)))
        crossings = np.vstack([crossings, count_crossings(hand.point - outlines.centre, goal.point - outlines.centre)])
    along = (ends - hand.point) @ query.velocity / np.maximum(length, np.finfo(float).tiny)
    # a hand coasts for 0.2 s before it turns: a path at an angle p to the velocity v ranks as if 0.2 s |v| (1 - cos p) longer
    key = length + 0.2 * (np.hypot(*query.velocity) - along)
    yield from zip(nodes.tolist(), key.tolist(), _encode(crossings, query.named), strict=True)


def _is_taut(query: PathQuery, node: int, other: int) -> bool:
    """Tell whether a path from the hand bends at a node round its outline, on the way to another node or the goal.

    Other bends never shorten a path, but might let it leave the hand more nearly along its velocity.
    """
    nodes, (hand_x, hand_y), (goal_x, goal_y) = query.graph.nodes, query.hand.point.tolist(), query.goal.point.tolist()
    places = nodes.places
    if query.hand.scale[nodes.owner[node]] < 1.0:
        return True  # the path leaves this outline
    hand, at, ahead = (hand_x, hand_y), places[node], (goal_x, goal_y) if other == len(places) else places[other]
    before, after = places[nodes.previous[node]], places[nodes.following[node]]
    is_left = _turn(hand, at, before) + _turn(hand, at, after) > 0.0
    bend, next_bend = _turn(hand, at, ahead), _turn(at, ahead, after if is_left else before)
    return min(bend, next_bend) >= -TAUT if is_left else max(bend, next_bend) <= TAUT


def _turn(at: tuple[float, float], one: tuple[float, float], other: tuple[float, float]) -> float:
    """Return the cross product [m^2] of the vectors from a point to two others: positive if the second is left of the first."""
    return (one[0] - at[0]) * (other[1] - at[1]) - (one[1] - at[1]) * (other[0] - at[0])


def _collect_points(query: PathQuery, node_of: list[int], before: list[int]) -> Array:
    """Return the points (m, 2) [m] of the path from the hand to the last state."""
    nodes, state = list[int](), before[-1]
    while state >= 0:
        nodes.append(node_of[state])
        state = before[state]
    return np.concatenate((query.hand.point[None], query.graph.nodes.points[nodes[::-1]], query.goal.point[None]))


@lru_cache(maxsize=64)
def _list_lines(graph: Graph, named: bytes) -> list[list[tuple[int, float, int]]]:
    """Return the lines that leave each node: node at the end, length [m], and crossings, encoded; kept for the next search."""
    codes = _encode(graph.crossings, np.frombuffer(named, dtype=np.intp))
    lines = list(zip(graph.head.tolist(), graph.length.tolist(), codes, strict=True))
    return [lines[begin:end] for begin, end in pairwise(graph.first.tolist())]


def _encode(crossings: Crossings, named: Rows) -> list[int]:
    """Return the crossings (m, n) of the rays of named obstacles (k,) as one number for each line, to be added to signatures."""
    codes = [0] * len(crossings)
    for begin in range(0, len(named), WORD):
        part = crossings[:, named[begin : begin + WORD]].astype(np.int64)
        words = (part @ (1 << BITS * np.arange(part.shape[1]))).tolist()
        codes = [code + (word << BITS * begin) for code, word in zip(codes, words, strict=True)]
    return codes
