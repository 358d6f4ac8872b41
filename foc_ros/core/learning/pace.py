# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What is learnt of an operator: how they arrive, and the factor by which they take longer than the duration model expects.

Both arrivals, at rest and passing, with every factor f of `FACTORS` are judged by the positions that they would have led to. At a
time t of a movement, the time to go T_f(t) is estimated with all expected durations multiplied by f. Where the free movement to
the goal in T_f(t) would be h = `AHEAD_S` later is compared with where the hand x was then, relative to how far it had moved:

    l_f = c sum_t |x_f(t + h) - x(t + h)| / sum_t |x(t + h) - x(t)|.

A movement that has covered most of its distance to a goal counts with c = 1. In the present one, c is the distance of the hand
from the onset relative to that of the goal, at most 1, and the goal is the one for which the least loss is smallest.

With sigma of `duration.spread`, or `LEAST_SPREAD`, c of `PRECISION` and w = 3 nat for the arrival that `duration.arrival` does
not name, the posterior of arrival and factor is

    log P = -(log f / sigma)^2 / 2 - w - c sum l_f.

The factor in use is its mean, of the logarithm, with the likelier arrival: without movements it is 1, and both adapt in the
course of a few, the sooner the less is known of the durations. The arrival changes between movements only. They depend on the
samples and goals alone, so that equal input gives equal factors.

The free movement has the least integral of squared jerk, and begins at the velocity v without acceleration, as predictions do.
After the share s = h / T of its time it has come to

    x_f = x + p(s) (goal - x) + q(s) T v,
    p = 10 s^3 - 15 s^4 + 6 s^5,           q = s - 6 s^3 + 8 s^4 - 3 s^5   if it comes to rest at the goal,
    p = (20 s^3 - 15 s^4 + 3 s^5) / 8,     q = s - p                       if it passes the goal at any velocity.

The time to go itself is no good measure: people slow down before their goal, or move at a constant speed, and a plan of least
jerk is nearest to them with another duration than theirs.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import lru_cache

import numpy as np

from foc_ros.core.config import ARRIVALS, DurationConfig
from foc_ros.core.hand.duration import estimate_times_to_go, is_passing, scale_durations
from foc_ros.core.types import NANOSECONDS, Array, HandState, Record, as_readonly

from .movements import find_goal_at_end, has_covered_distance
from .posterior import GridPosterior

LOG_FACTORS = as_readonly(np.linspace(-1.6, 1.6, 17))
FACTORS = as_readonly(np.exp(LOG_FACTORS))
"""Factors that are judged."""
PRECISION = 31.0
"""By how much the logarithm of the probability falls per unit of the loss of a movement."""
LEAST_SPREAD = 0.2
"""Least standard deviation of the logarithm of the factor before the first movement: durations of one session may be alike, and a
fit to it finds no spread."""
AHEAD_S = 0.5
"""How far ahead positions are judged [s]."""
SAMPLE_S = 0.1
"""Interval at which states of a movement are judged [s]."""


