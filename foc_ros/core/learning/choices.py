"""What is learnt of an operator's choices: how far ahead the operator plans, how precisely, and to which side reaches bend.

The planning horizon of an operator (`likelihood`) is h `likelihood.planning_horizon_s`, where h is a factor of `HORIZONS`. The
precision with which the losses of the classes are followed is a factor f of `FACTORS` on the logarithms of their weights: on
`likelihood.beta`, `likelihood.shortfall` and `likelihood.beta_beyond`, so that the solutions stay the same. When a movement has
ended, it is known which classes of each of its predictions agree with it: they pass the obstacles on the same sides and lead to
the goal that was reached. With P_t the probability that the prediction at time t gave to these classes,

    log w(h, f) = -log^2 h / (2 v^2) - log^2 f / (2 `PRIOR_STDDEV`^2) + sum_movements mean_t log((1 - u) P_t(h, f) + u a_t),

which is a Bayesian posterior over both factors. A movement counts as one observation, because its predictions depend on each
other. A share u of the choices is not explained by losses: all classes are equally likely in it, and a_t is the share of those
that agree. In P_t, the spread of the horizon is `OWN_SPREAD`, that of one operator from choice to choice. How operators differ is
the prior variance, v^2 = `likelihood.planning_spread`^2 - `OWN_SPREAD`^2. The likelihood uses the posterior means of the
logarithms of both factors, and as its spread the root of `OWN_SPREAD`^2 and the posterior variance of log h.

The heading bias b (`heading_bias`) has the posterior

    log w(b) = -(b - b0)^2 / (2 `HEADING_STDDEV`^2) + sum_movements mean_t log((1 - u) P_t(b) + u a_t),

with b0 = `likelihood.heading_bias`, and with horizon and precision as they were learnt before the movement. Its mean is used.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from foc_ros.core.classes import find_path_sides
from foc_ros.core.classes.rows import Decisions
from foc_ros.core.classes.sides import BranchTimes
from foc_ros.core.config import WHOLE_WAY_S, LikelihoodConfig, clip_values
from foc_ros.core.heading_bias import Reaches
from foc_ros.core.likelihood import compute_likelihoods, compute_lookahead_share
from foc_ros.core.types import NANOSECONDS, Array, HandState, Obstacles, Record, as_readonly

from .goal_reached import find_chosen_goal
from .judging import choose_judged, sample_movement

FACTORS = as_readonly(2.0 ** np.arange(-3.0, 4.0))
"""Factors on the precision that are judged."""
PRIOR_STDDEV = 0.7
"""Standard deviation of the logarithm of the precision before the first movement."""
HORIZONS = as_readonly(2.0 ** np.arange(-4.0, 4.5, 0.5))
"""Factors on the planning horizon that are judged."""
OWN_SPREAD = 0.3
"""Standard deviation of the logarithm of the planning horizon of one operator from choice to choice."""
HEADING_OFFSETS = as_readonly(np.linspace(-0.8, 0.8, 9))
"""Differences from the heading bias of the parameters that are judged [rad]."""
HEADING_STDDEV = 0.3
"""Standard deviation of the heading bias between operators [rad]."""
CERTAIN = 1e-12
"""Variance of the logarithm of a horizon that is known."""
UNEXPLAINED = 0.01
"""Share of choices that losses do not explain, as in the scores of `evaluate`."""


@dataclass(frozen=True, eq=False)
class Choice(Record):
    """A prediction among k classes, at least two, about obstacles and goals (g, 2) [m] at a stamp.

    onset_ns: when the movement of the hand began, None at rest; goal (k,): row of the goal of each class; sides: sides by id on
    which each passes obstacles; costs, shortfalls, branch_times, decisions, time_s, reaches: what `compute_likelihoods` takes.
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
    time_s: float
    reaches: Reaches | None

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
        """Return the log-likelihoods (h, f) of the classes (k,) that agree, by horizon and precision."""
        planned, ahead = (
            np.array([self._sum_likelihoods(agrees, _scale(likelihood, factor, horizon_s)) for factor in FACTORS.tolist()])
            for horizon_s in (WHOLE_WAY_S, 0.0)
        )
        spread = min(OWN_SPREAD, likelihood.planning_spread)
        horizons = [_scale(likelihood, 1.0, each * likelihood.planning_horizon_s, spread) for each in HORIZONS.tolist()]
        share = np.array([[compute_lookahead_share(self.time_s, each)] for each in horizons])
        return _compute_logs((1.0 - share) * planned + share * ahead, agrees)

    def score_biases(self, agrees: NDArray[np.bool_], biases: Array, likelihood: LikelihoodConfig) -> Array:
        """Return the log-likelihoods (b,) of the classes (k,) that agree, by bias (b,) [rad]; likelihood: of this operator."""
        biased = [replace(likelihood, heading_bias=each) for each in biases.tolist()]
        return _compute_logs(np.array([self._sum_likelihoods(agrees, each) for each in biased]), agrees)

    def _sum_likelihoods(self, agrees: NDArray[np.bool_], likelihood: LikelihoodConfig) -> float:
        decided = self.branch_times, self.shortfalls, self.decisions, self.time_s, self.reaches
        return float(compute_likelihoods(self.costs, likelihood, *decided) @ agrees)


