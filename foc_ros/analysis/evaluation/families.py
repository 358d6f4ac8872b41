"""The predictors that are compared, with the settings among which each recording's are chosen by the others."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from itertools import product

import numpy as np

from foc_ros.core.config import LikelihoodConfig

from . import forecasts
from .forecasts import Forecast
from .heldout import Family
from .observations import Observation, Observations
from .questions import Question

PUBLISHED, REFITTED, PLAIN, UNIFORM = 'foc', 'foc, held out', 'foc, plain rule', 'uniform'
CONFIDENCES = (0.0, 0.05, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 0.95, 0.99)
POWERS = (0.25, 0.5, 0.75, 1.0, 1.5, 2.0, 3.0, 4.0, 6.0, 8.0, 12.0, 16.0, 24.0)
LOOKAHEADS_S = (0.25, 0.35, 0.5, 0.7, 1.0, 1.4)
RATES = tuple(float(rate) for rate in np.geomspace(0.01, 100.0, 25))
"""Inverse temperatures tried, in parts of one over the median effort to go."""


def baseline_grids(recordings: Sequence[Observations], published: LikelihoodConfig) -> tuple[Family, ...]:
    """Return all predictors; published: the parameters that the recordings were replayed with."""
    effort = float(np.median([seen.ways.to_go[seen.ways.solved].min() for each in recordings for seen in each.each]))
    return (
        Family(PUBLISHED, (None,), _published),
        Family(REFITTED, power_rules(published), _power_rule),
        Family(PLAIN, plain_rules(published), _power_rule),
        Family(UNIFORM, (None,), _uniform),
        Family('constant velocity', CONFIDENCES, partial(_guess, forecasts.constant_velocity)),
        Family('nearest gap', CONFIDENCES, partial(_guess, forecasts.nearest_gap)),
        Family('shortest path', CONFIDENCES, partial(_guess, forecasts.shortest_path)),
        Family('Boltzmann', tuple(rate / effort for rate in RATES), _boltzmann),
        Family('straight minimum jerk', tuple(product(POWERS, CONFIDENCES)), _straight),
    )


def plain_rules(published: LikelihoodConfig) -> tuple[LikelihoodConfig, ...]:
    """Return the exponents that are tried for ratios of whole costs, effort spent and to go, all choices alike."""
    return tuple(replace(published, beta=beta, spent_share=1.0, lookahead_s=0.0) for beta in POWERS)


def power_rules(published: LikelihoodConfig) -> tuple[LikelihoodConfig, ...]:
    """Return the parameters of the likelihood that are tried: the plain rules, and looking ahead."""
    return tuple(
        replace(published, beta=beta, spent_share=share, lookahead_s=seconds)
        for seconds, beta, share in product((0.0, *LOOKAHEADS_S), POWERS, (1.0, 0.0))
    )


def _published(seen: Observation, asked: Question, _: None) -> Forecast:
    return forecasts.of_shares(forecasts.published(seen), asked)


def _uniform(_: Observation, asked: Question, __: None) -> Forecast:
    return forecasts.uniform(asked)


def _power_rule(seen: Observation, asked: Question, config: LikelihoodConfig) -> Forecast:
    return forecasts.of_shares(forecasts.power_rule(seen, config), asked)


def _boltzmann(seen: Observation, asked: Question, rate: float) -> Forecast:
    return forecasts.of_shares(forecasts.boltzmann(seen, rate), asked)


def _straight(seen: Observation, asked: Question, setting: tuple[float, float]) -> Forecast:
    return forecasts.straight_minimum_jerk(seen, asked, *setting)


def _guess(guess: forecasts.Guess, seen: Observation, asked: Question, confidence: float) -> Forecast:
    return forecasts.of_guess(guess(seen, asked), confidence, asked)
