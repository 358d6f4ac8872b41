# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Demonstrated paths, which come back as candidates if the scene is the one in which they were recorded.

The search proposes short classes. A demonstrated class may be longer and still be the one that the operator takes (the paper
stores the initial guesses of each class for its scene).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from foc_ros.core.obstacle_table import Obstacles
from foc_ros.core.obstacles.clearance import is_free
from foc_ros.core.solution import LEFT, RIGHT, Candidate, label_class
from foc_ros.core.types import Array, HandState, Record

from .guess import compute_path_lengths, time_paths
from .search import Search
from .sides import find_path_sides

NEAR = 0.02
"""Largest distance of an obstacle or a goal from its place in the demonstration [m]."""
POINTS = 65
"""Number of points of a demonstrated path."""
STEP_S, MOST_STATES = 0.05, 400
"""Time from one state of a recording to the next [s], and the largest number of states."""
DIGITS = 6
"""Decimals of the coordinates: a micrometre is exact enough and keeps the file small."""


@dataclass(frozen=True, eq=False)
class Demonstration(Record):
    """A demonstrated path (m, 2) [m] in a frame, and the obstacles that it passed: ids, sides and centre (n, 2) [m].

    states (t, 4): x, y, vx, vy [m, m/s] of the hand every STEP_S, as they were estimated, from before the path to after it; None
    for a class that is only recalled.
    """

    frame_id: str
    ids: tuple[str, ...]
    sides: tuple[int, ...]
    centre: Array
    path: Array
    states: Array | None = None

    def matches(self, frame_id: str, obstacles: Obstacles) -> bool:
        """Tell whether all obstacles that the path passed are present, by id, within NEAR of where they were.

        An empty frame, as that of a `Predictor` by default, is that of the demonstration.
        """
        rows = {identity: row for row, identity in enumerate(obstacles.ids)}
        if frame_id not in ('', self.frame_id) or not rows.keys() >= set(self.ids):
            return False
        return _is_near(obstacles.centre[[rows[identity] for identity in self.ids]], self.centre)

    @cached_property
    def passing(self) -> NDArray[np.intp]:
        """Rows of the states (n,) that are nearest to the n obstacles."""
        nearest: NDArray[np.intp] = np.hypot(*self._offsets.transpose(2, 0, 1)).argmin(axis=0)
        return nearest

    @cached_property
    def rest_sides(self) -> NDArray[np.int8]:
        """LEFT or RIGHT (t, n), on which the path from each state to the goal passes the n obstacles."""
        assert self.states is not None
        turns = np.unwrap(np.arctan2(self._offsets[..., 1], self._offsets[..., 0]), axis=0)
        at_goal = int(np.hypot(*(self.states[:, :2] - self.path[-1]).T).argmin())
        return np.where(turns[at_goal] - turns < 0.0, LEFT, RIGHT).astype(np.int8)

    @property
    def _offsets(self) -> Array:
        assert self.states is not None
        offsets: Array = self.states[:, None, :2] - self.centre
        return offsets


class GuessTiming(NamedTuple):
    """The time to go to each goal (g,) [s], and the number N of time steps."""

    durations_s: Sequence[float]
    steps: int


def record_demonstration(frame_id: str, path: Array, obstacles: Obstacles, states: Array | None = None) -> Demonstration:
    """Record a path (m, 2) [m], m >= 2, as POINTS points at equal distances, with the sides on which it passes the obstacles.

    states (t, 4): those of the hand every STEP_S [m, m/s], if they are to be kept.
    """
    length = compute_path_lengths(path)
    at = np.linspace(0.0, length[-1], POINTS)
    evenly = np.column_stack([np.interp(at, length, axis) for axis in path.T]).round(DIGITS)
    sides = find_path_sides(evenly, obstacles)
    ids = tuple(sorted(sides))
    centre = obstacles.centre[[obstacles.ids.index(identity) for identity in ids]]
    passed = frame_id, ids, tuple([sides[identity] for identity in ids]), centre.round(DIGITS)
    return Demonstration(*passed, evenly, None if states is None else states.round(5))  # there are many


