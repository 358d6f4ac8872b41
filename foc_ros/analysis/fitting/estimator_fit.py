"""The parameters of the estimator: standard deviations of the Kalman filter, and how soon an acceleration fades.

**Deviations.** They are those under which the innovations of the filter are likeliest. A filter with the right deviations leaves
innovations v that are white and normal, so that with the expected variance S, which both axes share,

    log p(z) = -1/2 sum_k (2 log(2 pi S_k) + |v_k|^2 / S_k)

is exact (Schweppe 1965, doi:10.1109/TIT.1965.1053737).

**Fading.** An acceleration a that fades as exp(-t / tau) displaces a hand of speed v, after t, by

    v t + tau (t - tau (1 - exp(-t / tau))) a,

the model that predictions start from with `estimator.acceleration_time_s` = tau. Where that is 0 the acceleration lasts, and the
hand moves by v t + a t^2 / 2. The estimate minimises the mean absolute error of the mean velocity until 0.25, 0.5 and 1 s ahead,
over the samples of a movement and then over the recordings. The acceleration is that of the filter, and so is the noise in it.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.optimize import minimize

from foc_ros.analysis.evaluation.bootstrap import CENTRAL, draw_resamples
from foc_ros.analysis.evaluation.ground_truth import HORIZONS_S
from foc_ros.core.config import Config, EstimatorConfig
from foc_ros.core.hand.kalman import compute_gramian, compute_transition
from foc_ros.core.types import Array, SampleStatus

from .estimates import Estimate, Estimates, clip_to_bounds
from .recorded_hand import RecordedHand
from .resampling import expand_quadratic

NAMES = ('estimator.position_stddev', 'estimator.jerk_density')
LOW, HIGH = np.log([1e-5, 1e-3]), np.log([0.1, 1e4])
"""No tracker of hands is better than 10 um."""
STARTS = (1e-2, 1e-1, 1.0)
"""Positions where searches begin, as shares of the given position_stddev."""
REASONS = (
    'any smaller measurement noise would explain the positions as well',
    'the positions show no jerk beyond their noise',
)
FADING = 'estimator.acceleration_time_s'
FADING_TIMES_S = np.array([0.0, *np.geomspace(0.01, 0.5, 60)])
"""Times that are tried; 0: the acceleration lasts."""


class Innovations:
    """The recordings side by side, so that one pass filters all of them.

    Every filter that is tried starts anew where the given one does not continue, so that all are compared by the same samples.
    """

    def __init__(self, hands: Sequence[RecordedHand], given: EstimatorConfig) -> None:
        most = max(len(each.times) for each in hands)
        dt = np.full((most - 1, len(hands)), given.gap_s)
        self._continues = np.zeros(dt.shape, dtype=bool)
        self._positions = np.zeros((most, len(hands), 2))
        for row, each in enumerate(hands):
            continues = [updated.status is SampleStatus.ACCEPTED for updated in each.filter(given)[1:]]
            self._continues[: len(continues), row] = continues
            dt[: len(continues), row] = np.where(continues, np.diff(each.times), given.gap_s)
            self._positions[: len(each.times), row] = each.positions
        self._transition = np.array([[compute_transition(each) for each in row] for row in dt])
        self._gramian = np.array([[compute_gramian(each) for each in row] for row in dt])
        self._start = compute_gramian(given.gap_s)

    def log_likelihood(self, position_stddev: float, jerk_density: float) -> Array:
        """Return the log-likelihood of the positions of each recording, (n,) [nat]; deviations in the estimator's units."""
        start = jerk_density**2 * self._start
        start[0] = start[:, 0] = 0.0
        start[0, 0] = position_stddev**2
        mean = np.zeros((self._positions.shape[1], 3, 2))
        mean[:, 0] = self._positions[0]
        covariance = np.broadcast_to(start, (len(mean), 3, 3))
        total = np.zeros(len(mean))
        for A, G, continues, z in zip(self._transition, self._gramian, self._continues, self._positions[1:], strict=True):
            mean, covariance = A @ mean, A @ covariance @ A.swapaxes(1, 2) + jerk_density**2 * G
            S = np.maximum(covariance[:, 0, 0], 0.0) + position_stddev**2
            v = z - mean[:, 0]
            total -= np.where(continues, np.log(2.0 * np.pi * S) + (v**2).sum(axis=1) / (2.0 * S), 0.0)
            gain = covariance[:, :, 0] / S[:, None]
            mean = mean + gain[:, :, None] * v[:, None, :]
            covariance = covariance - gain[:, :, None] * covariance[:, None, 0, :]
            if not continues.all():
                mean[~continues] = 0.0
                mean[~continues, 0] = z[~continues]
                covariance[~continues] = start
        return total


