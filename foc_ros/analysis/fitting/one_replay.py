# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Parameters for which one replay of the recordings is enough: of the likelihood, and those that widen the covariance.

The latter, process noise, scatter of the end point and spread of the duration, change no plan. All of them are tried on
observations with the given ones, by the density of the true positions under the mixture of the candidates.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from functools import partial
from itertools import product

import numpy as np

from foc_ros.analysis.evaluation.baselines import Baseline, forecast_shares, power_rule_shares
from foc_ros.analysis.evaluation.observations import WIDENINGS, Observation, ObservedRecording, ask_main
from foc_ros.analysis.evaluation.positions import compute_log_densities, measure_inside
from foc_ros.analysis.evaluation.report import COVERAGE_LEVEL, COVERAGE_S
from foc_ros.analysis.evaluation.scores import compute_log_likelihoods
from foc_ros.analysis.evaluation.truth import HORIZONS
from foc_ros.analysis.parallel import collect_all
from foc_ros.core.config import WHOLE_WAY_S, Config, LikelihoodConfig, flatten, replace_values
from foc_ros.core.types import Array

from . import Findings, Setting, SettingTable, list_settings

RULES = tuple(
    LikelihoodConfig(beta=beta, planning_horizon_s=horizon_s, lookahead_s=lookahead_s)
    for horizon_s, lookahead_s, beta in (
        *product((WHOLE_WAY_S,), (0.0,), (0.5, 1.0, 2.0, 3.0, 6.0, 12.0)),
        *product((0.0, 2.5), (0.0, 0.5, 1.0), (1.0, 2.0, 3.0, 6.0)),
    )
)
"""The likelihoods of which each setting of the race gets its best. By a single one, settings that suit the others would lose."""
LIKELIHOODS = {
    'likelihood.beta': (0.5, 1.0, 2.0, 3.0, 4.0, 6.0, 10.0, 16.0),
    'likelihood.planning_horizon_s': (0.0, 1.5, 2.5),
    'likelihood.lookahead_s': (0.0, 0.25, 0.5, 1.0, 2.0),
    'likelihood.weaving': (0.0, 1.0, 2.0, 4.0, 8.0),
}
"""Values that are tried, and the given ones; of the exponent also without a planning horizon."""
PROCESS_NOISES = (0.0, *np.geomspace(0.01, 100.0, 33).tolist())
TRIED_WIDENINGS = {
    'foc.process_noise': PROCESS_NOISES,
    'foc.endpoint_stddev': (0.0, 1e-3, 2e-3, 3e-3, 4e-3, 6e-3, 8e-3, 12e-3, 16e-3, 24e-3, 32e-3, 48e-3, 72e-3, 0.11, 0.16),
    'duration.spread': (0.0, 0.1, 0.2, 0.3, 0.4, 0.6, 0.9),
}
"""Values that are tried, and the given ones: process noises [m/s^2.5] from far below the jerk density of the filter to that of a
hand in free motion; scatter of the end [m], of which Fitts' law expects 48 mm for a target of 0.2 m."""
FEW_WIDENINGS = tuple(product((0.0, *PROCESS_NOISES[1::4]), (0.0, 3e-3, 8e-3, 24e-3, 72e-3), (0.0, 0.2, 0.4)))
"""Widenings whose best is good enough to compare predictions that differ in other parameters."""


def fit_likelihood(recordings: Sequence[ObservedRecording], config: Config, stage: str) -> Findings:
    """Return the parameters of the likelihood, from one replay of the recordings.

    stage: words of a progress bar. Scores `ways`: mean log-likelihoods by how the setting was chosen, none where no class or
    goal is in question.
    """
    questions = [ask_main(each) for each in recordings]
    if not any(questions):
        reason = 'no recording has an obstacle to pass on one of two sides, or a second goal'
        return Findings(undetermined=dict.fromkeys(LIKELIHOODS, reason))
    before = flatten(config)
    given = {name: float(before[name]) for name in LIKELIHOODS}
    ahead = list_settings({name: (given[name], *tried) for name, tried in LIKELIHOODS.items()})
    betas = dict.fromkeys(each['likelihood.beta'] for each in ahead)
    plain = [{**given, 'likelihood.beta': beta, 'likelihood.planning_horizon_s': WHOLE_WAY_S} for beta in betas]
    settings = (*ahead, *plain)
    rules = [replace_values(config, each).likelihood for each in settings]
    rule = Baseline('foc', partial(forecast_shares, power_rule_shares), tuple(rules))
    rows = collect_all(partial(_tabulate_classes, rule=rule), [(each.name, each) for each in recordings], stage)
    table = SettingTable(np.array(rows), settings)
    found, left = table.estimate(given, 'likelihood of the paths taken')
    missed = float(np.mean([question.truth not in question.given for each in questions for _, question in each]))
    if missed > 0.1:
        words = 'the path taken is not among the candidates; the exponent is fitted to the others: raise homotopy.max_candidates'
        found.warnings.append(f'likelihood.beta: in {100 * missed:.0f} % of the predictions {words}')
    uniform = [np.mean([-np.log(question.possible) for _, question in each]) for each in questions if each]
    found.scores['ways'] = {'uniform': float(np.mean(uniform))}
    found.scores['ways'] |= {how: left.score(each) for how, each in left.list_choices(given).items()}
    return found


