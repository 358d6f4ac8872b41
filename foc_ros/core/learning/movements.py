# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Movements that are learnt while the hand moves: each one that ends at a goal is a demonstration, with the states of the hand.

A movement begins with its onset. It ends when the hand has been at rest for `AROUND_S`, when it moves on after a rest at a goal,
or when its samples begin anew; shorter rests at other places are part of it. It is learnt when it has ended, so that a prediction
depends on the past alone.

The states are those of the estimator at the multiples of `STEP_S` of the stamps, linear between two samples. They depend on the
samples and the scene alone, so that equal input gives equal demonstrations, live, replayed or learnt from a recording.

When a movement has reached a goal is decided here, for all learning, `evaluate` and `fit`. Three questions need three answers:
scores need the goal that the hand visited last, even if the recording goes on; a demonstration needs a path that ends at the
goal; durations need a movement that covered most of its distance.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from foc_ros.core.classes.library import MOST_STATES, STEP_S, Demonstration, record_demonstration
from foc_ros.core.errors import RecordingError
from foc_ros.core.scene import Scene
from foc_ros.core.types import NANOSECONDS, Array, HandState, Record

from .recordings import MOST_NEAR

AROUND_S = 1.0
"""Time before the onset and after the goal that a demonstration contains [s]: predictions near either end look that far."""
SHORTEST_M = 0.05
"""Least length of a movement that is learnt [m]."""
STEP_NS = round(STEP_S * NANOSECONDS)