def is_same_demonstration(one: Demonstration, other: Demonstration) -> bool:
    """Tell whether two demonstrations agree in frame, obstacles, sides and end."""
    if (one.frame_id, one.ids, one.sides) != (other.frame_id, other.ids, other.sides):
        return False
    return _is_near(one.centre, other.centre) and _is_near(one.path[-1:], other.path[-1:])


def is_same_recording(one: Demonstration, other: Demonstration) -> bool:
    """Tell whether two demonstrations are the same movement: of one class, with equal states."""
    if one.states is None or other.states is None or not np.array_equal(one.states, other.states):
        return False
    return is_same_demonstration(one, other)


def recall_demonstrations(
    library: Sequence[Demonstration],
    hand: HandState,
    goals: Array,
    obstacles: Obstacles,
    timing: GuessTiming,
    found: Search,
) -> tuple[Candidate, ...]:
    """Return the candidates of a search and at most two demonstrated ones of other classes, in the order of their length.

    hand, goals (g, 2) [m] and obstacles: those of the search. A demonstrated path is moved to the present hand and goal. It is
    kept only if it still passes every obstacle on the side on which it did, and runs through none.
    """
    labels, recalled, names = {one.label for one in found.candidates}, [], found.named
    for demonstration in library:
        if not demonstration.matches(hand.frame_id, obstacles):
            continue
        shown = dict(zip(demonstration.ids, demonstration.sides, strict=True))
        for goal in np.flatnonzero(np.hypot(*(goals - demonstration.path[-1]).T) <= NEAR).tolist():
            if all(name in shown for name in names[goal]) and _name(goal, names[goal], shown)[0] in labels:
                continue
            rest = _deform(demonstration.path, hand.mean[:2], goals[goal])
            if rest is None or not is_free(rest, obstacles, 0.0):
                continue
            (guess,), (length,) = time_paths([rest], hand.mean[2:4], [timing.durations_s[goal]], timing.steps)
            sides = find_path_sides(guess, obstacles)
            if not sides.keys() >= set(names[goal]) or any(shown.get(name, side) != side for name, side in sides.items()):
                continue
            label, named = _name(goal, names[goal], sides)
            if label not in labels:
                labels.add(label)
                recalled.append(Candidate(label, goal, named, guess, length))
    if not recalled:
        return found.candidates

    def rank(candidate: Candidate) -> tuple[float, str]:
        return round(candidate.length, 9), candidate.label

    return tuple(sorted([*found.candidates, *sorted(recalled, key=rank)[:2]], key=rank))


def _name(goal: int, names: Sequence[str], sides: Mapping[str, int]) -> tuple[str, tuple[tuple[str, int], ...]]:
    """Return the label of a class, and the sides on which it passes the obstacles that are named in it."""
    named = tuple([(name, sides[name]) for name in names])
    return label_class(goal, named), named


def _deform(path: Array, hand: Array, goal: Array) -> Array | None:
    """Return the rest of a path from where it is nearest to the hand, with its ends moved to hand and goal (2,) [m].

    The result is None if the hand is farther than 0.1 m from the path, or at its end.
    """
    apart = np.hypot(*(path - hand).T)
    nearest = int(apart.argmin())
    if apart[nearest] > 0.1 or nearest == len(path) - 1:
        return None
    rest = path[nearest:]
    share = np.linspace(0.0, 1.0, len(rest))[:, None]
    moved: Array = rest + (1.0 - share) * (hand - rest[0]) + share * (goal - rest[-1])
    return moved


def _is_near(points: Array, others: Array) -> bool:
    """Tell whether all points (n, 2) lie within NEAR of others (n, 2) [m]."""
    return bool((np.hypot(*(points - others).T) <= NEAR).all())
