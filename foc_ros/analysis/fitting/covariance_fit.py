"""The parameters that widen the covariance of predictions: process noise, scatter of the end point, spread of the duration.

They are found by the density of the true positions under the mixture of the candidates. They change nothing but covariances, so
that all of them are tried on the observations of one replay with motor noise alone.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import product
from typing import Any, NamedTuple

import numpy as np

from foc_ros.analysis.evaluation.forecasts import power_rule_shares
from foc_ros.analysis.evaluation.ground_truth import TIMES_S
from foc_ros.analysis.evaluation.observations import Observation, ObservedRecording, interpolate_steps
from foc_ros.analysis.evaluation.position_metrics import (
    EXACT,
    HORIZONS,
    compute_denser_share,
    is_inside_ellipse,
    log_mixture_density,
)
from foc_ros.core.config import Config
from foc_ros.core.hand.duration import is_passing
from foc_ros.core.plant.replanning import triple_integrator_goal_map, triple_integrator_process_covariance
from foc_ros.core.types import Array

from .estimates import Estimate, Estimates
from .resampling import SettingTable

NAMES = ('foc.process_noise', 'foc.endpoint_stddev', 'duration.spread')
COVERAGE_S, COVERAGE_LEVEL = 0.5, 0.9
"""Time ahead and probability of the ellipses and regions whose coverage is reported."""
FURTHEST = -30.0
"""Least log-density that counts [nat], so that one unexpected position does not rule the rest."""


class Widening(NamedTuple):
    """Values of the parameters that widen the covariance, in the order of `NAMES`."""

    process_noise: float = 0.0
    endpoint_stddev: float = 0.0
    spread: float = 0.0

    def parameters(self) -> Mapping[str, float]:
        """Return the values by dotted name."""
        return dict(zip(NAMES, self, strict=True))


NO_WIDENING = Widening()
PROCESS_NOISES = (0.0, *(float(value) for value in np.geomspace(0.01, 100.0, 33)))
"""Process noises that are tried [m/s^2.5], from far below the jerk density of the filter to that of a hand in free motion."""
ENDPOINT_STDDEVS = (0.0, 1e-3, 2e-3, 3e-3, 4e-3, 6e-3, 8e-3, 12e-3, 16e-3, 24e-3, 32e-3, 48e-3, 72e-3, 0.11, 0.16)
"""Scatter of the end point that is tried [m]: Fitts' law expects 48 mm for a target of 0.2 m."""
SPREADS = (0.0, 0.1, 0.2, 0.3, 0.4, 0.6, 0.9)
WIDENINGS = tuple(Widening(*values) for values in product(PROCESS_NOISES, ENDPOINT_STDDEVS, SPREADS))
FEW_WIDENINGS = tuple(
    Widening(*values)
    for values in product(PROCESS_NOISES[:1] + PROCESS_NOISES[1::4], (0.0, 3e-3, 8e-3, 24e-3, 72e-3), (0.0, 0.2, 0.4))
)
"""Their best is good enough to compare predictions that differ in other parameters."""


def compute_log_densities(observation: Observation, shares: Array, config: Config, widenings: Sequence[Widening]) -> Array | None:
    """Return the log-density of the true positions, mean over the horizons, under each widening, (q,) [nat, metres].

    shares (k,): of the candidates; config: of the replay. None where the movement ends before the first horizon or has not begun,
    because a hand at rest shows how long it waits, not how it moves.
    """
    true = observation.truth.positions[HORIZONS]
    known = np.isfinite(true[:, 0])
    counted = np.flatnonzero(shares > 0.0)
    if observation.movement_age_s == 0.0 or not known.any() or not len(counted):
        return None
    rows, times = np.ix_(counted, np.array(HORIZONS)[known])
    covariance = _widen_covariances(observation, np.array(widenings), config)[:, rows, times] + EXACT * np.eye(2)
    offset = true[known] - observation.candidates.mean[rows, times]
    entries = covariance[..., 0, 0], covariance[..., 1, 1], covariance[..., 0, 1]
    return np.asarray(np.maximum(log_mixture_density(shares[counted], offset, *entries), FURTHEST).mean(axis=1))


def widen_covariance(observation: Observation, widening: Widening, config: Config) -> Array:
    """Return the covariance (k, h, 2, 2) [m^2] of the candidates' positions at `TIMES_S` with a widening."""
    return np.asarray(_widen_covariances(observation, np.array([widening]), config)[0])


