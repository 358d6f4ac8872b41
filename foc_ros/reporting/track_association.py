"""Which way of one prediction goes on in the next.

A label names the obstacles that matter, so it changes when one is left behind or comes near: `goal0:+1-2` goes on as `goal0:-2`.
A line over time follows the way, not the label.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping, Sequence

import numpy as np

from .snapshots import CandidateView, Snapshot

PAUSE_NS = 300_000_000
"""For so long a way may be missing, because it was not solved, say, and go on all the same."""
Sides = dict[str, str]
"""Side ('+' left, '-' right) by obstacle."""


def sides_of(label: str, ids: Collection[str]) -> tuple[str, Sides]:
    """Split a label into its goal and the sides it names; ids: those of the scene, which may hold signs themselves."""
    goal, _, rest = label.partition(':')
    names = '|'.join(re.escape(name) for name in sorted(ids, key=len, reverse=True))
    found = re.findall(rf'([+-])({names})(?=[+-]|$)', rest) if names else []
    return goal, {name: side for side, name in found}


def associate_tracks(moments: Sequence[Snapshot]) -> list[dict[str, int]]:
    """Return, for every moment, the number of the line that each of its ways belongs to, by label.

    A way goes on in one with the same goals and the same label, else in one with the same goal that passes no obstacle on another
    side; of several, the one that shares most sides, then the latest, then the most likely.
    """
    numbered: list[dict[str, int]] = []
    lines = 0
    open_lines: dict[int, tuple[int, str]] = {}
    before: Snapshot | None = None
    for moment in moments:
        if before is None or not np.array_equal(before.goals, moment.goals):
            open_lines = {}
        fresh = {line: kept for line, kept in open_lines.items() if moment.stamp_ns - kept[0] <= PAUSE_NS}
        numbers = _continued(moment, {line: label for line, (_, label) in fresh.items()})
        for way in moment.ways:
            if way.label not in numbers:
                numbers[way.label], lines = lines, lines + 1
        now = {numbers[way.label]: (moment.stamp_ns, way.label) for way in moment.ways}
        open_lines = now | {line: kept for line, kept in fresh.items() if line not in now}
        numbered.append(numbers)
        before = moment
    return numbered


def slots(moments: Sequence[Snapshot], lines: Sequence[Mapping[str, int]], count: int, colours: int) -> dict[int, int]:
    """Return a slot in [0, count), which gives letter and colour, of each line: no two lines of one time share one.

    Lines that begin together take theirs in order of likelihood. First come slots of a colour (slot modulo colours) that no line
    of that time has, then those that have been free for longest. A line that finds none free has none. lines: as of `lineages`.
    """
    last = {line: row for row, numbers in enumerate(lines) for line in numbers.values()}
    given: dict[int, int] = {}
    seen: set[int] = set()
    taken_until = dict.fromkeys(range(count), -1)
    for row, (moment, numbers) in enumerate(zip(moments, lines, strict=True)):
        for line in (numbers[way.label] for way in moment.ways):
            free = [slot for slot, until in taken_until.items() if until < row]
            if line not in seen and free:
                used = {slot % colours for slot, until in taken_until.items() if until >= row}
                given[line] = min(free, key=lambda slot: (slot % colours in used, taken_until[slot], slot))
                taken_until[given[line]] = last[line]
            seen.add(line)
    return given


def _continued(moment: Snapshot, earlier: dict[int, str]) -> dict[str, int]:
    """Return the line of every way that goes on, by label; no line goes on twice."""
    went_on: dict[str, int] = {}
    for way in moment.ways:
        same = [line for line, label in earlier.items() if label == way.label and line not in went_on.values()]
        went_on.update({way.label: same[0]} if same else {})
    for way in moment.ways:
        if way.label not in went_on:
            left = {line: label for line, label in earlier.items() if line not in went_on.values()}
            best = _best(way, left, moment.obstacles.ids)
            went_on.update({} if best is None else {way.label: best})
    return went_on


def _best(way: CandidateView, earlier: dict[int, str], ids: Collection[str]) -> int | None:
    """Return the first of the earlier lines that agree most with a way; None where none agrees."""
    goal, sides = sides_of(way.label, ids)
    agreeing: dict[int, int] = {}
    for line, label in earlier.items():
        other_goal, others = sides_of(label, ids)
        if other_goal == goal and all(sides.get(name, side) == side for name, side in others.items()):
            agreeing[line] = len(sides.items() & others.items())
    return max(agreeing, key=lambda line: agreeing[line]) if agreeing else None
