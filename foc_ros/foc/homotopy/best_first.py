"""Best-first search for classes in the order of their length: each state with what it has crossed.

A state is a run of the roadmap plus a signature: for every named obstacle how often the ray from its centre has been crossed.
Two paths between the same ends pass the named obstacles on the same sides exactly when their signatures agree (Bhattacharya,
Likhachev and Kumar, "Topological constraints in search-based robot path planning", 2012), so the first path that arrives with a
signature is the shortest of its class, and classes come out in the order of their length without a list of all sign patterns.
"""

from __future__ import annotations

from heapq import heappop, heappush

import numpy as np

from foc_ros.foc.compiled import (
    FlagTable,
    Indices,
    Matrix,
    Points,
    PointTable,
    Table,
    Vector,
    compiled_exactly,
)

from .tangents import CLEAR, END, LEAVE, LENGTH, REACH, TURN

BACK = 1e-9
"""An arc may turn back this much [rad]: runs of neighbours that share a tangent follow each other without one."""
ROOM = 256
"""Entries for which there is room at first."""


@compiled_exactly
def arc(spans: Matrix, run: int, following: int, sense: int) -> float:
    """Return the angle along a circle, in the sense in which it is passed, from the end of a run to the start of another."""
    angle: float = sense * (spans[following, LEAVE] - spans[run, REACH])
    return angle + TURN if angle < -BACK else angle


@compiled_exactly
def winds(signature: Indices) -> bool:
    """Tell whether a path has crossed some ray twice the same way."""
    for crossings in signature:  # noqa: SIM110  machine code has no generators
        if abs(crossings) > 1:
            return True
    return False


@compiled_exactly
def equal(one: Indices, other: Indices) -> bool:
    """Tell whether two signatures agree."""
    for i in range(len(one)):  # noqa: SIM110
        if one[i] != other[i]:
            return False
    return True


@compiled_exactly
def seen(signature: Indices, signatures: Table, latest: int, earlier: Indices) -> bool:
    """Tell whether a signature is among those from the latest entry back."""
    while latest >= 0:
        if equal(signatures[latest], signature):
            return True
        latest = earlier[latest]
    return False


@compiled_exactly
def traced(found: Indices, run: Indices, parent: Indices) -> tuple[Indices, Indices]:
    """Return the runs from the hand to each entry found, one after the other, and where those of each end."""
    ends = np.zeros(len(found), np.intp)
    for way in range(len(found)):
        ends[way] = ends[way - 1] if way else 0
        entry = found[way]
        while entry >= 0:
            ends[way] += 1
            entry = parent[entry]
    trails = np.empty(ends[-1] if len(found) else 0, np.intp)
    for way in range(len(found)):
        entry, place = found[way], ends[way]
        while entry >= 0:
            place -= 1
            trails[place] = run[entry]
            entry = parent[entry]
    return trails, ends


@compiled_exactly
def shortest_ways(
    head: Indices,
    spans: Matrix,
    places: PointTable,
    crossing: Table,
    way_in: Table,
    departures: Indices,
    centre: Points,
    radius: Vector,
    held: FlagTable,
    first: Vector,
    goal: int,
    named: Indices,
    bound: float,
    states: int,
    most: int,
) -> tuple[Vector, Indices, Indices, Table, bool]:
    """Find the shortest ways to a goal, at most so many, one for each signature.

    head, spans, places, crossing, way_in: of `tangents.Runs`, the last of which leave the hand and have the keys `first` [m];
    departures: of the roadmap; centre, radius, held: of its circles, of which the goal is one. named (k,): circles that tell
    classes apart; bound: on the key [m]; states: to look at at most. A path that winds about a named circle is not followed.

    Returns the keys (w,) [m], the runs of the ways one after the other, where those of each end (w,), the crossings (w, k), and
    whether the search was cut: states were left.
    """
    node, inner = 2 * goal + 1, len(head) - len(first)
    starts = [inner + i for i in range(len(first)) if head[inner + i] < departures.size - 1 or head[inner + i] == node]
    room, met, looked_at, count = len(starts) + ROOM, 0, 0, 0
    key, run, parent, earlier = np.empty(room), np.empty(room, np.intp), np.full(room, -1), np.empty(room, np.intp)
    signatures, latest, found = np.empty((room, len(named)), np.intp), np.full(len(head), -1), np.empty(most, np.intp)
    heap = [(0.0, 0) for _ in range(0)]
    for start in starts:
        key[met], run[met], signatures[met] = first[start - inner], start, crossing[start][named]
        heappush(heap, (key[met] + abs(places[start, END] - centre[goal]), met))
        met += 1
    while heap and looked_at < states and count < most:
        here = heappop(heap)[1]
        arrival = run[here]
        if seen(signatures[here], signatures, latest[arrival], earlier):
            continue
        earlier[here], latest[arrival] = latest[arrival], here
        looked_at += 1
        if head[arrival] == node:
            found[count] = here
            count += 1
            continue
        circle, sense = head[arrival] >> 1, 2 * (head[arrival] & 1) - 1
        for following in range(departures[head[arrival]], departures[head[arrival] + 1]):
            angle = arc(spans, arrival, following, sense)
            onward = key[here] + radius[circle] * angle + spans[following, LENGTH]
            least = onward + abs(places[following, END] - centre[goal])
            leads = head[following] < departures.size - 1 or head[following] == node
            if not leads or angle > spans[arrival, CLEAR] or least >= bound:
                continue
            if met == room:
                room *= 2
                key, run, parent = np.append(key, key), np.append(run, run), np.append(parent, parent)
                earlier, signatures = np.append(earlier, earlier), np.concatenate((signatures, signatures))
            turned = sense if sense * (spans[following, LEAVE] - spans[arrival, REACH]) < -BACK else 0
            for i in range(len(named)):
                k = named[i]
                crossings = crossing[following, k] - way_in[arrival, k] + turned * held[circle, k]
                signatures[met, i] = signatures[here, i] + crossings
            if not winds(signatures[met]) and not seen(signatures[met], signatures, latest[following], earlier):
                key[met], run[met], parent[met] = onward, following, here
                heappush(heap, (least, met))
                met += 1
    entries = found[:count]
    trails, ends = traced(entries, run, parent)
    return key[entries], trails, ends, signatures[entries], count < most and len(heap) > 0
