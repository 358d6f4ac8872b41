"""The classes to one goal, shortest first, over roadmaps that grow until no other circle can change them."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from foc_ros.foc.records import LEFT, RIGHT, Array

from .crossing import Complex, angle_of
from .roadmap import roadmap
from .scene import SMALLEST, Scene
from .sides import swept_seen
from .tangents import TURN
from .taut import taut
from .ways import Plan, Way, plan, ways

NEAREST, MOST = 8, 64
"""Circles in the first roadmap, which doubles, and in the last."""
FINENESS = 257
"""Points at which a path is compared with circles that its roadmap does not hold."""


@dataclass(frozen=True, eq=False)
class Level:
    """A plan among some circles: place of each in it by row of the scene's; from which excess other circles may be met."""

    plan: Plan
    place: dict[int, int]
    limit: float


@dataclass(frozen=True, eq=False)
class Found:
    """One class: rank (the nanometre of its key [m], then its label); goal; sides by id; the way with its plan."""

    rank: tuple[float, str]
    goal: int
    sides: tuple[tuple[str, int], ...]
    way: Way
    plan: Plan


class Levels:
    """Plans among the circles that matter most, for the goals to which they are equally large; each made when first asked for."""

    def __init__(self, scene: Scene, radius: Array, velocity: complex) -> None:
        self._scene, self._radius, self._velocity = scene, radius, velocity
        self._order = np.argsort(scene.excess, kind='stable')
        self._made: dict[int, Level] = {}

    def __call__(self, size: int) -> Level:
        """Return the level of the `size` circles that matter most."""
        if size not in self._made:
            rows = np.sort(self._order[:size])
            made = plan(
                roadmap(self._scene.centre[rows], self._radius[rows], self._scene.goals), self._scene.hand, self._velocity
            )
            limit = float(self._scene.excess[self._order[size]]) if size < len(self._order) else np.inf
            self._made[size] = Level(made, {row: k for k, row in enumerate(rows.tolist())}, limit)
        return self._made[size]


class Classes:
    """The classes to one goal, in the order of their rank; notes: what was decided on the way, as counts by name."""

    def __init__(self, scene: Scene, levels: Levels, goal: int, ids: tuple[str, ...]) -> None:
        self.notes: Counter[str] = Counter()
        self._scene, self._levels, self._goal, self._ids = scene, levels, goal, ids
        self._named: list[int] = sorted(np.flatnonzero(scene.named[goal]).tolist(), key=ids.__getitem__)
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
        straight = max(abs(self._scene.goals[self._goal] - self._scene.hand), SMALLEST)
        given: set[tuple[tuple[str, int], ...]] = set()
        size, everyone = NEAREST, 1 << len(self._named)
        while len(given) < everyone:
            level = self._levels(size)
            told = tuple(level.place[row] for row in self._named if row in level.place)
            for way in ways(level.plan, self._goal, told):
                found = self._found(way, level) if way else None
                if found is None or found.sides in given:
                    self.notes['search_cut'] += way is None
                    continue
                if found.way.key >= level.limit * straight:
                    if size < MOST:
                        break
                    if self._meets_others(found, level):
                        self.notes['left_out'] += 1
                        continue
                given.add(found.sides)
                yield found
                if len(given) == everyone:
                    return
            else:
                if len(told) == len(self._named):
                    return
            if size >= MOST:
                return
            size *= 2

    def _found(self, way: Way, level: Level) -> Found | None:
        """Name a way; None for one that winds about an obstacle."""
        crossings = iter(way.crossings)
        swept = [
            turned + TURN * next(crossings) if row in level.place else np.nan
            for row, turned in zip(self._named, self._turned, strict=True)
        ]
        if any(abs(angle) >= TURN for angle in swept):
            return None
        if len(way.crossings) < len(swept):
            others = [k for k, row in enumerate(self._named) if row not in level.place]
            for k, angle in zip(
                others,
                swept_seen(_line(way, level.plan)[:, None] - self._scene.centre[[self._named[k] for k in others]]),
                strict=True,
            ):
                swept[k] = angle
        sides = tuple((self._ids[row], LEFT if angle < 0.0 else RIGHT) for row, angle in zip(self._named, swept, strict=True))
        label = f'goal{self._goal}:' + ''.join([('+' if side == LEFT else '-') + identity for identity, side in sides])
        return Found((round(way.key, 9), label), self._goal, sides, way, level.plan)

    def _meets_others(self, found: Found, level: Level) -> bool:
        """Whether a path meets a circle that its roadmap does not hold."""
        others = [row for row in range(len(self._ids)) if row not in level.place]
        apart = np.abs(_line(found.way, found.plan)[:, None] - self._scene.centre[others])
        return bool((apart < self._scene.radius[self._goal, others]).any())


def _line(way: Way, plan: Plan) -> Complex:
    path = taut(plan, [way])
    points: Complex = path.points(path.length[:, None] * np.linspace(0.0, 1.0, FINENESS))[0]
    return points
