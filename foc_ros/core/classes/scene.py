# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The scene of a search: the obstacles near the hand and the goals, their graph, and the classes of the paths to each goal."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from foc_ros.core.config import HomotopyConfig
from foc_ros.core.deadline import Deadline
from foc_ros.core.obstacle_table import Obstacles
from foc_ros.core.obstacles.geometry import find_holders, measure_offsets
from foc_ros.core.obstacles.risk import centre_trajectories
from foc_ros.core.solution import LEFT, RIGHT, Candidate, Signature, label_class
from foc_ros.core.types import Array, as_readonly

from .graph import Graph, Lines, Rows, build_graph
from .guess import compute_path_lengths, time_paths
from .names import find_names, take_near
from .outlines import outline_obstacles
from .paths import PathQuery, find_shortest_paths
from .sides import find_sides

STATES, STATES_PER_CANDIDATE = 1000, 300
"""Number of states that the search for one goal may look at; a few dozen are enough for four candidates."""
OFF_HAND = 1e-9
"""A goal that lies on the hand is moved away by this much [m]."""


class PathClass(NamedTuple):
    """A homotopy class to a goal (row), represented by its shortest path.

    key, length plus what coasting adds [m], and label: by these, classes rank. sides: LEFT or RIGHT by id; points (m, 2) [m]: the
    path; known: the candidate of the previous prediction, where there was no time to find the class again.
    """

    key: float
    label: str
    goal: int
    sides: tuple[tuple[str, int], ...]
    points: Array
    known: Candidate | None = None

    @property
    def signature(self) -> Signature:
        """The obstacles in the name with their sides."""
        return frozenset(self.sides)

    @property
    def named(self) -> set[str]:
        """The ids of the obstacles in the name."""
        return {identity for identity, _ in self.sides}


