"""What is learnt of an operator's choices: whether the operator looks ahead or plans the whole way, and how precisely.

Before the first movement, the probability that the operator looks ahead (`likelihood`) is s = `likelihood.lookahead_share`. The
precision with which the losses of the classes are followed is a factor f on the logarithms of their weights: on
`likelihood.beta`, `likelihood.shortfall` and `likelihood.beta_beyond`, so that the solutions stay the same. When a movement has
ended, it is known which classes of each of its predictions agree with it: they pass the obstacles on the same sides and lead to
the goal that was reached. With P_t the probability that the prediction at time t gave to these classes, for an operator of the
kind z, who plans the whole way (0) or looks ahead (1),

    log w(z, f) = log(1 - s or s) - log^2 f / (2 `PRIOR_STDDEV`^2) + sum_movements mean_t log((1 - u) P_t(z, f) + u a_t),

which is a Bayesian posterior over both kinds and the grid `FACTORS`. A movement counts as one observation, because its
predictions depend on each other. A share u of the choices is not explained by losses: all classes are equally likely in it, and
a_t is the share of those that agree. The likelihood uses the posterior probability of z = 1 in place of s, and the posterior
mean of the logarithm of f.
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
from .judging import choose_judged, sample_movement

FACTORS = as_readonly(2.0 ** np.arange(-3.0, 4.0))
"""Factors that are judged."""
PRIOR_STDDEV = 0.7
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

    def score(self, agrees: NDArray[np.bool_], likelihood: LikelihoodConfig) -> Array:
        """Return the log-likelihoods (2, f) of the classes (k,) that agree, by operators who plan and who look ahead."""
        kinds = [[_scale(likelihood, factor, share) for factor in FACTORS.tolist()] for share in (0.0, 1.0)]
        found = [[self._sum_likelihoods(agrees, each) for each in kind] for kind in kinds]
        return np.asarray(np.log((1.0 - UNEXPLAINED) * np.array(found) + UNEXPLAINED * agrees.mean()))

    def _sum_likelihoods(self, agrees: NDArray[np.bool_], likelihood: LikelihoodConfig) -> float:
        shares = compute_likelihoods(self.costs, likelihood, self.branch_times, self.shortfalls, self.decisions)
        return float(shares @ agrees)


@dataclass(frozen=True, eq=False)
class Preferences(Record):
    """The choices of an operator so far.

    movements: how many were judged; scores (2, f): sums of their scores for operators who plan and who look ahead, by factor;
    states, choices: of the present movement.
    """

    movements: int = 0
    scores: Array = field(default_factory=lambda: np.zeros((2, len(FACTORS))))
    states: tuple[HandState, ...] = ()
    choices: tuple[Choice, ...] = ()

    def adapt(self, config: LikelihoodConfig) -> LikelihoodConfig:
        """Return the likelihood of this operator."""
        return _scale(config, *self.find_mean(config.lookahead_share)) if self.movements else config

    def find_mean(self, lookahead_share: float) -> tuple[float, float]:
        """Return the factor and the probability that the operator looks ahead, which was `lookahead_share` at first."""
        with np.errstate(divide='ignore'):  # what is certain has the logarithm -inf
            prior = np.log([[1.0 - lookahead_share], [lookahead_share]]) - 0.5 * (np.log(FACTORS) / PRIOR_STDDEV) ** 2
        logs = prior + self.scores
        weights = np.exp(logs - logs.max())
        planning, looking = weights.sum(axis=1)
        return float(np.exp(weights.sum(axis=0) @ np.log(FACTORS) / weights.sum())), float(looking / (planning + looking))

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
        scores = []
        for choice in choose_judged(self.choices):
            agrees = choice.find_agreeing(self.states)
            if agrees.any() and not agrees.all():
                scores.append(choice.score(agrees, config))
        return replace(self, movements=self.movements + 1, scores=self.scores + np.mean(scores, axis=0)) if scores else self


def _scale(config: LikelihoodConfig, factor: float, lookahead_share: float) -> LikelihoodConfig:
    """Return the likelihood with a factor on the logarithms of all weights, within the bounds, and another share."""
    scaled = {name: factor * getattr(config, name) for name in ('beta', 'shortfall', 'beta_beyond')}
    return clip_values(config, {**scaled, 'lookahead_share': lookahead_share})
