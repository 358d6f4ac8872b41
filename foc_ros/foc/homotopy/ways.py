"""Classes in order of length: best-first search over the roadmap, each state with what it has crossed.

The state is a run of the roadmap plus its signature: for every named obstacle how often the ray from its centre has been crossed. Two
paths between the same ends pass the named obstacles on the same sides exactly when their signatures agree (Bhattacharya, Likhachev and
Kumar, "Topological constraints in search-based robot path planning", 2012), so the first path that arrives with a signature is the
shortest of its class, and classes come out in the order of their length without a list of all sign patterns.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from heapq import heappop, heappush

import numpy as np
from numpy.typing import NDArray

from foc_ros.foc.records import Array
from .roadmap import TURN, Roadmap

BITS, BIAS, DIGITS = 4, 5, 15
"""A signature is a whole number with four bits for each named obstacle: crossings + 5. Fifteen fit into 64 bits at a time."""
BACK = 1e-9
"""An arc may turn back this much [rad], or neighbours that share a tangent would need a whole turn."""


@dataclass(frozen=True)
class Way:
    """One path through the roadmap: key by which it ranks [m], its length [m], its runs, crossings of the named obstacles' rays."""

    key: float
    length: float
    runs: tuple[int, ...]
    crossings: tuple[int, ...]


def ways(plan: Roadmap, goal: int, aim: Array, named: list[int], penalty: Array, budget: int) -> Iterator[Way]:
    """Yield the shortest way of each class, shortest first, until there are no more or `budget` states have been looked at.

    goal: node; aim (runs,): least distance from each run's end to the goal [m]; named: rows of the circles that tell classes apart;
    penalty (runs,): added to the rank of a path that begins with the run [m]. A path that crosses a ray twice the same way winds
    about its obstacle and is no class of its own.
    """
    arrive, turn = _packed(plan.crossing[:, named]), _packed(plan.turn[:, named])
    ones = sum(1 << BITS * i for i in range(len(named)))
    fours, eights = 4 * ones, 8 * ones
    heads, length, leave, reach, clear = (a.tolist() for a in (plan.head, plan.length, plan.leave, plan.reach, plan.clear))
    radius, least, extra = plan.radius.tolist(), aim.tolist(), penalty.tolist()
    departures: list[list[int]] = [[] for _ in range(2 * (len(radius) + 1))]
    for run, (tail, head) in enumerate(zip(plan.tail.tolist(), heads, strict=True)):
        if head < len(departures) or head == goal:
            departures[tail].append(run)
    states: list[tuple[int, int]] = []
    heap: list[tuple[float, int, float, int, int, int]] = []
    pushed = 0
    for run in departures[2 * len(radius) + 1]:
        cost = length[run] + extra[run]
        heappush(heap, (cost + least[run], pushed, cost, arrive[run] + BIAS * ones, run, -1))
        pushed += 1
    seen: set[tuple[int, int]] = set()
    found: set[int] = set()
    while heap and len(states) < budget:
        _, _, cost, signature, run, parent = heappop(heap)
        if (signature, run) in seen:
            continue
        seen.add((signature, run))
        states.append((run, parent))
        node = heads[run]
        if node == goal:
            if signature not in found:
                found.add(signature)
                runs = _trace(states)
                yield Way(cost, cost - extra[runs[0]], runs, _unpacked(signature, len(named)))
            continue
        here, circle, anticlockwise = len(states) - 1, node >> 1, node & 1
        from_angle, free = reach[run], clear[run]
        for following in departures[node]:
            angle = leave[following] - from_angle if anticlockwise else from_angle - leave[following]
            crossed = signature + arrive[following]
            if angle < -BACK:
                angle += TURN
                crossed += turn[circle] if anticlockwise else -turn[circle]
            if angle > free or (crossed + ones) & eights or fours & ~crossed or (crossed, following) in seen:
                continue
            onward = cost + radius[circle] * angle + length[following]
            heappush(heap, (onward + least[following], pushed, onward, crossed, following, here))
            pushed += 1


def _trace(states: list[tuple[int, int]]) -> tuple[int, ...]:
    """Runs from the hand to the last state."""
    runs, state = [], len(states) - 1
    while state >= 0:
        run, state = states[state]
        runs.append(run)
    return tuple(reversed(runs))


def _packed(crossings: NDArray[np.int64]) -> list[int]:
    """Rows of crossings (m, n) as signed whole numbers, four bits for each column."""
    total = [0] * len(crossings)
    for first in range(0, crossings.shape[1], DIGITS):
        part = crossings[:, first : first + DIGITS]
        words = (part << BITS * np.arange(part.shape[1])).sum(axis=1).tolist()
        total = [a + (b << BITS * first) for a, b in zip(total, words, strict=True)]
    return total


def _unpacked(signature: int, digits: int) -> tuple[int, ...]:
    return tuple((signature >> BITS * i & 15) - BIAS for i in range(digits))
