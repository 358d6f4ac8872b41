"""Which circles a roadmap holds: all of a few, the nearest of many, more of them where these cannot settle the answer."""

from __future__ import annotations

from functools import cached_property
from typing import NamedTuple

import numpy as np

from foc_ros.foc.records import Array

from .roadmap import Roadmap, roadmap, roadmap_within
from .scene import Scene
from .tries import Ellipse

FEW, MOST = 16, 64
"""Circles that are always looked at together, and the most that ever are."""
CLOSE = 1.02
"""Excess of the circles that many are narrowed down to at first: the best ways through a crowd are nearly straight."""


class Level(NamedTuple):
    """A roadmap of some circles.

    place: of each in it by its row in the scene; limit: excess from which a path may meet others.
    """

    roadmap: Roadmap
    place: dict[int, int] | range
    limit: float


class Levels:
    """Levels for the goals to which the circles are equally large, each made when first asked for."""

    def __init__(self, scene: Scene, radius: Array) -> None:
        self._scene, self._radius = scene, radius
        self._made: dict[tuple[frozenset[int], bool], Level] = {}

    @cached_property
    def _order(self) -> list[int]:
        order: list[int] = np.argsort(self._scene.excess, kind='stable').tolist()
        return order

    def first(self, named: list[int]) -> frozenset[int]:
        """Return the circles to begin with: all of a few, the named ones of many if they are few, or the close ones."""
        if len(self._radius) <= FEW:
            return frozenset(range(len(self._radius)))
        few = frozenset(named).union(self._order[: FEW // 2])
        close = int((self._scene.excess < CLOSE).sum())
        return few if len(few) <= FEW else frozenset(self._order[: min(max(close, FEW), MOST)])

    def more(self, rows: frozenset[int]) -> frozenset[int]:
        """Return twice as many circles, the nearest ones."""
        return frozenset(self._order[: min(2 * len(rows), MOST)])

    def __call__(self, rows: frozenset[int], bounded: bool) -> Level:
        """Return the level of some circles; bounded: with only those runs that paths within its limit can take."""
        if (rows, bounded) not in self._made:
            self._made[rows, bounded] = self._level(sorted(rows), bounded)
        return self._made[rows, bounded]

    def _level(self, rows: list[int], bounded: bool) -> Level:
        scene = self._scene
        if len(rows) == len(self._radius):
            return Level(roadmap(scene.centre, self._radius, scene.goals), range(len(rows)), np.inf)
        centre, radius = scene.centre[rows], self._radius[rows]
        limit = float(np.delete(scene.excess, rows).min())
        if bounded:
            ellipse = Ellipse(scene.hand, scene.goals, limit * np.abs(scene.goals - scene.hand))
            made = roadmap_within(centre, radius, scene.goals, ellipse)
        else:
            made = roadmap(centre, radius, scene.goals)
        return Level(made, {row: k for k, row in enumerate(rows)}, limit)
