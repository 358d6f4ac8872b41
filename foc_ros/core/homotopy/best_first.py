"""Best-first search for classes in the order of their length: each state with what it has crossed.

A state is a run of the roadmap plus a signature: for every named obstacle how often the ray from its centre has been crossed.
Two paths between the same ends pass the named obstacles on the same sides exactly when their signatures agree (Bhattacharya,
Likhachev and Kumar, "Topological constraints in search-based robot path planning", 2012), so the first path that arrives with a
signature is the shortest of its class, and classes come out in the order of their length without a list of all sign patterns.
"""

from __future__ import annotations

import numpy as np

from foc_ros.core.kernels import Indices, Matrix, PointTable, Table, Vector, compiled_exactly

from .crossing import TURN, side
from .heap import pop, push
from .signatures import DIGITS, among, count, equal, masked, winds
from .tangents import CLEAR, END, LEAVE, LENGTH, REACH

BACK = 1e-9
"""An arc may turn back this much [rad]: runs of neighbours that share a tangent follow each other without one."""
TIE = 2e-9
"""Keys that differ by less may have the same nanometre [m]."""
ROOM = 1024
"""Entries for which there is room at first."""


@compiled_exactly
def arc(left: float, reached: float, sense: int) -> float:
    """Return the angle along a circle, in the sense in which it is passed, from where a run reached it to where one left it."""
    angle = sense * (left - reached)
    return angle + TURN if angle < -BACK else angle


@compiled_exactly
def seen(signatures: Table, one: int, latest: int, earlier: Indices) -> bool:
    """Tell whether the signature of an entry is among those from the latest entry back."""
    while latest >= 0:
        if equal(signatures, latest, one):
            return True
        latest = earlier[latest]
    return False


@compiled_exactly
def winding(named: Indices, turned: Vector, crossings: int, size: int) -> Indices:
    """Return so many words with a digit 1 for the named circles about which a path winds that crosses their rays so often."""
    digits = np.zeros(size, np.intp)
    for k in named:
        if not side(turned[k] + TURN * crossings):
            digits[k // DIGITS] |= 1 << 3 * (k % DIGITS)
    return digits


@compiled_exactly
def sides(entries: Indices, signatures: Table, named: Indices, turned: Vector) -> Table:
    """Return on which side paths (w,) that end with some signatures pass each named circle, (w, k)."""
    passed = np.empty((len(entries), len(named)), np.intp)
    for way in range(len(entries)):
        for i in range(len(named)):
            passed[way, i] = side(turned[named[i]] + TURN * count(signatures, entries[way], named[i]))
    return passed


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
def shortest(
    departures: Indices,
    head: Indices,
    spans: Matrix,
    places: PointTable,
    crossings: Table,
    holds: Table,
    first_head: Indices,
    first_spans: Matrix,
    first_places: PointTable,
    first_crossings: Table,
    first_key: Vector,
    radius: Vector,
    goal: complex,
    node: int,
    named: Indices,
    turned: Vector,
    told: bool,
    bound: float,
    states: int,
    most: int,
) -> tuple[Vector, Table, Indices, Indices, bool]:
    """Find the shortest ways to a goal, one for each signature: so many, and those that are no longer than these but for a TIE.

    departures, ..., holds: of `roadmap.Runs`; first_...: the same of the runs that leave the hand, and their keys [m]; radius: of
    the circles; goal: where its node is; named (k,): circles that tell classes apart; turned (n,): from the direction of the hand
    to that of the goal, as seen from each circle [rad]; told: whether these tell all classes apart, or ways that arrive by
    different runs may be of different classes; bound: on the key [m]; states: to look at at most. A path that winds about a named
    circle is not followed.

    Returns the keys (w,) [m], the sides (w, k), the runs of the ways one after the other, those from the hand counted from -1
    downwards, where the runs of each end (w,), and whether the search was cut: states were left.
    """
    words, mask = holds.shape[1], masked(named, holds.shape[1])
    room, met, looked_at, ways = len(first_key) + ROOM, len(first_key), 0, 0
    key, run, parent, earlier = np.empty(room), np.empty(room, np.intp), np.empty(room, np.intp), np.empty(room, np.intp)
    signatures, latest = np.empty((room, words), np.intp), np.full(len(head) + met + 1, -1)
    found, more, less = np.empty(most, np.intp), winding(named, turned, 1, words), winding(named, turned, -1, words)
    least, heap, size = np.empty(room), np.empty(room, np.intp), met
    for i in range(met):
        key[i], run[i], parent[i] = first_key[i], -1 - i, -1
        for word in range(words):
            signatures[i, word] = first_crossings[i, word] & mask[word]
        push(least, heap, i, key[i] + abs(first_places[i, END] - goal), i)
    while size and looked_at < states and (ways < most or least[0] < key[found[ways - 1]] + TIE):
        here = pop(least, heap, size)
        size -= 1
        arrival, start = run[here], -1 - run[here]
        at = head[arrival] if arrival >= 0 else first_head[start]
        state = len(head) if told and at == node else arrival
        if seen(signatures, here, latest[state], earlier):
            continue
        earlier[here], latest[state] = latest[state], here
        looked_at += 1
        if at == node:
            if not among(signatures, here, more, less):
                found = np.append(found, found) if ways == len(found) else found
                found[ways] = here
                ways += 1
            continue
        circle, sense = at >> 1, 2 * (at & 1) - 1
        span, crossed = (spans[arrival], crossings[arrival]) if arrival >= 0 else (first_spans[start], first_crossings[start])
        for following in range(departures[at], departures[at + 1]):
            if head[following] >= len(departures) - 1 and head[following] != node:
                continue
            angle = arc(spans[following, LEAVE], span[REACH], sense)
            onward = key[here] + radius[circle] * angle + spans[following, LENGTH]
            whole = onward + abs(places[following, END] - goal)
            if angle > span[CLEAR] or whole >= bound:
                continue
            if met == room:
                room *= 2
                key, run, parent = np.append(key, key), np.append(run, run), np.append(parent, parent)
                earlier, signatures = np.append(earlier, earlier), np.concatenate((signatures, signatures))
                least, heap = np.append(least, least), np.append(heap, heap)
            turns = sense if sense * (spans[following, LEAVE] - span[REACH]) < -BACK else 0
            for i in range(words):
                onto = (crossings[following, i] & mask[i]) - (crossed[words + i] & mask[i])
                signatures[met, i] = signatures[here, i] + onto + turns * (holds[circle, i] & mask[i])
            state = len(head) if told and head[following] == node else following
            if not winds(signatures, met, mask) and not seen(signatures, met, latest[state], earlier):
                key[met], run[met], parent[met] = onward, following, here
                push(least, heap, size, whole, met)
                met, size = met + 1, size + 1
    found = found[:ways]
    trails, ends = traced(found, run, parent)
    return key[found], sides(found, signatures, named, turned), trails, ends, ways < most and size > 0
