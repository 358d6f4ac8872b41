"""The classes to one goal, shortest first, over roadmaps that grow until no other circle can change them."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from foc_ros.foc.records import LEFT, RIGHT

from .circles import GRAZE
from .crossing import Complex, angle_of
from .levels import MOST, Level, Levels
from .scene import Scene
from .sides import swept_angles
from .tangents import TURN
from .taut import spaced
from .ways import Plan, Way, ways

FINENESS = 257
"""Points at which a path is compared with circles that its roadmap does not hold."""


@dataclass(frozen=True, eq=False)
class Found:
    """One class: rank (the nanometre of its key [m], then its label); goal; sides by id; the way with its plan."""

    rank: tuple[float, str]
    goal: int
    sides: tuple[tuple[str, int], ...]
    way: Way
    plan: Plan


class Classes:
    """The classes to one goal, in the order of their rank; notes: what was decided on the way, as counts by name.

    states: that the search may look at; usual: how many ways are usually asked for.
    """

    def __init__(self, scene: Scene, levels: Levels, goal: int, ids: tuple[str, ...], states: int, usual: int) -> None:
        self.notes: Counter[str] = Counter()
        self._scene, self._levels, self._goal, self._ids = scene, levels, goal, ids
        self._states, self._usual = states, usual
        self._named: list[int] = sorted(np.flatnonzero(scene.named[goal]).tolist(), key=ids.__getitem__)
        self._names = [ids[row] for row in self._named]
        seen = scene.centre[self._named]
        self._turned: list[float] = (angle_of(scene.goals[goal] - seen) - angle_of(scene.hand - seen)).tolist()

    def __iter__(self) -> Iterator[Found]:
        """Yield each class once, by its shortest path."""
        equal: list[Found] = []
        for found in self._by_key():
            if equal and found.rank[0] != equal[0].rank[0]:
                yield from sorted(equal, key=lambda one: one.rank)
                equal = []
            equal.append(found)
        if not equal:
            self.notes['no_way'] += 1
        yield from sorted(equal, key=lambda one: one.rank)

    def _by_key(self) -> Iterator[Found]:
        straight = abs(self._scene.goals[self._goal] - self._scene.hand)
        given: set[tuple[tuple[str, int], ...]] = set()
        rows = self._levels.first(self._named)
        while True:
            bounded = len(rows) < MOST and not rows.issuperset(self._named)
            level = self._levels(rows, bounded)
            told = [k for k, row in enumerate(self._named) if row in rows]
            places = [level.place[self._named[k]] for k in told]
            clusters = {level.plan.roadmap.circles.cluster[place] for place in places}
            everyone = 1 << len(clusters) + len(self._named) - len(told)
            bound, named = level.limit * straight if bounded else np.inf, np.array(places, dtype=np.intp)
            for way in ways(level.plan, self._goal, named, bound, self._states, self._usual):
                found = self._found(way, level, told) if way else None
                if found is None or found.sides in given:
                    self.notes['search_cut'] += way is None
                    continue
                met = self._met(found, level) if found.way.key >= level.limit * straight else []
                if met and len(rows) < MOST:
                    rows = rows.union(met)
                    break
                given.add(found.sides)
                if met:
                    self.notes['left_out'] += 1
                else:
                    yield found
                if len(given) == everyone:
                    return
            else:
                if not bounded:
                    return
                rows = self._levels.more(rows)

    def _found(self, way: Way, level: Level, told: list[int]) -> Found | None:
        """Name a way; None for one that winds about an obstacle. told: which of the names its crossings are of."""
        swept = self._turned.copy()
        for k, crossings in zip(told, way.crossings.tolist(), strict=True):
            swept[k] += TURN * crossings
            if abs(swept[k]) >= TURN:
                return None
        if len(told) < len(swept):
            others = [k for k in range(len(swept)) if k not in told]
            centres = self._scene.centre[[self._named[k] for k in others]]
            line = _line(way, level.plan).view(float).reshape(-1, 2)
            for k, angle in zip(others, swept_angles(line, centres.view(float).reshape(-1, 2)).tolist(), strict=True):
                swept[k] = angle
        sides = tuple([(name, LEFT if angle < 0.0 else RIGHT) for name, angle in zip(self._names, swept, strict=True)])
        label = f'goal{self._goal}:' + ''.join([('+' if side == LEFT else '-') + name for name, side in sides])
        return Found((round(way.key, 9), label), self._goal, sides, way, level.plan)

    def _met(self, found: Found, level: Level) -> list[int]:
        """Return the circles that a path meets and its roadmap does not hold."""
        others = np.delete(np.arange(len(self._ids)), list(level.place))
        apart = np.abs(_line(found.way, found.plan)[:, None] - self._scene.centre[others])
        met: list[int] = others[(apart < self._scene.radius[self._goal, others] - GRAZE).any(axis=0)].tolist()
        return met


def _line(way: Way, plan: Plan) -> Complex:
    table = plan.table
    return spaced(table.head, table.spans, table.places, plan.roadmap.circles.radius, way.runs, FINENESS)
