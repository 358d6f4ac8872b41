# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The scene: goals, and obstacles from several sources, moved on to a stamp; and one reaching scene as the paper poses it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from textwrap import shorten

import numpy as np

from .config import Config
from .errors import SceneError
from .obstacle_table import COLUMNS, Obstacles, make_obstacles
from .obstacles.geometry import measure_offsets
from .types import NANOSECONDS, Array, HandState, Record

LARGEST_MISS, ROUNDING_M = 0.1, 1e-6
"""Largest distance of the ends of a guess from start and goal, relative to the distance between these, as it may be measured; and
the least such distance [m]."""


@dataclass(frozen=True)
class ObstacleSource:
    """The last table of one source: its obstacles with unique ids, the stamp for which they hold (None: always), their frame."""

    obstacles: Obstacles
    stamp_ns: int | None
    frame_id: str

    def at(self, stamp_ns: int) -> Obstacles:
        """Return the obstacles at a stamp [ns], moved on at their velocity; those without a stamp stay where they are."""
        return self.obstacles if self.stamp_ns is None else self.obstacles.after((stamp_ns - self.stamp_ns) / NANOSECONDS)


@dataclass(frozen=True, eq=False)
class Scene(Record):
    """Obstacles by source, in order of arrival, and the goals (g, 2) [m], None until some were received.

    goal_heights (g,): of the goals, along the plane's normal [m]; None where they are not known. goal_objects: the id of the
    obstacle that each goal is, None where it is none by name; empty if no goal has one.
    """

    sources: dict[str, ObstacleSource] = field(default_factory=dict)
    goals: Array | None = None
    goals_frame: str = ''
    goal_heights: Array | None = None
    goal_objects: tuple[str | None, ...] = ()

    def with_source(self, name: str, source: ObstacleSource) -> Scene:
        """Return the scene with the obstacles of one source replaced; this source is now the latest."""
        return replace(self, sources=self.without_source(name).sources | {name: source})

    def without_source(self, name: str) -> Scene:
        """Return the scene without the obstacles of one source."""
        return replace(self, sources={other: part for other, part in self.sources.items() if other != name})

    def with_goals(self, goals: Array, frame_id: str, heights: Array | None = None, objects: Sequence[str | None] = ()) -> Scene:
        """Return the scene with all goals replaced."""
        places = np.array(goals, dtype=float).reshape(-1, 2)
        return replace(self, goals=places, goals_frame=frame_id, goal_heights=heights, goal_objects=tuple(objects))

    def obstacles(self, stamp_ns: int) -> Obstacles:
        """Return all obstacles at a stamp [ns]: the union over the sources, in which the latest source of an id counts."""
        tables = [part.at(stamp_ns) for part in self.sources.values()]
        if len(tables) < 2:
            return tables[0] if tables else make_obstacles()
        ids = [name for table in tables for name in table.ids]
        latest = {name: row for row, name in enumerate(ids)}
        most = max(table.vertices.shape[1] for table in tables)
        padded = [
            replace(each, vertices=np.pad(each.vertices, ((0, 0), (0, most - each.vertices.shape[1]), (0, 0)))) for each in tables
        ]
        columns = [np.concatenate([getattr(each, name) for each in padded]) for name in COLUMNS]
        return Obstacles(tuple(ids), *columns).take(sorted(latest.values()))

    def not_ready_reason(self, stamp_ns: int, timeout_s: float) -> tuple[str, str] | None:
        """Return why nothing can be predicted for a hand pose at a stamp [ns], as (kind, message); None if it can.

        A source is stale if its stamp differs from that of the hand by more than timeout_s [s], in either direction; 0: never.
        One stale source suffices, since a missing message does not mean that its obstacles are gone.
        """
        if not self.sources:
            return 'no_obstacles', 'no obstacles received yet: publish an empty cloud for an empty scene'
        if self.goals is None:
            return 'no_goal', 'no goal received'
        if not len(self.goals):
            return 'no_goal', 'no goal: the last goals message was empty'
        ages = [(stamp_ns - part.stamp_ns) / NANOSECONDS for part in self.sources.values() if part.stamp_ns is not None]
        age = max(ages, key=abs, default=0.0)
        if 0.0 < timeout_s < abs(age):
            relation = 'older' if age > 0.0 else 'newer'
            return 'stale', f'obstacles are {abs(age):.3g} s {relation} than the hand pose (scene.timeout_s is {timeout_s:g})'
        return None


@dataclass(frozen=True, eq=False)
class ReachingScene(Record):
    """One reaching problem.

    hand: where it starts; goals (g, 2) [m]; obstacles; noise (2,): c per step, None for the parameters' noise scaled to the step;
    guess (N + 1, 2) [m]: path in the only class to be solved, None to search the classes; config: parameters, of which
    `duration.fixed_s` is the duration; goal_names, goal_objects (g,): what answers call the goals, and the id of the
    obstacle that each is, or none.
    """

    hand: HandState
    goals: Array
    obstacles: Obstacles
    noise: Array | None
    guess: Array | None
    config: Config
    goal_names: tuple[str, ...] = ()
    goal_objects: tuple[str | None, ...] = ()

    @property
    def avoided(self) -> Obstacles:
        """The obstacles that the centre of the hand has to avoid: those of the scene, larger by the radius of the hand."""
        return self.obstacles.grow(self.config.scene.hand_radius)

    @property
    def duration_s(self) -> float:
        """Duration of the movement [s]."""
        return self.config.duration.fixed_s

    def with_guess(self, guess: Array) -> ReachingScene:
        """Return the scene with a guess; raise SceneError for one that does not lead from the start to the goal."""
        start, goal = self.hand.mean[:2], self.goals[0]
        allowed = max(LARGEST_MISS * math.dist(start, goal), ROUNDING_M)
        for row, name, place in ((0, 'start', start), (-1, 'goal', goal)):
            if math.dist(guess[row], place) > allowed:
                words = f'N + 1 = {len(guess)} points, the {"last" if row else "first"} within {allowed:.3g} m of the {name}'
                raise SceneError('guess', f'{words} {place.tolist()}', guess[row].tolist())
        return replace(self, guess=guess)

    def check(self) -> None:
        """Raise SceneError if the start lies inside the mean boundary of an obstacle, or the object of a goal is no obstacle."""
        start, obstacles = self.hand.mean[:2], self.avoided
        distances = measure_offsets(start, obstacles)[1][0]
        for row in np.flatnonzero(distances < obstacles.radius)[:1]:
            core = 'centre' if obstacles.corners[row] == 1 else 'polygon'
            found = f'{start.tolist()}, {max(round(distances[row], 9), 0.0):.4g} m from its {core}'
            words = f'a point outside obstacle {obstacles.ids[row]}, of radius {obstacles.radius[row]:g} m'
            raise SceneError('start', words, found)
        for error in list_missing_objects(self.goal_objects, obstacles):
            raise error


def list_missing_objects(goal_objects: Sequence[str | None], obstacles: Obstacles) -> list[SceneError]:
    """Return an error for the object of each goal that is no obstacle, with the ids of those that are."""
    if not any(goal_objects):
        return []
    known = shorten(', '.join(obstacles.ids) or 'there is none', 200, placeholder=' ...')
    return [
        SceneError(f'goals[{row}].object', f'the id of an obstacle ({known})', repr(name))
        for row, name in enumerate(goal_objects)
        if name is not None and name not in obstacles.ids
    ]
