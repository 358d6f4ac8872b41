"""The classes to one goal, shortest first, over roadmaps that grow until no other circle can change them."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise
from operator import getitem, itemgetter
from typing import NamedTuple

import numpy as np

from foc_ros.core.kernels import Matrix
from foc_ros.core.types import LEFT, RIGHT

from .circles import GRAZE
from .levels import MOST, IncrementalRoadmap, RoadmapLevel
from .names import Names
from .scene import SearchScene
from .sides import compute_swept_angles
from .taut import spaced
from .ways import shortest_ways

FINENESS = 257
"""Points at which a path is compared with circles that its roadmap does not hold."""


NOTES = ('no_way', 'search_cut', 'left_out')
"""What is decided on the way, as explained at `search.Search`."""


class Found(NamedTuple):
    """One class.

    key: the nanometre of its way's key [m], and label: by which it ranks; goal; course: the label without the goal; ids, sides
    (k,): of the named obstacles; pieces: of its way, as `taut.laid_out` has them.
    """

    key: float
    label: str
    goal: int
    course: str
    ids: tuple[str, ...]
    sides: list[int]
    pieces: Matrix


class Quest(NamedTuple):
    """What is looked for.

    scene, as it is for a hand with this velocity [m/s]; names; states: that the search for one goal may look at; usual: how many
    ways to one goal are usually asked for.
    """

    scene: SearchScene
    velocity: complex
    names: Names
    states: int
    usual: int


class Classes:
    """The classes to one goal, in the order of their rank; notes: counts by name, to which is added what was decided.

    none: whether none has been found so far.
    """

    def __init__(self, quest: Quest, levels: IncrementalRoadmap, goal: int, notes: dict[str, int]) -> None:
        self._quest, self._levels, self._goal, self._notes, self.none = quest, levels, goal, notes, True
        named, names = quest.scene.named[goal].tolist(), quest.names
        self._named = [row for row in names.order if named[row]]
        self._ids, self._prefix = tuple([names.ids[row] for row in self._named]), f'goal{goal}:'
        self._parts = [names.signed[row] for row in self._named]

    def __iter__(self) -> Iterator[Found]:
        """Yield each class once, by its shortest path."""
        scene, levels, named = self._quest.scene, self._levels, self._named
        given: set[str] = set()
        straight = abs(scene.goals[self._goal] - scene.hand)
        level = levels.first(named)
        while True:
            places = [level.place[row] for row in named if row in level.place]
            everyone = 1 << len({level.roadmap.cluster[place] for place in places}) + len(named) - len(places)
            limit = level.limit * straight
            for found in self._ranked(level, places, limit if level.bounded else np.inf, everyone):
                if found.course in given:
                    continue
                met = self._met(found, level) if found.key >= limit else []
                if met and len(level.place) < MOST:
                    level = levels.joined(level, met, named)
                    break
                given.add(found.course)
                if met:
                    self._notes['left_out'] += 1
                else:
                    self.none = False
                    yield found
                if len(given) == everyone:
                    return
            else:
                if not level.bounded:
                    return
                level = levels.more(level, named)

    def _ranked(self, level: RoadmapLevel, places: list[int], bound: float, everyone: int) -> Iterator[Found]:
        """Yield the ways over a level, in which the named circles have these places, by their rank."""
        scene, velocity, _, states, usual = self._quest
        circles, runs, *_ = level.roadmap
        turned, told = scene.turned[self._goal], len(places) == len(self._named)
        if len(level.place) < len(turned):
            turned = turned[list(level.place)]
        ends, named = (scene.hand, velocity, self._goal), np.array(places, dtype=np.intp)
        given, most = 0, min(usual, everyone)
        while True:
            keys, sides, pieces, stops, cut = shortest_ways(*circles, *runs, *ends, named, turned, told, bound, states, most)
            laid = [pieces[begin:end] for begin, end in pairwise([0, *stops.tolist()])][given:]
            passed, found = sides[given:].tolist(), []
            if not told:
                passed = [self._completed(one, level, way) for one, way in zip(passed, laid, strict=True)]
            for key, one, way in zip(keys[given:].tolist(), passed, laid, strict=True):
                course = ''.join(map(getitem, self._parts, one))
                found.append(Found(key, self._prefix + course, self._goal, course, self._ids, one, way))
            yield from sorted(found, key=itemgetter(0, 1))
            if len(keys) < most:
                self._notes['search_cut'] += cut
                return
            given, most = len(keys), 2 * most

    def _completed(self, told: list[int], level: RoadmapLevel, pieces: Matrix) -> list[int]:
        """Return sides of all named circles: of those that a level does not hold, by the angle that the path sweeps."""
        line, centres = spaced(pieces, FINENESS), self._quest.scene.centre[self._named]
        swept = compute_swept_angles(line.view(float).reshape(-1, 2), centres.view(float).reshape(-1, 2)).tolist()
        known = iter(told)
        return [
            next(known) if row in level.place else LEFT if angle < 0.0 else RIGHT
            for row, angle in zip(self._named, swept, strict=True)
        ]

    def _met(self, found: Found, level: RoadmapLevel) -> list[int]:
        """Return the circles that a path meets and its roadmap does not hold."""
        scene = self._quest.scene
        others = np.delete(np.arange(len(scene.centre)), list(level.place))
        apart = np.abs(spaced(found.pieces, FINENESS)[:, None] - scene.centre[others])
        met: list[int] = others[(apart < scene.radius[self._goal, others] - GRAZE).any(axis=0)].tolist()
        return met