@dataclass(frozen=True, eq=False)
class PresentMovement(Record):
    """The movement of the hand that has not ended yet.

    onset (2,): where it began [m]; goals (g, 2) [m]; hand: its newest state; waiting: states that are to be judged when the hand
    has moved on; errors (g, 2, f), moved (g,): sums [m] of the states that were judged, with each goal, arrival and factor.
    """

    onset: Array
    goals: Array
    hand: HandState
    waiting: tuple[HandState, ...]
    errors: Array
    moved: Array

    @classmethod
    def begin(cls, hand: HandState, goals: Array) -> PresentMovement:
        """Return a movement of which one state is known."""
        onset = hand.mean[:2] if hand.onset_position is None else hand.onset_position
        return cls(onset, goals, hand, (hand,), np.zeros((len(goals), len(ARRIVALS), len(FACTORS))), np.zeros(len(goals)))

    def follow(self, hand: HandState, goals: Array, config: DurationConfig) -> PresentMovement:
        """Return the movement after its next state, which is judged later if it is `SAMPLE_S` after the one before it."""
        followed = replace(self if goals is self.goals else self.match(goals), hand=hand)
        while hand.stamp_ns - followed.waiting[0].stamp_ns >= AHEAD_S * NANOSECONDS and len(followed.waiting) > 1:
            followed = followed.judge_oldest(config)
        if hand.stamp_ns - followed.waiting[-1].stamp_ns < SAMPLE_S * NANOSECONDS:
            return followed
        return replace(followed, waiting=(*followed.waiting, hand))

    def match(self, goals: Array) -> PresentMovement:
        """Return the movement with other goals (g, 2) [m], which keep the errors of those within 50 mm of them."""
        distances = np.linalg.norm(goals[:, None] - self.goals, axis=-1)
        rows, is_same = distances.argmin(axis=1), distances.min(axis=1) <= 0.05
        errors, moved = self.errors[rows] * is_same[:, None, None], self.moved[rows] * is_same
        return replace(self, goals=goals, errors=as_readonly(errors), moved=as_readonly(moved))

    def end(self, goal: int, config: DurationConfig) -> PresentMovement:
        """Return the movement with only the goal of a row, and all its states judged: the last ones by where it ended."""
        rows = slice(goal, goal + 1)
        ended = replace(self, goals=self.goals[rows], errors=self.errors[rows], moved=self.moved[rows])
        while ended.waiting and ended.waiting[0].stamp_ns < ended.hand.stamp_ns:
            ended = ended.judge_oldest(config)
        return ended

    def judge_oldest(self, config: DurationConfig) -> PresentMovement:
        """Return the movement with the errors of its oldest waiting state, by where the hand has come since."""
        hand, *later = self.waiting
        path = (*self.waiting, self.hand)
        seconds = np.array([(each.stamp_ns - hand.stamp_ns) / NANOSECONDS for each in path])
        ahead_s = min(AHEAD_S, float(seconds[-1]))
        reached = np.array([np.interp(ahead_s, seconds, [each.mean[axis] for each in path]) for axis in (0, 1)])
        left, left_before = (np.linalg.norm(self.goals - each, axis=1) for each in (reached, hand.mean[:2]))
        rows = np.sort((left - left_before).argsort(kind='stable')[:8])  # the goals that the hand has come nearer to most
        goals, errors, moved = self.goals[rows], self.errors.copy(), self.moved.copy()
        for row, scaled in enumerate(_scale_all(config)):
            times = np.array([estimate_times_to_go(hand, goals, each) for each in scaled]).T
            expected = find_free_positions(hand.mean[:4], goals[:, None], times, ahead_s, is_passing(scaled[0]))
            errors[rows, row] += np.linalg.norm(expected - reached, axis=-1)
        moved[rows] += float(np.linalg.norm(reached - hand.mean[:2]))
        return replace(self, waiting=tuple(later), errors=as_readonly(errors), moved=as_readonly(moved))

    def compute_losses(self) -> Array:
        """Return the losses c sum |x_f - x| / sum |x(t + h) - x(t)|, (2, f), of the movement so far; zero if it did not move.

        The goal is one with which at least half as much was judged as with any other.
        """
        if not self.moved.any():
            return np.zeros(self.errors.shape[1:])
        judged = np.flatnonzero(self.moved >= 0.5 * self.moved.max())
        goal = int(judged[(self.errors[judged].min(axis=(1, 2)) / self.moved[judged]).argmin()])
        covered, whole = (float(np.linalg.norm(each - self.onset)) for each in (self.hand.mean[:2], self.goals[goal]))
        losses: Array = self.errors[goal] / self.moved[goal] * (min(covered / whole, 1.0) if whole else 1.0)
        return losses