class SearchScene:
    """A hand with its velocity, goals and obstacles; arguments as in `search.search`.

    A moving obstacle stands where it is when the hand is there: where a hand that moves straight to a goal comes nearest to it.

    Attributes
    ----------
    names : Names
        How the obstacles that are near count.
    known : list[PathClass]
        The classes of the previous prediction that still fit the scene and the steps, in the order of their length.
    notes : Counter[str]
        Counts of what is decided, see `search.Search`.
    """

    def __init__(
        self,
        hand_mean: Array,
        goals: Array,
        obstacles: Obstacles,
        config: HomotopyConfig,
        duration_s: Sequence[float],
        steps: int,
        previous: Sequence[Candidate],
        objects: Sequence[str | None] = (),
    ) -> None:
        self._hand, self._velocity = hand_mean[:4].astype(float).reshape(2, 2)
        is_on_hand = np.hypot(*(goals - self._hand).T) < OFF_HAND
        self._goals = np.where(is_on_hand[:, None], self._hand + np.array([OFF_HAND, 0.0]), goals)
        self._duration_s, self._steps = duration_s, steps
        self._now = take_near(obstacles, self._hand, self._goals)
        self._near = self._place_when_passed(self._now)
        kept = {*self._near.ids}
        self._others = obstacles.take([row for row, name in enumerate(obstacles.ids) if name not in kept])
        self._clearance, self._max_states = config.clearance, STATES + STATES_PER_CANDIDATE * config.max_candidates
        blocks = ~find_holders(goals, self._now, objects, duration_s)
        self.names = find_names(self._hand, self._goals, self._near, blocks, config.clearance, previous)
        ids, fitting = {*obstacles.ids}, [each for each in previous if each.goal < len(goals) and len(each.guess) == steps + 1]
        known = [PathClass(each.length, each.label, each.goal, each.sides, each.guess, each) for each in fitting]
        self.known = sorted([each for each in known if each.named <= ids], key=lambda each: each[:2])
        self.notes = Counter(
            hand_inside=int(self.names.holds_hand.sum()),
            goal_near=int((self.names.holds_goal & self.names.blocks).any(axis=1).sum()),
            goal_inside=int((~self.names.blocks).any(axis=1).sum()),
        )
        self._graphs: dict[bytes, tuple[Graph, Lines]] = {}

    def find_classes(self, goal: int, deadline: Deadline) -> Iterator[PathClass]:
        """Yield each class to a goal once, in the order of their rank; after the deadline, no more than a few."""
        rows = np.flatnonzero(self.names.blocks[goal])
        graph, hand = self._connect_hand(rows)
        lines, heuristic = _join_goal(graph, *self._goals[goal].tolist())
        named = np.flatnonzero(self.names.is_named[goal, rows])
        ids = [self._near.ids[row] for row in rows[named].tolist()]
        order = sorted(range(len(ids)), key=ids.__getitem__)
        query = PathQuery(graph, hand, lines, heuristic, named, self._velocity, self._max_states, deadline)
        # paths rank by their length to the nanometre: rounding errors do not decide between equal lengths
        for tied in find_shortest_paths(query, self.notes):
            classes = []
            for key, points, swept in tied:
                sides = tuple([(ids[row], LEFT if swept[row] < 0.0 else RIGHT) for row in order])
                classes.append(PathClass(round(key, 9), label_class(goal, sides), goal, sides, points))
            yield from [each for each in sorted(classes) if not self._is_left_out(each.points)]

    def list_named(self) -> tuple[tuple[str, ...], ...]:
        """Return for each goal the ids of the obstacles in the names of its classes, in alphabetical order."""
        rows = (np.flatnonzero(is_named).tolist() for is_named in self.names.is_named)
        return tuple([tuple(sorted([self._near.ids[row] for row in each])) for each in rows])

    def make_candidates(self, classes: Sequence[PathClass]) -> tuple[Candidate, ...]:
        """Return the candidates of classes, with their shortest paths as guesses for the time to go to each goal.

        Where obstacles move, a class is that in which the hand passes them when it is there: its guess decides, and of several
        classes that become the same one the first is returned.
        """
        made, durations_s = dict[str, Candidate](), [self._duration_s[each.goal] for each in classes]
        guesses, lengths = time_paths([each.points for each in classes], self._velocity, durations_s, self._steps)
        for each, guess, length in zip(classes, guesses, lengths, strict=True):
            candidate = each.known or Candidate(each.label, each.goal, each.sides, as_readonly(guess), length)
            if each.known is None and self._now.velocity.any():
                candidate = self._name_when_passed(candidate, self._duration_s[each.goal] / self._steps)
            made.setdefault(candidate.label, candidate)
        return tuple(made.values())

    def _place_when_passed(self, obstacles: Obstacles) -> Obstacles:
        """Return obstacles with their centres where a hand that moves straight to a goal comes nearest to them."""
        if not obstacles.velocity.any():
            return obstacles
        offsets, nearest_s, straight = [], [], [np.stack((self._hand, goal)) for goal in self._goals]
        paths, _ = time_paths(straight, self._velocity, self._duration_s, self._steps)
        for path, duration_s in zip(paths, self._duration_s, strict=True):
            dt = duration_s / self._steps
            offset = path[:, None] - centre_trajectories(obstacles.centre, obstacles.velocity * dt, self._steps)
            change = np.diff(offset, axis=0)
            share = -(offset[:-1] * change).sum(axis=2) / np.maximum((change**2).sum(axis=2), np.finfo(float).tiny)
            share = np.clip(share, 0.0, 1.0)
            offsets.append(np.hypot(*(offset[:-1] + share[..., None] * change).transpose(2, 0, 1)))
            nearest_s.append(dt * (np.arange(self._steps)[:, None] + share))
        distance, at_s = np.concatenate(offsets), np.concatenate(nearest_s)
        passed_s = np.take_along_axis(at_s, distance.argmin(axis=0)[None], axis=0)[0]
        return replace(obstacles, centre=obstacles.centre + passed_s[:, None] * obstacles.velocity)

    def _name_when_passed(self, candidate: Candidate, dt: float) -> Candidate:
        """Return a candidate with the sides on which its guess, at steps of dt [s], passes the moving obstacles."""
        now, guess = self._now, candidate.guess
        centres = centre_trajectories(now.centre, now.velocity * dt, len(guess) - 1)
        passed = find_sides(guess[None], now, centres)[0]
        sides = tuple([(name, passed.get(name, side)) for name, side in candidate.sides])
        return replace(candidate, label=label_class(candidate.goal, sides), sides=sides)

    def _connect_hand(self, rows: Rows) -> tuple[Graph, Lines]:
        """Return the graph of the obstacles that block the paths to a goal, and the lines from the hand to its nodes."""
        key = rows.tobytes()
        if key not in self._graphs:
            shapes = self._near if len(rows) == len(self._near) else self._near.take(rows)
            graph = build_graph(outline_obstacles(shapes, self.names.radius[rows]))
            self._graphs[key] = graph, graph.join(self._hand)
        return self._graphs[key]

    def _is_left_out(self, points: Array) -> bool:
        """Tell, and count, whether a path meets obstacles that are not in the graph."""
        if not len(self._others):
            return False
        along = compute_path_lengths(points)
        at = np.linspace(0.0, along[-1], 257)
        _, distance = measure_offsets(np.column_stack([np.interp(at, along, axis) for axis in points.T]), self._others)
        is_met = bool((distance < self._others.radius + self._clearance - 1e-6).any())
        self.notes['left_out'] += is_met
        return is_met


@lru_cache(maxsize=128)
def _join_goal(graph: Graph, x: float, y: float) -> tuple[Lines, list[float]]:
    """Return the lines from a goal to the nodes of a graph, and the length of the shortest path from each node to it [m]."""
    lines = graph.join(np.array([x, y]))
    return lines, graph.measure_lengths(lines)