def fit_estimator(hands: Sequence[RecordedHand], config: Config) -> tuple[Estimates, list[str]]:
    """Return the estimates of the deviations, and warnings in words."""
    innovations = Innovations(hands, config.estimator)

    def per_recording(logs: Array) -> Array:
        return innovations.log_likelihood(*np.exp(np.clip(logs, LOW, HIGH)).tolist())

    given = np.log([config.estimator.position_stddev, config.estimator.jerk_density])
    searches = [
        minimize(
            lambda logs: -float(per_recording(logs).sum()),
            np.clip(given + np.array([np.log(share), 0.0]), LOW, HIGH),
            method='Nelder-Mead',
        )
        for share in STARTS
    ]
    found = expand_quadratic(per_recording, min(searches, key=lambda each: float(each.fun)).x, LOW, HIGH)
    values, (low, high) = np.exp(found.x), np.exp(found.compute_interval())
    estimates = {
        name: Estimate(name, clip_to_bounds(name, values[row]), float(low[row]), float(high[row]), 'innovations of the filter')
        for row, name in enumerate(NAMES)
    }
    warnings = [
        f'{NAMES[row]}: the recordings do not determine it (standard deviation of its logarithm {found.deviation[row]:.2g}): '
        f'{REASONS[row]}; {estimates[NAMES[row]].value:.3g} is one value of many'
        for row in found.undetermined
    ]
    return estimates, warnings


def fit_fading(hands: Sequence[RecordedHand], config: Config) -> tuple[Estimates, list[str]]:
    """Return the estimate of the time in which an acceleration fades, and warnings in words."""
    errors = [each for hand in hands if (each := _compute_fading_errors(hand, config)) is not None]
    if not errors:
        return {}, [f'{FADING}: no movement lasts for {min(HORIZONS_S):g} s; the given value is kept']
    table = np.array(errors)
    low, high = np.percentile(FADING_TIMES_S[(draw_resamples(len(table)) @ table).argmin(axis=1)], CENTRAL).tolist()
    value = clip_to_bounds(FADING, float(f'{FADING_TIMES_S[table.mean(axis=0).argmin()]:.3g}'))
    return {FADING: Estimate(FADING, value, min(low, value), max(high, value), 'velocities after accelerations')}, []


def _compute_fading_errors(hand: RecordedHand, config: Config) -> Array | None:
    """Return the mean error of a recording for each of `FADING_TIMES_S` [m/s]; None where nothing can be compared."""
    states, times = hand.estimate_states(config), hand.times
    is_moving = np.array([state.onset_ns is not None for state in states])
    mean = np.array([state.mean for state in states])
    errors = []
    for horizon in HORIZONS_S:
        known = is_moving & (times + horizon <= times[-1])
        later = np.column_stack([np.interp(times[known] + horizon, times, axis) for axis in hand.positions.T])
        gained = (later - mean[known, :2]) / horizon - mean[known, 2:4]
        fading = FADING_TIMES_S[1:]
        share = np.append(horizon / 2.0, fading * (1.0 - fading / horizon * (1.0 - np.exp(-horizon / fading))))
        errors.append(np.hypot(*(gained - share[:, None, None] * mean[known, 4:]).transpose(2, 0, 1)).T)
    together = np.concatenate(errors)
    return together.mean(axis=0) if len(together) else None