@dataclass(frozen=True, eq=False)
class Pace(Record):
    """The pace and arrival of an operator.

    movements: how many ended and counted; losses (2, f): sum of their errors by `ARRIVALS` and factor; present: the movement that
    has not ended, None at rest.
    """

    movements: int = 0
    losses: Array = field(default_factory=lambda: np.zeros((len(ARRIVALS), len(FACTORS))))
    present: PresentMovement | None = None

    @property
    def is_known(self) -> bool:
        """Whether any state of a movement was judged."""
        return self.movements > 0 or (self.present is not None and bool(self.present.moved.any()))

    def find_best(self, config: DurationConfig) -> tuple[str, float]:
        """Return the arrival, and the factor on expected durations, which is exactly 1 as long as nothing was judged."""
        if not self.is_known:
            return config.arrival, 1.0
        axes, row = (np.arange(len(ARRIVALS), dtype=float), LOG_FACTORS), ARRIVALS.index(config.arrival)
        prior = GridPosterior.from_normal(axes, (np.inf, max(config.spread, LEAST_SPREAD)))
        posterior = prior.add(-PRECISION * self.losses)
        if self.movements:
            is_other = np.array([[each != config.arrival] for each in ARRIVALS])
            row = int(posterior.add(-3.0 * is_other).weights().sum(axis=1).argmax())
        if self.present is not None:
            posterior = posterior.add(-PRECISION * self.present.compute_losses())
        return ARRIVALS[row], float(np.exp(posterior.given(row).mean()[0]))

    def adapt(self, config: DurationConfig) -> DurationConfig:
        """Return the durations of this operator."""
        arrival, factor = self.find_best(config)
        return replace(scale_durations(config, factor), arrival=arrival) if self.is_known else config

    def follow(self, hand: HandState, goals: Array | None, config: DurationConfig) -> Pace:
        """Return the pace after the next state of the hand; goals (g, 2) [m]; config: before it is adapted."""
        pace, present = self, self.present
        if present is not None and present.hand.onset_ns != hand.onset_ns:
            pace, present = self._end(present, config), None
        if hand.onset_ns is None or goals is None or not len(goals):
            return pace
        if present is None:
            return replace(pace, present=PresentMovement.begin(hand, goals))
        return replace(pace, present=present.follow(hand, goals, config))

    def interrupt(self) -> Pace:
        """Return the pace without the present movement."""
        return replace(self, present=None)

    def _end(self, present: PresentMovement, config: DurationConfig) -> Pace:
        """Return the pace after the end of a movement, which counts if it covered the distance to the goal nearest to its end."""
        path = np.vstack([present.onset, present.hand.mean[:2]])
        goal, _ = find_goal_at_end(path, present.goals)
        ended = present.end(goal, config)
        if not has_covered_distance(path, present.goals[goal]) or not ended.moved[0]:
            return self.interrupt()
        return Pace(self.movements + 1, as_readonly(self.losses + ended.errors[0] / ended.moved[0]))


@lru_cache(maxsize=4)
def _scale_all(config: DurationConfig) -> tuple[tuple[DurationConfig, ...], ...]:
    """Return the durations multiplied by each of `FACTORS`, for each of `ARRIVALS`."""
    scaled = [scale_durations(config, each) for each in FACTORS.tolist()]
    return tuple(tuple(replace(each, arrival=arrival) for each in scaled) for arrival in ARRIVALS)


def find_free_positions(start: Array, goal: Array, times: Array, seconds: float, passing: bool) -> Array:
    """Return the positions (..., f, 2) [m] some seconds later in movements of least jerk that reach a goal in times (..., f) [s].

    start (4,): position [m] and velocity [m/s]; goal (2,), or (..., 1, 2) [m]; passing: whether a movement passes the goal, or
    comes to rest there.
    """
    s = np.minimum(seconds / times, 1.0)[..., None]
    if passing:
        covered = (20.0 * s**3 - 15.0 * s**4 + 3.0 * s**5) / 8.0
        kept = s - covered
    else:
        covered = 10.0 * s**3 - 15.0 * s**4 + 6.0 * s**5
        kept = s - 6.0 * s**3 + 8.0 * s**4 - 3.0 * s**5
    positions: Array = start[:2] + covered * (goal - start[:2]) + kept * times[..., None] * start[2:]
    return positions