@dataclass(frozen=True, eq=False)
class Movements(Record):
    """What was learnt of the movements so far, and the present one.

    learnt: demonstrations, the newest last; refused: number of movements that are no demonstration; refusal: the reason for the
    last of them; hand: its last state; states: the last ones, `STEP_S` apart, each a stamp [ns] with x, y, vx, vy then, (4,) [m,
    m/s]; onset_ns, ended_ns: when the present movement began, and came to rest; scene: of the last state that moved.
    """

    learnt: tuple[Demonstration, ...] = ()
    refused: int = 0
    refusal: str = ''
    hand: HandState | None = None
    states: tuple[tuple[int, Array], ...] = ()
    onset_ns: int | None = None
    ended_ns: int | None = None
    scene: Scene = field(default_factory=Scene)

    def follow(self, hand: HandState, scene: Scene, *, is_restart: bool) -> Movements:
        """Return the movements after the next state of the hand; is_restart: whether its filter began anew."""
        before = self.interrupt() if is_restart else self.finish() if self._is_over(hand) else self
        states, last = before.states, before.hand
        if last is not None:  # those that are due between the last sample and this one
            due = np.arange(last.stamp_ns // STEP_NS + 1, hand.stamp_ns // STEP_NS + 1) * STEP_NS
            share = (due - last.stamp_ns)[:, None] / (hand.stamp_ns - last.stamp_ns)
            between = (1.0 - share) * last.mean[:4] + share * hand.mean[:4]
            states = (*states, *zip(due.tolist(), between, strict=True))[-MOST_STATES:]
        if hand.onset_ns is not None:
            onset_ns = hand.onset_ns if before.onset_ns is None else before.onset_ns
            return replace(before, hand=hand, states=states, onset_ns=onset_ns, ended_ns=None, scene=scene)
        is_resting = before.onset_ns is None or before.ended_ns is not None
        return replace(before, hand=hand, states=states, ended_ns=before.ended_ns if is_resting else hand.stamp_ns)

    def interrupt(self) -> Movements:
        """Return the movements after the end of the present one, at which the samples of the hand end."""
        return replace(self.finish(), hand=None, states=())

    def finish(self) -> Movements:
        """Return the movements after the end of the present one, if there is one, which is learnt or refused."""
        if self.onset_ns is None:
            return self
        ended = replace(self, onset_ns=None, ended_ns=None)
        try:
            found = self._record()
        except RecordingError as error:
            return replace(ended, refused=self.refused + 1, refusal=str(error))
        return replace(ended, learnt=(*self.learnt, found)[-MOST_NEAR:])  # as many as count in one prediction

    def _is_over(self, hand: HandState) -> bool:
        """Tell whether the present movement had ended before the next state of the hand."""
        if self.hand is None or self.ended_ns is None:
            return False
        if hand.onset_ns is None:
            return hand.stamp_ns - self.ended_ns >= AROUND_S * NANOSECONDS
        goals = self.scene.goals
        return goals is not None and len(goals) > 0 and find_goal_at_end(self.hand.mean[None, :2], goals)[1] <= AT_GOAL_M

    def _record(self) -> Demonstration:
        """Return the present movement up to where it was nearest to its goal; raise RecordingError if it demonstrates nothing."""
        goals, hand = self.scene.goals, self.hand
        assert hand is not None and self.onset_ns is not None
        if goals is None or not len(goals):
            raise RecordingError('a movement without goals')
        if not self.scene.sources:
            raise RecordingError('a movement before the first message of obstacles')
        stamps = np.array([stamp for stamp, _ in self.states])
        states = np.array([state for _, state in self.states]).reshape(-1, 4)
        if len(stamps) == MOST_STATES and stamps[0] > self.onset_ns:
            raise RecordingError(f'expected a movement of at most {STEP_S * MOST_STATES - AROUND_S:g} s, got a longer one')
        first, beyond = np.searchsorted(stamps, [self.onset_ns, hand.stamp_ns if self.ended_ns is None else self.ended_ns + 1])
        path, length_m, distance_m, goal = states[first:beyond, :2].reshape(-1, 2), 0.0, np.inf, 0
        if len(path):
            path = path[: find_reached_goal(path, goals)[1] + 1]
            length_m = float(np.hypot(*np.diff(path, axis=0).T).sum())
            goal, distance_m = find_goal_at_end(path, goals)
        if length_m < SHORTEST_M or distance_m > AT_GOAL_M:
            wanted = f'expected a movement of at least {SHORTEST_M:g} m that ends within {AT_GOAL_M:g} m of a goal'
            raise RecordingError(f'{wanted}, got {length_m:.3g} m that end {distance_m:.3g} m from the nearest')
        around = round(AROUND_S / STEP_S)
        kept = states[max(first - around, 0) : first + len(path) + around]
        return record_demonstration(hand.frame_id, np.vstack([path, goals[goal]]), self.scene.obstacles(hand.stamp_ns), kept)


AT_GOAL_M = 0.05
"""A path that ends no farther from a goal than this ends at it [m]."""


ONSET_SPEED, PAUSE_S, LEAST_M = 0.05, 0.15, 0.03
"""Speed [m/s] above which the hand counts as moving, longest pause within a movement, and its least extent."""


def measure_speed(stamps_ns: NDArray[np.int64], positions: Array) -> Array:
    """Return the speed (n,) [m/s] of a hand at positions (n, 2) [m].

    These are central differences over an interval that suppresses sensor noise and is short beside a reach.
    """
    if not len(stamps_ns):
        return np.zeros(0)
    times = (stamps_ns - stamps_ns[0]) / NANOSECONDS
    begins, ends = (np.clip(times + shift, times[:1], times[-1:]) for shift in (-0.05, 0.05))
    moved = [np.interp(ends, times, axis) - np.interp(begins, times, axis) for axis in positions.T]
    speed: Array = np.hypot(*moved) / np.where(ends > begins, ends - begins, np.inf)
    return speed


def find_movements(stamps_ns: NDArray[np.int64], positions: Array) -> list[tuple[int, int]]:
    """Return start and end [ns] of every movement of a hand at positions (n, 2) [m]."""
    rows = np.flatnonzero(measure_speed(stamps_ns, positions) > ONSET_SPEED)
    breaks = np.flatnonzero(np.diff(stamps_ns[rows]) > PAUSE_S * NANOSECONDS)
    return [
        (int(stamps_ns[each[0]]), int(stamps_ns[each[-1]]))
        for each in np.split(rows, breaks + 1)
        if len(each) and np.ptp(positions[each[0] : each[-1] + 1], axis=0).max() > LEAST_M
    ]


def find_reached_goal(positions: Array, goals: Array) -> tuple[int | None, int]:
    """Find the goal that a path (m, 2) [m] reached, and the sample at which the path was nearest to it.

    Reached is the last of the goals (g, 2) [m] that the path came to within half of the distance to its nearest neighbour; a
    single goal is reached in any case. Returns None and the last sample where no goal was reached.
    """
    distance = np.hypot(*(positions[:, None] - goals).transpose(2, 0, 1))
    between = np.hypot(*(goals[:, None] - goals).transpose(2, 0, 1))
    np.fill_diagonal(between, np.inf)
    is_near = distance <= between.min(axis=1) / 2.0
    if not is_near.any():
        return None, len(positions) - 1
    last = int(np.flatnonzero(is_near.any(axis=1))[-1])
    goal = int(np.where(is_near[last], distance[last], np.inf).argmin())
    return goal, int(distance[:, goal].argmin())


def find_goal_at_end(positions: Array, goals: Array) -> tuple[int, float]:
    """Return the goal (g, 2) [m] nearest to the end of a path (m, 2) [m], and its distance [m], at most AT_GOAL_M if reached."""
    distance = np.hypot(*(goals - positions[-1]).T)
    goal = int(distance.argmin())
    return goal, float(distance[goal])


def has_covered_distance(positions: Array, goal: Array) -> bool:
    """Tell whether a path (m, 2) [m] came to within a quarter of its first distance from a goal (2,) [m]."""
    distance = np.hypot(*(positions - goal).T)
    return bool(distance.min() <= 0.25 * distance[0])
