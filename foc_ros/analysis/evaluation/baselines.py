# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The predictors that `evaluate` compares, each with the settings among which cross-validation chooses, and their forecasts.

What a predictor leaves over, such as the unknown share, is spread evenly over the possible answers. Every predictor leaves at
least `UNCERTAINTY`, so that an answer that no candidate gives is unlikely, not impossible. Straight minimum jerk is the movement
to a goal, obstacles disregarded.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import product
from typing import Any, NamedTuple

import numpy as np
from scipy.interpolate import BPoly
from scipy.special import softmax

from foc_ros.core.config import WHOLE_WAY_S, LikelihoodConfig
from foc_ros.core.goals import compute_straight_effort
from foc_ros.core.likelihood import OWN_SPREAD, ClassGoals, compute_likelihoods
from foc_ros.core.registry import Registry
from foc_ros.core.solution import LEFT, RIGHT
from foc_ros.core.types import Array, Record

from .observations import GOAL, Answer, Observation, ObservedRecording, Question

UNCERTAINTY = 0.01
PUBLISHED, REFITTED, PLAIN, UNIFORM, BOLTZMANN = 'foc', 'foc, held out', 'foc, plain rule', 'uniform', 'Boltzmann'
CONFIDENCES = (0.0, 0.05, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 0.95, 0.99)
POWERS = (0.25, 0.5, 0.75, 1.0, 1.5, 2.0, 3.0, 4.0, 6.0, 8.0, 12.0, 16.0, 24.0)
BASELINES = Registry('baseline', {})


@dataclass(frozen=True, eq=False)
class Forecast(Record):
    """Probabilities of the m answers of a question (m,); each_other: of each possible answer that is not listed."""

    probability: Array
    each_other: float

    @classmethod
    def from_shares(cls, shares: Array, question: Question) -> Forecast:
        """Sum shares (k,) of all candidates by the answers that they give."""
        by_answer = np.bincount(question.given, shares, len(question.answers)).astype(float)
        total = float(by_answer.sum())
        even = by_answer / total if total > 0.0 else by_answer
        return cls.from_answer_shares(even, question, 1.0 - (1.0 - UNCERTAINTY) * min(total, 1.0))

    @classmethod
    def from_answer(cls, answer: Answer, confidence: float, question: Question) -> Forecast:
        """Give one answer a confidence in [0, 1 - UNCERTAINTY]."""
        named = np.array([float(each == answer) for each in question.answers])
        return cls.from_answer_shares(named, question, 1.0 - confidence)

    @classmethod
    def from_answer_shares(cls, shares: Array, question: Question, rest: float) -> Forecast:
        """Give the answers their shares (m,) of 1 - rest, and spread the rest evenly over the possible answers."""
        each = rest / question.possible
        return cls((1.0 - rest) * shares + each * question.is_possible, each)

    def true_probability(self, question: Question) -> float:
        """Return the probability of the true answer."""
        return float(self.probability[question.truth])


def power_rule_shares(observation: Observation, config: LikelihoodConfig) -> Array:
    """Return the shares (k,) that the node would publish to a known operator with other parameters of the likelihood."""
    candidates = observation.candidates
    solved = candidates.has_likelihood
    time_s = float(candidates.time_s[solved].min()) if solved.any() else 0.0
    decided = candidates.branch_times.take(np.flatnonzero(solved)), candidates.safety_shortfall[solved], candidates.decisions
    goals = ClassGoals(candidates.goal[solved]) if len(observation.goals) > 1 else None
    shares = np.zeros(len(candidates))
    shares[solved] = compute_likelihoods(candidates.cost_to_go[solved], config, *decided, time_s, OWN_SPREAD, goals)
    return shares


def boltzmann_shares(observation: Observation, inverse_temperature: float) -> Array:
    """Return the maximum-entropy rule exp(-b J), (k,); b: inverse temperature [s^5/m^2]."""
    candidates = observation.candidates
    costs, shares = candidates.cost_to_go[candidates.has_likelihood], np.zeros(len(candidates))
    shares[candidates.has_likelihood] = softmax(-inverse_temperature * costs)
    return shares


def compute_straight_costs(observation: Observation) -> Array:
    """Return the cost [m^2/s^5] of the movement to each goal, (g,): the integral of squared jerk."""
    state, times_s = _find_movement(observation)
    return compute_straight_effort(state, observation.goals, times_s)


