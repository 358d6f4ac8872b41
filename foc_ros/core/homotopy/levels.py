"""Which circles a roadmap holds: all of a few, the nearest of many, more of them where these cannot settle the answer."""

from __future__ import annotations

from functools import cached_property
from typing import NamedTuple

import numpy as np

from foc_ros.core.types import Array

from .roadmap import Roadmap, roadmap, roadmap_within
from .scene import SearchScene
from .tries import Ellipse

FEW, MOST = 16, 64
"""Circles that are always looked at together, and the most that ever are."""
CLOSE = 1.02
"""Excess of the circles that many are narrowed down to at first: the best ways through a crowd are nearly straight."""


class RoadmapLevel(NamedTuple):
    """A roadmap of some circles.

    place: of each in it by its row in the scene; limit: excess from which a path may meet others; bounded: whether there are only
    those runs that paths within the limit can take.
    """

    roadmap: Roadmap
    place: dict[int, int] | range
    limit: float
    bounded: bool


class IncrementalRoadmap:
    """Levels for the goals to which the circles are equally large, each made when first asked for."""

    def __init__(self, scene: SearchScene, radius: Array) -> None:
        self._scene, self._radius = scene, radius
        self._made: dict[tuple[frozenset[int], bool], RoadmapLevel] = {}

    @cached_property
    def _order(self) -> list[int]:
        order: list[int] = np.argsort(self._scene.excess, kind='stable').tolist()
        return order

    @cached_property
    def _whole(self) -> RoadmapLevel:
        scene, n = self._scene, len(self._radius)
        return RoadmapLevel(roadmap(scene.centre, self._radius, scene.goals), range(n), np.inf, bounded=False)

    def first(self, named: list[int]) -> RoadmapLevel:
        """Return the level to begin with: all of a few circles, the named ones of many if they are few, or the close ones."""
        if len(self._radius) <= FEW:
            return self._whole
        few = frozenset(named).union(self._order[: FEW // 2])
        close = int((self._scene.excess < CLOSE).sum())
        return self._of(few if len(few) <= FEW else frozenset(self._order[: min(max(close, FEW), MOST)]), named)

    def more(self, level: RoadmapLevel, named: list[int]) -> RoadmapLevel:
        """Return the level of twice as many circles, the nearest ones."""
        return self._of(frozenset(self._order[: min(2 * len(level.place), MOST)]), named)

    def joined(self, level: RoadmapLevel, met: list[int], named: list[int]) -> RoadmapLevel:
        """Return the level that holds the circles of another and those that a path met."""
        return self._of(frozenset(level.place).union(met), named)

    def _of(self, rows: frozenset[int], named: list[int]) -> RoadmapLevel:
        """Return the level of some circles: within its limit where there may be more, and not all the named ones are there."""
        if len(rows) == len(self._radius):
            return self._whole
        bounded = len(rows) < MOST and not rows.issuperset(named)
        if (rows, bounded) not in self._made:
            self._made[rows, bounded] = self._level(sorted(rows), bounded)
        return self._made[rows, bounded]

    def _level(self, rows: list[int], bounded: bool) -> RoadmapLevel:
        scene, centre, radius = self._scene, self._scene.centre[rows], self._radius[rows]
        limit = float(np.delete(scene.excess, rows).min())
        if bounded:
            ellipse = Ellipse(scene.hand, scene.goals, limit * np.abs(scene.goals - scene.hand))
            made = roadmap_within(centre, radius, scene.goals, ellipse)
        else:
            made = roadmap(centre, radius, scene.goals)
        return RoadmapLevel(made, {row: k for k, row in enumerate(rows)}, limit, bounded)
