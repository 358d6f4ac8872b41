"""The classes to one goal, shortest first, over roadmaps that grow until no other circle can change them."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from foc_ros.foc.records import LEFT, RIGHT

from .circles import GRAZE
from .crossing import Complex
from .levels import MOST, Level, Levels
from .scene import Scene
from .sides import swept_angles
from .tangents import TURN
from .taut import spaced
from .ways import Plan, Way, ways

FINENESS = 257
"""Points at which a path is compared with circles that its roadmap does not hold."""


NOTES = ('no_way', 'search_cut', 'left_out')
"""What is decided on the way, as explained at `search.Search`."""
Side = tuple[str, int]
"""An obstacle's id, and LEFT or RIGHT."""


class Found(NamedTuple):
    """One class: rank (the nanometre of its key [m], then its label); goal; sides by id; the way with its plan."""

    rank: tuple[float, str]
    goal: int
    sides: tuple[Side, ...]
    way: Way
    plan: Plan


class Classes:
    """The classes to one goal, in the order of their rank; notes: what was decided on the way, as counts by name.

    states: that the search may look at; usual: how many ways are usually asked for.
    """

    def __init__(self, scene: Scene, levels: Levels, goal: int, ids: tuple[str, ...], states: int, usual: int) -> None:
        self.notes = dict.fromkeys(NOTES, 0)
        self._scene, self._levels, self._goal, self._ids = scene, levels, goal, ids
        self._states, self._usual = states, usual
        self._named: list[int] = sorted(np.flatnonzero(scene.named[goal]).tolist(), key=ids.__getitem__)
        turned: list[float] = scene.turned[goal, self._named].tolist()
        self._choices = [_sides(ids[row], angle) for row, angle in zip(self._named, turned, strict=True)]

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
        given: set[tuple[Side, ...]] = set()
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
        chosen = [self._choices[k][crossings] for k, crossings in zip(told, way.crossings.tolist(), strict=True)]
        if None in chosen:
            return None
        if len(told) < len(self._named):
            chosen = self._completed(dict(zip(told, chosen, strict=True)), way, level)
        sides = tuple(side for side in chosen if side)
        label = f'goal{self._goal}:' + ''.join([('+' if side == LEFT else '-') + name for name, side in sides])
        return Found((round(way.key, 9), label), self._goal, sides, way, level.plan)

    def _completed(self, sides: dict[int, Side | None], way: Way, level: Level) -> list[Side | None]:
        """Add sides, by place in the name, of obstacles that a level does not hold: by the angle that the path sweeps."""
        others = [k for k in range(len(self._named)) if k not in sides]
        line, centres = _line(way, level.plan), self._scene.centre[[self._named[k] for k in others]]
        swept = swept_angles(line.view(float).reshape(-1, 2), centres.view(float).reshape(-1, 2))
        for k, angle in zip(others, swept.tolist(), strict=True):
            sides[k] = self._ids[self._named[k]], LEFT if angle < 0.0 else RIGHT
        return [sides[k] for k in range(len(sides))]

    def _met(self, found: Found, level: Level) -> list[int]:
        """Return the circles that a path meets and its roadmap does not hold."""
        others = np.delete(np.arange(len(self._ids)), list(level.place))
        apart = np.abs(_line(found.way, found.plan)[:, None] - self._scene.centre[others])
        met: list[int] = others[(apart < self._scene.radius[self._goal, others] - GRAZE).any(axis=0)].tolist()
        return met


def _sides(name: str, turned: float) -> tuple[Side | None, ...]:
    """Return the side of a way that crosses an obstacle's ray 0, 1 or -1 times, as index; None where that winds about it.

    turned: from the direction of the hand to that of the goal, as seen from the obstacle [rad].
    """
    swept = (turned, turned + TURN, turned - TURN)
    return tuple([(name, LEFT if angle < 0.0 else RIGHT) if abs(angle) < TURN else None for angle in swept])


def _line(way: Way, plan: Plan) -> Complex:
    table = plan.table
    return spaced(table.head, table.spans, table.places, plan.roadmap.circles.radius, way.runs, FINENESS)
