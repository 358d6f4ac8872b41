"""What is learnt of an operator: the factor by which their movements take longer than the duration model expects.

When a movement has covered most of its distance to a goal, every factor f of `FACTORS` is judged by the mean error that it would
have had in this movement, relative to the duration D of the movement:

    l_f = mean_t |T_f(t) - T(t)| / D,

with the true time to go T(t) and the one T_f(t) that is estimated if all expected durations are multiplied by f. The factor in
use minimises log(f)^2 + sum l_f over the movements so far, as a regularised leader (Shalev-Shwartz 2012, Foundations and Trends
in Machine Learning 4(2)): without movements it is 1, and it adapts in the course of about ten. It depends on the samples and
goals alone, so that equal input gives equal factors.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Protocol, TypeVar

import numpy as np

from foc_ros.core.config import DurationConfig
from foc_ros.core.types import NANOSECONDS, Array, HandState, Record, as_readonly

from .duration import estimate_times_to_go, scale_durations

FACTORS = as_readonly(np.exp(np.linspace(0.0, 1.6, 17)))
"""Factors that are judged. With those below 1, free hands that stop short of their goal have worse positions (doc/people.md)."""
REMAINING_SHARE = 0.25
"""A movement that leaves no more than this share of its first distance to a goal has covered the distance."""
SAMPLE_S = 0.05
"""Interval at which states of a movement are kept [s]."""
MOST_STATES, JUDGED = 1000, 10
"""Numbers of states of a movement that are kept and, spread evenly over it, judged at most."""
LEAST_LEFT_S = 0.1
"""Least time to the end of a state that is judged, because the end itself is known no better [s]."""

T = TypeVar('T')
S = TypeVar('S', bound='Stamped')


class Stamped(Protocol):
    """What belongs to a stamp [ns]."""

    @property
    def stamp_ns(self) -> int:
        """The stamp [ns]."""


def sample_movement(kept: tuple[S, ...], following: S) -> tuple[S, ...]:
    """Return what is kept of a movement after what follows in it, at most `MOST_STATES` that are `SAMPLE_S` apart."""
    if len(kept) >= MOST_STATES or (kept and following.stamp_ns - kept[-1].stamp_ns < SAMPLE_S * NANOSECONDS):
        return kept
    return (*kept, following)


def choose_judged(kept: Sequence[T]) -> list[T]:
    """Return at most `JUDGED` of what was kept of a movement, spread evenly over it."""
    return [kept[row] for row in np.unique(np.linspace(0, len(kept) - 1, min(JUDGED, len(kept))).astype(int))]


@dataclass(frozen=True, eq=False)
class Operator(Record):
    """The movements of an operator so far.

    movements: how many were judged; losses (f,): sum of the errors of each factor, with the prior; states: of the present
    movement.
    """

    movements: int = 0
    losses: Array = field(default_factory=lambda: np.log(FACTORS) ** 2)
    states: tuple[HandState, ...] = ()

    @property
    def duration_factor(self) -> float:
        """The factor on expected durations; exactly 1 before the first movement."""
        return float(FACTORS[self.losses.argmin()]) if self.movements else 1.0

    def adapt(self, config: DurationConfig) -> DurationConfig:
        """Return the durations of this operator."""
        return scale_durations(config, self.duration_factor) if self.movements else config

    def follow(self, hand: HandState, goals: Array | None, config: DurationConfig) -> Operator:
        """Return the operator after the next state of the hand; goals (g, 2) [m]; config: before it is adapted."""
        operator = self
        if self.states and self.states[0].onset_ns != hand.onset_ns:
            operator = replace(self, states=()) if goals is None or not len(goals) else self._judge(goals, config)
        if hand.onset_ns is None:
            return operator
        states = sample_movement(operator.states, hand)
        return operator if states is operator.states else replace(operator, states=states)

    def _judge(self, goals: Array, config: DurationConfig) -> Operator:
        """Return the operator after the end of the present movement, which counts if it covered the distance to a goal."""
        path, ended = np.array([each.mean[:2] for each in self.states]), replace(self, states=())
        first, onset_ns = self.states[0].onset_position, self.states[0].onset_ns
        assert first is not None and onset_ns is not None
        goal = goals[int(np.hypot(*(goals - path[-1]).T).argmin())]
        distance = np.hypot(*(path - goal).T)
        end_ns = self.states[int(distance.argmin())].stamp_ns
        left = [(each, (end_ns - each.stamp_ns) / NANOSECONDS) for each in self.states]
        judged = [(each, seconds) for each, seconds in left if seconds > LEAST_LEFT_S]
        if not judged or distance.min() > REMAINING_SHARE * float(np.hypot(*(first - goal))):
            return ended
        judged = choose_judged(judged)
        scaled = [scale_durations(config, factor) for factor in FACTORS.tolist()]
        errors = [[abs(estimate_times_to_go(hand, goal[None], each)[0] - seconds) for hand, seconds in judged] for each in scaled]
        losses = self.losses + np.mean(errors, axis=1) * NANOSECONDS / (end_ns - onset_ns)
        return replace(ended, movements=self.movements + 1, losses=as_readonly(losses))
