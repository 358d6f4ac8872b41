# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Which goals an operator prefers, and where reaches end: hands stop at the near side of objects, and tools have a length.

A hand that begins to move at the distance d_i from where reaches to goal i end is expected to go there with the probability q_i,
which is proportional to d_i^(-2 beta). With the number n_i of reaches that ended at the goal, and the sum e_i of its q_i over the
reaches that ended at one, the likelihoods of its candidates get the weight

    w_i = (1 + c n_i) / (1 + c e_i),   c = `likelihood.past_goals`.

If reaches to a goal are Poisson events, w_i is the posterior mean of their rate relative to the expected one. The prior of this
ratio is a gamma distribution with the mean 1 and the variance c.

Two goals are the same if each is the only goal in the obstacle with the same id. Goals without such an obstacle are the same if
they lie within `SAME_M` of each other.

Reaches are expected to end at the mean displacement from their goal of the n earlier ones, times n / (n + `PRIOR_REACHES`).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np

from foc_ros.core.likelihood import normalise_logs
from foc_ros.core.obstacle_table import Obstacles
from foc_ros.core.obstacles.geometry import find_holders
from foc_ros.core.scene import Scene
from foc_ros.core.types import Array, HandState, Record

from .movements import find_goal_at_end

MOST_LEFT_M = 0.1
"""Largest distance from its goal at which a reach may end [m]: hands touch objects at their edges. A short reach has to cover
half of its way."""
MOST_GOALS, SAME_M, PRIOR_REACHES = 64, 0.02, 3
"""Number of goals that are remembered; distance within which two are the same [m]; number of reaches that the prior counts as."""


class KnownGoal(NamedTuple):
    """One goal: id of the obstacle that it is, or none; position (2,) [m]; how often it was reached, and was expected to be."""

    name: str | None
    position: Array
    reached: float = 0.0
    expected: float = 0.0


@dataclass(frozen=True, eq=False)
class PresentMovement(Record):
    """The movement of the hand that has not ended yet.

    onset_ns, onset (2,): when and where it began [m]; goals (g, 2) [m] with the names that they had then; position (2,): where
    the hand is now [m].
    """

    onset_ns: int
    onset: Array
    goals: Array
    names: tuple[str | None, ...]
    position: Array


@dataclass(frozen=True, eq=False)
class Habits(Record):
    """What earlier reaches say.

    known: the goals that were announced; present: the reach that has not ended, None at rest; reaches: number of those that ended
    at a goal; missed (2,): sum of the displacements of their ends from it [m].
    """

    known: tuple[KnownGoal, ...] = ()
    present: PresentMovement | None = None
    reaches: int = 0
    missed: Array = field(default_factory=lambda: np.zeros(2))

    def follow(self, hand: HandState, scene: Scene, beta: float) -> Habits:
        """Return the habits after the next state of the hand; beta: `likelihood.beta`."""
        habits, goals = self, scene.goals
        if self.present is not None and self.present.onset_ns != hand.onset_ns:
            habits = self._end(self.present, beta)
        if hand.onset_ns is None or hand.onset_position is None or goals is None or len(goals) < 2:
            return habits
        reach = habits.present
        if reach is None:
            names = name_goals(goals, scene.obstacles(hand.stamp_ns), scene.goal_objects)
            reach = PresentMovement(hand.onset_ns, hand.onset_position, goals, names, hand.mean[:2])
        return replace(habits, present=replace(reach, position=hand.mean[:2]))

    def interrupt(self) -> Habits:
        """Return the habits without the present reach."""
        return replace(self, present=None)

    def weigh(self, goals: Array, obstacles: Obstacles, objects: Sequence[str | None], past_goals: float) -> Array | None:
        """Return the weights w_i (g,) of goals (g, 2) [m], None where nothing is known; past_goals: c."""
        if not self.known or past_goals == 0.0:
            return None
        found = [self._find(*each) for each in zip(name_goals(goals, obstacles, objects), goals, strict=True)]
        return np.array([(1.0 + past_goals * each.reached) / (1.0 + past_goals * each.expected) for each in found])

    def find_ends(self, goals: Array) -> Array:
        """Return where reaches to goals (g, 2) [m] are expected to end, (g, 2) [m]."""
        return goals + self.missed / (self.reaches + PRIOR_REACHES)

    def _end(self, reach: PresentMovement, beta: float) -> Habits:
        """Return the habits after a reach, which counts if it ended at a goal."""
        goal, left = find_goal_at_end(reach.position[None], reach.goals)
        if left > min(MOST_LEFT_M, 0.5 * math.dist(reach.onset, reach.goals[goal])):
            return self.interrupt()
        first = np.hypot(*(self.find_ends(reach.goals) - reach.onset).T)
        expected = normalise_logs(-2.0 * beta * np.log(np.maximum(first, 1e-3)))  # a goal at the hand has a finite one
        before = [self._find(*each) for each in zip(reach.names, reach.goals, strict=True)]
        now = [
            KnownGoal(name, position, each.reached + (row == goal), each.expected + float(expected[row]))
            for row, (name, position, each) in enumerate(zip(reach.names, reach.goals, before, strict=True))
        ]
        others = [each for each in self.known if all(each is not other for other in before)]
        missed = self.missed + reach.position - reach.goals[goal]
        return Habits(tuple([*others, *now][-MOST_GOALS:]), None, self.reaches + 1, missed)

    def _find(self, name: str | None, position: Array) -> KnownGoal:
        """Return what is known of a goal, nothing where it is new."""
        same = (each for each in self.known if each.name == name)
        if name is None:
            same = (each for each in same if math.dist(each.position, position) <= SAME_M)
        return min(same, key=lambda each: math.dist(each.position, position), default=KnownGoal(name, position))


def name_goals(goals: Array, obstacles: Obstacles, objects: Sequence[str | None]) -> tuple[str | None, ...]:
    """Return for each of the goals (g, 2) [m] the id of the obstacle that it is alone in, None where there is none."""
    holds = find_holders(goals, obstacles, objects)
    alone = holds & (holds.sum(axis=0) == 1)
    return tuple(obstacles.ids[int(each.argmax())] if each.any() else None for each in alone)
