"""The predictors that `evaluate` compares, each with the settings among which cross-validation chooses.

Constant velocity, nearest gap and shortest path name one answer and get a confidence in it. A baseline is added from outside by
:func:`register_baseline`; the built-in ones are registered in the same way.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import product
from typing import Any

import numpy as np

from foc_ros.core.config import WHOLE_WAY_S, LikelihoodConfig
from foc_ros.core.likelihood import compute_likelihoods
from foc_ros.core.registry import Registry
from foc_ros.core.types import LEFT, RIGHT, Array

from .forecasts import Forecast, boltzmann_shares, power_rule_shares, published_shares
from .minimum_jerk import compute_straight_costs
from .observations import Observation, ObservedRecording
from .questions import GOAL, Answer, Question

PUBLISHED, REFITTED, PLAIN, UNIFORM, BOLTZMANN = 'foc', 'foc, held out', 'foc, plain rule', 'uniform', 'Boltzmann'
CONFIDENCES = (0.0, 0.05, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 0.95, 0.99)
POWERS = (0.25, 0.5, 0.75, 1.0, 1.5, 2.0, 3.0, 4.0, 6.0, 8.0, 12.0, 16.0, 24.0)
HORIZONS_S, LOOKAHEADS_S, POWERS_AHEAD, WEAVINGS = (
    (0.0, 1.5, 2.5),
    (0.0, 0.5, 1.0),
    (1.0, 2.0, 3.0, 5.0),
    (1.0, 4.0),
)
"""Values that are tried where near and far choices differ."""
RATES = tuple(float(rate) for rate in np.geomspace(0.01, 100.0, 25))
"""Inverse temperatures that are tried, in parts of one over the median effort to go."""

ForecastFunction = Callable[[Observation, Question, Any], Forecast]
SettingsFunction = Callable[[Sequence[ObservedRecording], LikelihoodConfig], tuple[Any, ...]]


@dataclass(frozen=True)
class Baseline:
    """A predictor and the settings among which cross-validation chooses for each recording.

    name: as in the tables and in `evaluate --json`; forecast: see :func:`register_baseline`; settings: any values.
    """

    name: str
    forecast: ForecastFunction
    settings: tuple[Any, ...]


BASELINES = Registry('baseline', {})


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
    BASELINES.register(name, partial(_make_baseline, name, forecast, settings))


def make_baselines(recordings: Sequence[ObservedRecording], published: LikelihoodConfig) -> tuple[Baseline, ...]:
    """Return all registered predictors; published: the parameters that the recordings were replayed with."""
    return tuple(BASELINES.get(name)(recordings, published) for name in BASELINES)


def _make_baseline(
    name: str,
    forecast: ForecastFunction,
    settings: Sequence[Any] | SettingsFunction,
    recordings: Sequence[ObservedRecording],
    published: LikelihoodConfig,
) -> Baseline:
    return Baseline(name, forecast, tuple(settings(recordings, published) if callable(settings) else settings))


def make_plain_rules(_: Sequence[ObservedRecording], published: LikelihoodConfig) -> tuple[LikelihoodConfig, ...]:
    """Return the exponents that are tried by which all choices are made."""
    return tuple(make_plain(published, beta) for beta in POWERS)


def make_power_rules(_: Sequence[ObservedRecording], published: LikelihoodConfig) -> tuple[LikelihoodConfig, ...]:
    """Return all parameters of the likelihood that are tried: one exponent for all choices, or near and far ones that differ."""
    ahead = (
        replace(make_ahead(published, horizon, seconds, beta), weaving=weaving)
        for horizon, seconds, beta, weaving in product(HORIZONS_S, LOOKAHEADS_S, POWERS_AHEAD, WEAVINGS)
    )
    return (*make_plain_rules((), published), *ahead)


def make_plain(likelihood: LikelihoodConfig, beta: float) -> LikelihoodConfig:
    """Return a likelihood by which all choices are made with one exponent."""
    return replace(likelihood, beta=beta, planning_horizon_s=WHOLE_WAY_S)


def make_ahead(likelihood: LikelihoodConfig, horizon_s: float, lookahead_s: float, beta: float) -> LikelihoodConfig:
    """Return a likelihood of an operator with a planning horizon."""
    return replace(likelihood, planning_horizon_s=horizon_s, lookahead_s=lookahead_s, beta=beta)


def is_plain(likelihood: LikelihoodConfig) -> bool:
    """Return whether all choices are made with one exponent."""
    return likelihood.planning_horizon_s == WHOLE_WAY_S


def make_boltzmann_rates(recordings: Sequence[ObservedRecording], _: LikelihoodConfig) -> tuple[float, ...]:
    """Return the inverse temperatures [s^5/m^2] that are tried."""
    tables = [each.candidates for recording in recordings for each in recording.observations]
    effort = float(np.median([table.cost_to_go[table.has_likelihood].min() for table in tables]))
    return tuple(rate / effort for rate in RATES)


def forecast_shares(
    shares: Callable[[Observation, Any], Array], observation: Observation, question: Question, setting: Any
) -> Forecast:
    """Forecast by the shares that a function gives to the candidates."""
    return Forecast.from_shares(shares(observation, setting), question)


def forecast_published(observation: Observation, question: Question, _: None) -> Forecast:
    """Forecast by the shares that the node publishes; those of ways and gaps are given that the goal was announced."""
    announced = 1.0 if question.name == GOAL else 1.0 - observation.other
    return Forecast.from_shares(published_shares(observation) / announced, question)


def forecast_uniform(_: Observation, question: Question, __: None) -> Forecast:
    """Give all possible answers the same probability."""
    return Forecast.uniform(question)


def forecast_straight_minimum_jerk(observation: Observation, question: Question, setting: tuple[float, float]) -> Forecast:
    """Weigh straight movements to the goals by the ratios of their efforts; setting: exponent, and confidence in the whole."""
    beta, confidence = setting
    shares = compute_likelihoods(compute_straight_costs(observation), LikelihoodConfig(beta=beta))
    by_answer = np.zeros(len(question.answers))
    for goal, share in enumerate(shares):
        toward_goal = observation.goals[goal] - observation.hand[:2]
        answer = (goal,) if question.name == GOAL else _answer_of_line(observation, question, toward_goal)
        if answer in question.answers:
            by_answer[question.answers.index(answer)] += share
    return Forecast.from_answer_shares(by_answer, question, 1.0 - confidence)


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