def compute_straight_positions(observation: Observation, goal: int, seconds: Array) -> Array:
    """Return the positions (h, 2) [m] of the movement to a goal some seconds (h,) from now; at the goal once it has ended."""
    state, times_s = _find_movement(observation)
    quintic = BPoly.from_derivatives([0.0, times_s[goal]], [state, [observation.goals[goal], np.zeros(2), np.zeros(2)]])
    return np.asarray(quintic(np.minimum(seconds, times_s[goal])))


def _find_movement(observation: Observation) -> tuple[Array, Array]:
    """Return position, velocity and acceleration (3, 2) of the hand, and the time (g,) [s] of its movement to each goal.

    Both are those of the predictor: at rest nothing but the position counts. The longest time stands where it found no path.
    """
    candidates, state = observation.candidates, observation.hand.reshape(3, 2).copy()
    if observation.movement_age_s == 0.0:
        state[1:] = 0.0
    times_s = np.full(len(observation.goals), candidates.time_s.max())
    times_s[candidates.goal[::-1]] = candidates.time_s[::-1]  # its first candidate decides
    return state, times_s


ForecastFunction = Callable[[Observation, Question, Any], Forecast]
SettingsFunction = Callable[[Sequence[ObservedRecording], LikelihoodConfig], tuple[Any, ...]]


class Baseline(NamedTuple):
    """A predictor by its name in tables and JSON, and the settings among which cross-validation chooses for each recording."""

    name: str
    forecast: ForecastFunction
    settings: tuple[Any, ...]


def register_baseline(name: str, forecast: ForecastFunction, settings: Sequence[Any] | SettingsFunction = (None,)) -> None:
    """Add a predictor to those that `evaluate` compares.

    Parameters
    ----------
    name
        A new name, for tables and JSON.
    forecast
        ``forecast(observation, question, setting) -> Forecast``, built by a class method of :class:`Forecast`. It may use
        all of the observation except its ``truth``, and of the question ``answers``, ``given`` and ``obstacles``. It has to be a
        function of a module, so that worker processes can import it.
    settings
        Values of ``setting`` that are tried, each something that JSON can hold or a dataclass of such things, or a function
        ``settings(recordings, likelihood_config)`` that returns them. Each recording is scored with the setting that is best for
        the other recordings.

    Raises
    ------
    InputError
        If the name is taken or empty.
    """
    BASELINES.register(name, (forecast, settings))


def make_baselines(recordings: Sequence[ObservedRecording], published: LikelihoodConfig) -> tuple[Baseline, ...]:
    """Return all registered predictors; published: the parameters that the recordings were replayed with."""
    parts = ((name, *BASELINES.get(name)) for name in BASELINES)
    return tuple(
        Baseline(name, forecast, tuple(settings(recordings, published) if callable(settings) else settings))
        for name, forecast, settings in parts
    )


def make_plain_rules(_: Sequence[ObservedRecording], published: LikelihoodConfig) -> tuple[LikelihoodConfig, ...]:
    """Return the exponents that are tried by which all choices are made."""
    return tuple(replace(published, beta=beta, planning_horizon_s=WHOLE_WAY_S) for beta in POWERS)


def make_power_rules(_: Sequence[ObservedRecording], published: LikelihoodConfig) -> tuple[LikelihoodConfig, ...]:
    """Return all parameters of the likelihood that are tried: one exponent for all choices, or near and far ones that differ."""
    ahead = (
        replace(published, planning_horizon_s=horizon_s, lookahead_s=lookahead_s, beta=beta, weaving=weaving)
        for horizon_s, lookahead_s, beta, weaving in product((0.0, 1.5, 2.5), (0.0, 0.5, 1.0), (1.0, 2.0, 3.0, 5.0), (1.0, 4.0))
    )
    return (*make_plain_rules((), published), published, *ahead)


def make_boltzmann_rates(recordings: Sequence[ObservedRecording], _: LikelihoodConfig) -> tuple[float, ...]:
    """Return the inverse temperatures [s^5/m^2] that are tried, in parts of one over the median effort to go."""
    tables = [each.candidates for recording in recordings for each in recording.observations]
    effort = float(np.median([table.cost_to_go[table.has_likelihood].min() for table in tables]))
    return tuple((np.geomspace(0.01, 100.0, 25) / effort).tolist())