def _widen_covariances(observation: Observation, widenings: Array, config: Config) -> Array:
    """Return the covariance (q, k, h, 2, 2) [m^2] with each of some widenings (q, 3)."""
    candidates, late = observation.candidates, observation.candidates.duration_sensitivity
    unit = np.array([_compute_unit_variances(float(time_s), config) for time_s in candidates.time_s])
    both = np.tensordot(widenings[:, :2] ** 2, unit, (1, 1))
    spread = np.multiply.outer(widenings[:, 2] ** 2, late[..., :, None] * late[..., None, :])
    return np.asarray(candidates.covariance + both[..., None, None] * np.eye(2) + spread)


def _compute_unit_variances(time_s: float, config: Config) -> Array:
    """Return the variance of a position at `TIMES_S` by process noise and by scatter of the end, of 1 each, (2, h)."""
    steps = config.foc.steps
    kind = time_s / steps, steps, is_passing(config.duration)
    jerk, end = triple_integrator_process_covariance(*kind), triple_integrator_goal_map(*kind) ** 2
    return np.array([interpolate_steps(each[:, 0, 0], kind[0]) for each in (jerk, end)])


def tabulate_densities(recordings: Sequence[ObservedRecording], config: Config) -> SettingTable:
    """Try every widening on every recording; none is the first."""
    rows = []
    for recording in recordings:
        densities = [
            compute_log_densities(each, power_rule_shares(each, config.likelihood), config, WIDENINGS)
            for each in recording.observations
        ]
        known = [each for each in densities if each is not None]
        rows.append(np.mean(known, axis=0) if known else np.full(len(WIDENINGS), np.nan))
    return SettingTable(np.array(rows), WIDENINGS)


def estimate_widening(table: SettingTable) -> tuple[Estimates, list[str]]:
    """Return the estimates of the parameters that widen the covariance, and a warning for each at the largest value tried."""
    columns = range(len(table.settings))
    best = table.settings[table.find_best(columns)].parameters()
    resampled = [table.settings[column].parameters() for column in table.resample_best(columns)]
    estimates = {
        name: Estimate.from_resamples(
            name, float(f'{value:.4g}'), [each[name] for each in resampled], 'density of true positions'
        )
        for name, value in best.items()
    }
    largest = {name: max(each.parameters()[name] for each in table.settings) for name in NAMES}
    words = 'is the largest value tried: the plans differ from the movements by more than it describes'
    return estimates, [f'{name}: {value:.4g} {words}' for name, value in best.items() if value == largest[name]]


def score_positions(table: SettingTable, config: Config, recordings: Sequence[ObservedRecording], cross: bool) -> dict[str, Any]:
    """Return mean log-densities and coverage, by score and by how the widening was chosen; cross: also held out."""
    columns, n = range(len(table.settings)), len(recordings)
    chosen = {'motor noise alone': np.zeros(n, dtype=np.intp), 'fitted': np.full(n, table.find_best(columns))}
    if cross:
        chosen['without the recording'] = table.choose_held_out(columns, [each.name for each in recordings])
    coverage = {name: compute_coverage(recordings, config, [table.settings[each] for each in chosen[name]]) for name in chosen}
    return {
        'positions': {name: table.score(each) for name, each in chosen.items()},
        **{kind: {name: each[kind] for name, each in coverage.items()} for kind in ('inside_90', 'inside_all_90')},
    }


def compute_coverage(
    recordings: Sequence[ObservedRecording], config: Config, widenings: Sequence[Widening]
) -> dict[str, float | None]:
    """Return the shares of true positions of moving hands after 0.5 s inside 90 % ellipses and regions.

    inside_90: the ellipse of the likeliest candidate; inside_all_90: the smallest region of all candidates; widenings (n,): for
    each recording, so that each can be judged by one that it did not influence.
    """
    time, counted = TIMES_S.index(COVERAGE_S), []
    for recording, widening in zip(recordings, widenings, strict=True):
        for each in recording.observations:
            if each.movement_age_s > 0.0 and np.isfinite(each.truth.positions[time, 0]):
                shares = power_rule_shares(each, config.likelihood)
                covariance, row = widen_covariance(each, widening, config), int(shares.argmax())
                likeliest = is_inside_ellipse(each.truth.positions - each.candidates.mean[row], covariance[row], COVERAGE_LEVEL)
                is_inside_region = compute_denser_share(each, shares, covariance) < COVERAGE_LEVEL
                counted.append((likeliest[time], float(is_inside_region[time])))
    one, together = np.mean(counted, axis=0).tolist() if counted else (None, None)
    return {'inside_90': one, 'inside_all_90': together}