@dataclass(frozen=True, eq=False)
class Preferences(Record):
    """The choices of an operator so far.

    movements: how many were judged; scores (h, f), bias_scores (b,): sums of their scores, by horizon and precision and by
    heading bias; states, choices: of the present movement.
    """

    movements: int = 0
    scores: Array = field(default_factory=lambda: np.zeros((len(HORIZONS), len(FACTORS))))
    bias_scores: Array = field(default_factory=lambda: np.zeros(len(HEADING_OFFSETS)))
    states: tuple[HandState, ...] = ()
    choices: tuple[Choice, ...] = ()

    def adapt(self, config: LikelihoodConfig) -> LikelihoodConfig:
        """Return the likelihood of this operator."""
        if not self.movements:
            return config
        return clip_values(_scale(config, *self.find_mean(config)), {'heading_bias': self.find_heading_bias(config)})

    def find_mean(self, config: LikelihoodConfig) -> tuple[float, float, float]:
        """Return the factor on the precision, the planning horizon [s] and its spread; config: before it is adapted."""
        log_horizons, log_factors = np.log(HORIZONS), np.log(FACTORS)
        between = math.sqrt(max(config.planning_spread**2 - OWN_SPREAD**2, CERTAIN))
        logs = self.scores - 0.5 * (log_horizons[:, None] / between) ** 2 - 0.5 * (log_factors / PRIOR_STDDEV) ** 2
        weights = _normalise(logs)
        by_horizon = weights.sum(axis=1)
        mean = float(by_horizon @ log_horizons)
        spread = math.sqrt(min(config.planning_spread, OWN_SPREAD) ** 2 + float(by_horizon @ (log_horizons - mean) ** 2))
        return float(np.exp(weights.sum(axis=0) @ log_factors)), config.planning_horizon_s * math.exp(mean), spread

    def find_heading_bias(self, config: LikelihoodConfig) -> float:
        """Return the heading bias [rad]; config: before it is adapted."""
        weights = _normalise(self.bias_scores - 0.5 * (HEADING_OFFSETS / HEADING_STDDEV) ** 2)
        return config.heading_bias + float(weights @ HEADING_OFFSETS)

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
        adapted, scores, bias_scores = self.adapt(config), list[Array](), list[Array]()
        biases, config = config.heading_bias + HEADING_OFFSETS, replace(config, heading_bias=adapted.heading_bias)
        for choice in choose_judged(self.choices):
            agrees = choice.find_agreeing(self.states)
            if agrees.any() and not agrees.all():
                scores.append(choice.score(agrees, config))
                bias_scores.append(choice.score_biases(agrees, biases, adapted))
        if not scores:
            return self
        added, bias_added = np.mean(scores, axis=0), np.mean(bias_scores, axis=0)
        judged = replace(self, movements=self.movements + 1, scores=self.scores + added)
        return replace(judged, bias_scores=self.bias_scores + bias_added)


def _compute_logs(found: Array, agrees: NDArray[np.bool_]) -> Array:
    """Return log((1 - u) P + u a) for likelihoods P, of any shape, of the classes (k,) that agree."""
    return np.asarray(np.log((1.0 - UNEXPLAINED) * found + UNEXPLAINED * agrees.mean()))


def _normalise(logs: Array) -> Array:
    """Return weights, of the same shape, that are proportional to exp(logs) and sum to one."""
    weights: Array = np.exp(logs - logs.max())
    return np.asarray(weights / weights.sum())


def _scale(config: LikelihoodConfig, factor: float, horizon_s: float, spread: float = OWN_SPREAD) -> LikelihoodConfig:
    """Return the likelihood with a factor on the logarithms of all weights, within the bounds, and another planning horizon."""
    scaled = {name: factor * getattr(config, name) for name in ('beta', 'shortfall', 'beta_beyond')}
    return clip_values(config, {**scaled, 'planning_horizon_s': horizon_s, 'planning_spread': spread})