def forecast_shares(
    shares: Callable[[Observation, Any], Array], observation: Observation, question: Question, setting: Any
) -> Forecast:
    """Forecast by the shares that a function gives to the candidates."""
    return Forecast.from_shares(shares(observation, setting), question)


def forecast_published(observation: Observation, question: Question, _: None) -> Forecast:
    """Forecast by the shares that the node publishes; those of ways and gaps are given that the goal was announced."""
    announced = 1.0 if question.name == GOAL else 1.0 - observation.other
    return Forecast.from_shares(observation.candidates.likelihood / announced, question)


def forecast_uniform(_: Observation, question: Question, __: None) -> Forecast:
    """Give all possible answers the same probability."""
    return Forecast.from_answer_shares(np.zeros(len(question.answers)), question, 1.0)


def forecast_straight_minimum_jerk(observation: Observation, question: Question, setting: tuple[float, float]) -> Forecast:
    """Weigh straight movements to the goals by the ratios of their efforts; setting: exponent, and confidence in the whole."""
    beta, confidence = setting
    shares, by_answer = compute_likelihoods(compute_straight_costs(observation), LikelihoodConfig(beta=beta)), Counter[Answer]()
    for goal, toward_goal in enumerate(observation.goals - observation.hand[:2]):
        answer = (goal,) if question.name == GOAL else _answer_of_line(observation, question, toward_goal)
        by_answer[answer] += shares[goal]
    return Forecast.from_answer_shares(np.array([by_answer[each] for each in question.answers]), question, 1.0 - confidence)


def forecast_answer(
    guess: Callable[[Observation, Question], Answer], observation: Observation, question: Question, confidence: float
) -> Forecast:
    """Give the answer that a function guesses a confidence."""
    return Forecast.from_answer(guess(observation, question), confidence, question)


def guess_shortest_path(observation: Observation, question: Question) -> Answer:
    """Name the answer of the shortest path."""
    return question.answers[question.given[int(observation.candidates.length.argmin())]]


def guess_constant_velocity(observation: Observation, question: Question) -> Answer:
    """Continue at the present velocity; a hand at rest goes straight ahead."""
    velocity = observation.hand[2:4] if observation.movement_age_s > 0.0 else observation.direction
    return _answer_of_line(observation, question, velocity)


def guess_nearest_gap(observation: Observation, question: Question) -> Answer:
    """Pass through the gap straight ahead, to the nearest goal."""
    if question.name == GOAL:
        return (int(np.hypot(*(observation.goals - observation.hand[:2]).T).argmin()),)
    return _answer_of_line(observation, question, observation.direction)


def _answer_of_line(observation: Observation, question: Question, velocity: Array) -> Answer:
    """Return the answer of a straight line from the hand: the goal nearest to its direction, or the sides that it takes."""
    hand = observation.hand[:2]
    if question.name == GOAL:
        goals = observation.goals - hand
        return (int((goals @ velocity / np.maximum(np.hypot(*goals.T), 1e-12)).argmax()),)
    offset = observation.centre[question.obstacles] - hand
    # a hand that does not advance leaves all obstacles on the side from which it came
    advance = max(float(velocity @ observation.direction), 1e-3 * float(np.hypot(*velocity)), 1e-12)
    is_left = (offset @ observation.direction) * float(velocity @ observation.left) / advance > offset @ observation.left
    return tuple(np.where(is_left, LEFT, RIGHT).tolist())


register_baseline(PUBLISHED, forecast_published)
register_baseline(REFITTED, partial(forecast_shares, power_rule_shares), make_power_rules)
register_baseline(PLAIN, partial(forecast_shares, power_rule_shares), make_plain_rules)
register_baseline(UNIFORM, forecast_uniform)
register_baseline('constant velocity', partial(forecast_answer, guess_constant_velocity), CONFIDENCES)
register_baseline('nearest gap', partial(forecast_answer, guess_nearest_gap), CONFIDENCES)
register_baseline('shortest path', partial(forecast_answer, guess_shortest_path), CONFIDENCES)
register_baseline(BOLTZMANN, partial(forecast_shares, boltzmann_shares), make_boltzmann_rates)
register_baseline('straight minimum jerk', forecast_straight_minimum_jerk, tuple(product(POWERS, CONFIDENCES)))