def _tabulate_classes(recording: ObservedRecording, rule: Baseline) -> Array:
    questions = ask_main(recording)
    return compute_log_likelihoods(questions, rule) / len(questions) if questions else np.full(len(rule.settings), np.nan)


def fit_widening(recordings: Sequence[ObservedRecording], config: Config) -> Findings:
    """Return the parameters that widen the covariance; scores: mean log-densities and coverage by how the widening was chosen."""
    before = flatten(config)
    given = {name: float(before[name]) for name in WIDENINGS}
    settings = list_settings({name: (0.0, given[name], *TRIED_WIDENINGS[name]) for name in WIDENINGS})
    widenings, rows = [tuple(each.values()) for each in settings], []
    for recording in recordings:
        densities = (
            compute_mean_densities(each, power_rule_shares(each, config.likelihood), widenings) for each in recording.observations
        )
        known = [each for each in densities if each is not None]
        rows.append(np.mean(known, axis=0) if known else np.full(len(settings), np.nan))
    table = SettingTable(np.array(rows), settings)
    found, left = table.estimate(given, 'density of true positions')
    none: Setting = dict.fromkeys(WIDENINGS, 0.0)
    chosen = {'motor noise alone': [none] * len(recordings)}
    chosen |= left.list_choices(given)
    found.scores = {'positions': {name: table.score(each) for name, each in chosen.items()}, 'inside_90': {}, 'inside_all_90': {}}
    for name, each in chosen.items():
        for kind, share in compute_coverage(recordings, config, each).items():
            found.scores[kind][name] = share
    return found


def compute_mean_densities(observation: Observation, shares: Array, widenings: Iterable[Sequence[float]]) -> Array | None:
    """Return the log-density of the true positions, the mean over the horizons, under each of the `WIDENINGS` (q,) [nat, metres].

    None where the movement ends before the first horizon, and of a hand at rest, which shows how long it waits, not how it moves.
    """
    if observation.movement_age_s == 0.0 or not shares.any() or np.isnan(observation.truth.positions[HORIZONS[0], 0]):
        return None
    densities = compute_log_densities(observation, shares, widen_covariances(observation, widenings))
    return np.asarray(np.nanmean(np.maximum(densities, -30.0), axis=1))  # one unexpected position does not rule the rest


def widen_covariances(observation: Observation, widenings: Iterable[Sequence[float]]) -> Array:
    """Return the covariance (q, k, 3, 2, 2) [m^2] of the candidates' positions at `HORIZONS_S` with each widening."""
    plain, widened = observation.candidates.plans[0], observation.candidates.plans[1:]
    return np.asarray(plain + np.tensordot(np.array(widenings) ** 2, widened - plain, 1))


def compute_coverage(
    recordings: Sequence[ObservedRecording], config: Config, chosen: Sequence[Setting]
) -> dict[str, float | None]:
    """Return the shares of true positions of moving hands in 90 % ellipses and regions after 0.5 s; chosen (n,): widenings."""
    moving = []
    for recording, setting in zip(recordings, chosen, strict=True):
        for each in recording.observations:
            if each.movement_age_s > 0.0:
                widened = widen_covariances(each, [tuple(setting.values())])[0]
                moving.append(replace(each, candidates=replace(each.candidates, covariance=widened)))
    if not moving:
        return {'inside_90': None, 'inside_all_90': None}
    shares = [power_rule_shares(each, config.likelihood) for each in moving]
    weights = {'inside_90': [np.eye(len(each))[each.argmax()] for each in shares], 'inside_all_90': shares}
    return {name: measure_inside(moving, each)[f'{COVERAGE_LEVEL:g}'][COVERAGE_S] for name, each in weights.items()}
