"""What is learnt of an operator's choices: how precisely they follow the losses of the classes, in near and in far choices.

The logarithms of the weights of classes are multiplied by a factor f in near choices, and by f' in far ones (`likelihood`): f on
`likelihood.beta` and `likelihood.shortfall`, so that the solutions stay the same, and f' on `likelihood.beta_beyond`. When a
movement has ended, it is known which classes of each of its predictions agree with it: they pass the obstacles on the same sides
and lead to the goal that was reached. With P_t the probability that the prediction at time t gave to these classes,

    log w(f, f') = -(log^2 f + log^2 f') / (2 s^2) + sum_movements mean_t log((1 - u) P_t(f, f') + u a_t),

which is a Bayesian posterior over the grid `FACTORS` x `FACTORS`. A movement counts as one observation, because its predictions
depend on each other. A share u of the choices is not explained by losses: all classes are equally likely in it, and a_t is the
share of those that agree. The factors in use are the posterior means, of the logarithms.

The likelihoods need not be computed for each pair: with G the gaps of the next row (`decisions`), P = sum_G N_f(G) C_f'(G), where
N_f(G) is the probability of a gap, and C_f'(G) that of the classes that agree, among those through this gap.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from foc_ros.core.config import LikelihoodConfig, clip_values
from foc_ros.core.homotopy import find_path_sides
from foc_ros.core.homotopy.branch_times import BranchTimes
from foc_ros.core.homotopy.decisions import Decisions
from foc_ros.core.likelihood import compute_likelihoods
from foc_ros.core.types import NANOSECONDS, Array, HandState, Obstacles, Record, as_readonly

from .goal_reached import find_chosen_goal
from .judging import choose_judged, compute_mean_factors, sample_movement

FACTORS = as_readonly(2.0 ** np.arange(-5.0, 6.0))
"""Factors that are judged, for near and for far choices."""
PRIOR_STDDEV = 1.5
"""Standard deviation of the logarithm of a factor before the first movement."""
UNEXPLAINED = 0.01
"""Share of choices that losses do not explain, as in the scores of `evaluate`."""


@dataclass(frozen=True, eq=False)
class Choice(Record):
    """A prediction among k classes, at least two, about obstacles and goals (g, 2) [m] at a stamp.

    onset_ns: when the movement of the hand began, None at rest; goal (k,): row of the goal of each class; sides: sides by id on
    which each passes obstacles; costs, shortfalls, branch_times, decisions: what `compute_likelihoods` takes.
    """

    stamp_ns: int
    onset_ns: int | None
    obstacles: Obstacles
    goals: Array
    goal: NDArray[np.intp]
    sides: tuple[Mapping[str, int], ...]
    costs: Array
    shortfalls: Array
    branch_times: BranchTimes | None
    decisions: Decisions

    def find_agreeing(self, states: Sequence[HandState]) -> NDArray[np.bool_]:
        """Tell which classes (k,) agree with the states of the hand until the end of the movement."""
        later = [each for each in states if each.stamp_ns >= self.stamp_ns] or [states[-1]]
        path = np.array([each.mean[:2] for each in later])
        seconds = np.array([(each.stamp_ns - self.stamp_ns) / NANOSECONDS for each in later])
        centres = self.obstacles.centre + seconds[:, None, None] * self.obstacles.velocity
        passed = find_path_sides(path, self.obstacles, centres).items()
        agrees = np.array([all(each.get(identity, side) == side for identity, side in passed) for each in self.sides])
        reached = find_chosen_goal(path[-1], self.goals)
        return agrees if reached is None else agrees & (self.goal == reached)

    def score(self, agrees: NDArray[np.bool_], likelihoods: Sequence[LikelihoodConfig]) -> Array:
        """Return the log-likelihood (m, m) of the classes (k,) that agree, by m configs for near choices and for far ones."""
        gap, near, beyond = self.decisions.next_gap, [], []
        for config in likelihoods:
            shares = compute_likelihoods(self.costs, config, self.branch_times, self.shortfalls, self.decisions)
            near.append(np.bincount(gap, shares))
            beyond.append(np.bincount(gap, agrees * shares) / np.maximum(near[-1], np.finfo(float).tiny))
        probability = np.array(near) @ np.array(beyond).T
        return np.asarray(np.log((1.0 - UNEXPLAINED) * probability + UNEXPLAINED * agrees.mean()))


@dataclass(frozen=True, eq=False)
class Preferences(Record):
    """The choices of an operator so far.

    movements: how many were judged; scores (f, f'): sums of their scores for each pair of factors; factors: for near and for far
    choices, exactly 1 before the first movement; states, choices: of the present movement.
    """

    movements: int = 0
    scores: Array = field(default_factory=lambda: np.zeros((len(FACTORS), len(FACTORS))))
    factors: tuple[float, float] = (1.0, 1.0)
    states: tuple[HandState, ...] = ()
    choices: tuple[Choice, ...] = ()

    def adapt(self, config: LikelihoodConfig) -> LikelihoodConfig:
        """Return the likelihood of this operator."""
        return _scale_exponents(config, *self.factors) if self.movements else config

    def follow(self, hand: HandState, config: LikelihoodConfig) -> Preferences:
        """Return the preferences after the next state of the hand; config: before it is adapted."""
        followed = self
        if self.states and self.states[-1].onset_ns not in (None, hand.onset_ns):
            followed = self._judge(config).interrupt()
        if hand.onset_ns is None:
            return replace(followed, states=(hand,))
        states = sample_movement(followed.states, hand)
        return followed if states is followed.states else replace(followed, states=states)

    def add(self, choice: Choice | None) -> Preferences:
        """Return the preferences after a prediction in the present movement, or at rest, where the last one before it counts.

        A prediction takes time: one that began at rest may end in the movement, and one of an earlier movement comes too late.
        """
        if choice is None or not self.states or choice.onset_ns not in (None, self.states[-1].onset_ns):
            return self
        return replace(self, choices=(choice,) if choice.onset_ns is None else sample_movement(self.choices, choice))

    def interrupt(self) -> Preferences:
        """Return the preferences without the present movement."""
        return replace(self, states=(), choices=())

    def _judge(self, config: LikelihoodConfig) -> Preferences:
        """Return the preferences after the end of the present movement, which counts if it decided between classes."""
        scaled, scores = [_scale_exponents(config, each, each) for each in FACTORS.tolist()], []
        for choice in choose_judged(self.choices):
            agrees = choice.find_agreeing(self.states)
            if agrees.any() and not agrees.all():
                scores.append(choice.score(agrees, scaled))
        if not scores:
            return self
        total = self.scores + np.mean(scores, axis=0)
        factors = compute_mean_factors(np.log(FACTORS), total, PRIOR_STDDEV)
        return replace(self, movements=self.movements + 1, scores=total, factors=factors)


def _scale_exponents(config: LikelihoodConfig, near: float, beyond: float) -> LikelihoodConfig:
    """Return the likelihood with factors on the logarithms of the weights, by near and by far choices, within the bounds."""
    scaled = {'beta': near * config.beta, 'shortfall': near * config.shortfall, 'beta_beyond': beyond * config.beta_beyond}
    return clip_values(config, scaled)
