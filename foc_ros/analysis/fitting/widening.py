# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The parameters that widen the covariance: process noise, scatter of the end point, spread of the duration.

They change nothing but covariances, so that all of them are tried on observations with motor noise alone, by the density of the
true positions under the mixture of the candidates.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import product
from typing import Any

import numpy as np

from foc_ros.analysis.evaluation.baselines import power_rule_shares
from foc_ros.analysis.evaluation.observations import Observation, ObservedRecording, interpolate_steps
from foc_ros.analysis.evaluation.positions import average, compute_denser_shares, compute_log_densities, find_inside
from foc_ros.analysis.evaluation.truth import HORIZONS
from foc_ros.core.config import Config, flatten
from foc_ros.core.hand.duration import is_passing
from foc_ros.core.plant.replanning import triple_integrator_goal_map, triple_integrator_process_covariance
from foc_ros.core.types import Array

from . import Findings, Setting, SettingTable, list_settings

PROCESS_NOISE, ENDPOINT_STDDEV, SPREAD = 'foc.process_noise', 'foc.endpoint_stddev', 'duration.spread'
WIDENINGS = {
    PROCESS_NOISE: (0.0, *np.geomspace(0.01, 100.0, 33).tolist()),
    ENDPOINT_STDDEV: (0.0, 1e-3, 2e-3, 3e-3, 4e-3, 6e-3, 8e-3, 12e-3, 16e-3, 24e-3, 32e-3, 48e-3, 72e-3, 0.11, 0.16),
    SPREAD: (0.0, 0.1, 0.2, 0.3, 0.4, 0.6, 0.9),
}
"""Values that are tried, and the given ones: process noises [m/s^2.5] from far below the jerk density of the filter to that of a
hand in free motion; scatter of the end [m], of which Fitts' law expects 48 mm for a target of 0.2 m."""
NO_WIDENING: Setting = dict.fromkeys(WIDENINGS, 0.0)
FEW_WIDENINGS = tuple(product((0.0, *WIDENINGS[PROCESS_NOISE][1::4]), (0.0, 3e-3, 8e-3, 24e-3, 72e-3), (0.0, 0.2, 0.4)))
"""Widenings whose best is good enough to compare predictions that differ in other parameters."""
COVERAGE_S, COVERAGE_LEVEL = '0.5', 0.9
"""Time ahead and probability of the ellipses and regions whose coverage is reported."""
FURTHEST = -30.0
"""Least log-density that counts [nat], so that one unexpected position does not rule the rest."""


def fit_widening(recordings: Sequence[ObservedRecording], config: Config) -> tuple[Findings, dict[str, Any]]:
    """Return the parameters that widen the covariance, from a replay with motor noise alone, and scores.

    Scores: mean log-densities and coverage by how the widening was chosen, with at least three recordings also held out.
    """
    before = flatten(config)
    given = {name: float(before[name]) for name in WIDENINGS}
    settings = list_settings({name: (0.0, given[name], *tried) for name, tried in WIDENINGS.items()})
    widenings, rows = [tuple(each.values()) for each in settings], []
    for recording in recordings:
        shares = [power_rule_shares(each, config.likelihood) for each in recording.observations]
        pairs = zip(recording.observations, shares, strict=True)
        densities = [compute_mean_densities(*pair, config, widenings) for pair in pairs]
        known = [each for each in densities if each is not None]
        rows.append(np.mean(known, axis=0) if known else np.full(len(settings), np.nan))
    table = SettingTable(np.array(rows), settings)
    found, columns = table.estimate(given, 'density of true positions')
    chosen = {'motor noise alone': np.zeros(len(recordings), dtype=np.intp)}
    chosen |= table.list_choices(given, columns, [each.name for each in recordings])
    coverage = {name: compute_coverage(recordings, config, [widenings[each] for each in chosen[name]]) for name in chosen}
    return found, {
        'positions': {name: table.score(each) for name, each in chosen.items()},
        **{kind: {name: each[kind] for name, each in coverage.items()} for kind in ('inside_90', 'inside_all_90')},
    }


def compute_mean_densities(
    observation: Observation, shares: Array, config: Config, widenings: Iterable[Sequence[float]]
) -> Array | None:
    """Return the log-density of the true positions, the mean over the horizons, under each widening, (q,) [nat, metres].

    shares (k,): of the candidates; config: of the replay; widenings: values of `WIDENINGS`. None where the movement ends before
    the first horizon or has not begun, because a hand at rest shows how long it waits, not how it moves.
    """
    if observation.movement_age_s == 0.0 or not shares.any() or np.isnan(observation.truth.positions[HORIZONS[0], 0]):
        return None
    densities = compute_log_densities(observation, shares, widen_covariances(observation, widenings, config))
    return np.asarray(np.nanmean(np.maximum(densities, FURTHEST), axis=1))


def widen_covariances(observation: Observation, widenings: Iterable[Sequence[float]], config: Config) -> Array:
    """Return the covariance (q, k, h, 2, 2) [m^2] of the candidates' positions at `TIMES_S` with each widening."""
    candidates, late, squares = observation.candidates, observation.candidates.duration_sensitivity, np.array(widenings) ** 2
    unit = np.array([_compute_unit_variances(float(time_s), config) for time_s in candidates.time_s])
    both = np.tensordot(squares[:, :2], unit, (1, 1))
    spread = np.multiply.outer(squares[:, 2], late[..., :, None] * late[..., None, :])
    return np.asarray(candidates.covariance + both[..., None, None] * np.eye(2) + spread)


def _compute_unit_variances(time_s: float, config: Config) -> Array:
    """Return the variance of a position at `TIMES_S` by process noise and by scatter of the end, of 1 each, (2, h)."""
    steps = config.foc.steps
    kind = time_s / steps, steps, is_passing(config.duration)
    jerk, end = triple_integrator_process_covariance(*kind), triple_integrator_goal_map(*kind) ** 2
    return np.array([interpolate_steps(each[:, 0, 0], kind[0]) for each in (jerk, end)])


def compute_coverage(
    recordings: Sequence[ObservedRecording], config: Config, widenings: Sequence[Sequence[float]]
) -> dict[str, float | None]:
    """Return the shares of true positions of moving hands after 0.5 s inside 90 % ellipses and regions.

    inside_90: the ellipse of the likeliest candidate; inside_all_90: the smallest region of all candidates; widenings (n,): for
    each recording, so that each can be judged by one that it did not influence.
    """
    moving = [
        (each, widening)
        for recording, widening in zip(recordings, widenings, strict=True)
        for each in recording.observations
        if each.movement_age_s > 0.0
    ]
    if not moving:
        return {'inside_90': None, 'inside_all_90': None}
    observations = [each for each, _ in moving]
    shares = [power_rule_shares(each, config.likelihood) for each in observations]
    covariances = [widen_covariances(each, [widening], config)[0] for each, widening in moving]
    likeliest = [int(each.argmax()) for each in shares]
    denser = np.array([compute_denser_shares(*each) for each in zip(observations, shares, covariances, strict=True)])
    inside = np.where(np.isfinite(denser), denser < COVERAGE_LEVEL, np.nan)
    return {
        'inside_90': find_inside(observations, likeliest, covariances, COVERAGE_LEVEL)[COVERAGE_S],
        'inside_all_90': average(inside)[COVERAGE_S],
    }
