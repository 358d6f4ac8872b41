# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Parameters that need no prediction: of the estimator, of durations, and the number of candidates.

**Deviations of the Kalman filter** are those under which its innovations v, which are white and normal in a filter with the right
ones, are likeliest: with the expected variance S, which both axes share,

    log p(z) = -1/2 sum_k (2 log(2 pi S_k) + |v_k|^2 / S_k)

is exact (Schweppe 1965, doi:10.1109/TIT.1965.1053737).

**Fading.** An acceleration a that fades as exp(-t / tau) displaces a hand of speed v, after t, by

    v t + tau (t - tau (1 - exp(-t / tau))) a,

the model that predictions start from with `estimator.acceleration_time_s` = tau, where 0 means that the acceleration lasts. The
estimate minimises the mean absolute error of the mean velocity until 0.25, 0.5 and 1 s ahead, over the samples of a movement and
then over the recordings.

**Durations.** Their constants minimise the mean absolute error of the time to go, which gives a few slow movements little weight.
With Fitts' law, only distances that differ tell intercept and slope apart; otherwise their ratio is kept.

**The wait** is the mean time to the next movement over all samples at rest: the likeliest mean of an exponential distribution,
which does not depend on how long the hand has waited already.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.optimize import minimize

from foc_ros.analysis.evaluation.scores import CENTRAL, resample
from foc_ros.analysis.evaluation.truth import HORIZONS_S, RecordedHand
from foc_ros.core.config import Config, EstimatorConfig, flatten
from foc_ros.core.hand.duration import CONSTANTS as MODEL_CONSTANTS
from foc_ros.core.hand.duration import estimate_times_to_go
from foc_ros.core.hand.kalman import compute_gramian, compute_transition
from foc_ros.core.learning.movements import has_covered_distance
from foc_ros.core.parameter import clip_values
from foc_ros.core.types import NANOSECONDS, Array, HandState, SampleStatus

from . import Estimate, Findings, SettingTable, clip_to_bounds, list_settings

POSITION_STDDEV, JERK_DENSITY = 'estimator.position_stddev', 'estimator.jerk_density'
FADING = 'estimator.acceleration_time_s'
FADING_TIMES_S = (0.0, *np.geomspace(0.01, 0.5, 60).tolist())
"""Times that are tried; 0: the acceleration lasts."""
CONSTANTS = {model: tuple(f'duration.{name}' for name in names) for model, names in MODEL_CONSTANTS.items()}
"""By model, the constants that determine durations by dotted name, each with its power in a factor on all durations."""
NARROW_BITS = 0.5
"""Standard deviation of the index of difficulty below which intercept and slope are not told apart [bit]."""
FACTORS = tuple(2.0 ** (np.arange(-10, 11) / 4.0))
"""Factors on the given values, 0.18 to 5.7, among which the best is sought first."""
WAIT = 'duration.wait_s'


def tabulate_innovations(
    hands: Sequence[RecordedHand], given: EstimatorConfig, position_stddevs: Sequence[float], jerk_densities: Sequence[float]
) -> SettingTable:
    """Return the log-likelihood of the positions of each recording under all combinations of deviations.

    Every filter that is tried starts anew where the given one does not continue, so that all are compared by the same samples.
    """
    settings, totals = list_settings({POSITION_STDDEV: position_stddevs, JERK_DENSITY: jerk_densities}), []
    position, jerk = np.array([tuple(each.values()) for each in settings]).T ** 2
    start = jerk[:, None, None] * compute_gramian(given.gap_s)
    start[:, 0] = start[:, :, 0] = 0.0
    start[:, 0, 0] = position
    for hand in hands:
        mean, covariance, total, last_ns = np.zeros((len(jerk), 3, 2)), start, np.zeros(len(jerk)), None
        for stamp_ns, z, updated in zip(hand.path.stamps_ns.tolist(), hand.path.positions, hand.filter(given), strict=True):
            if last_ns is None or updated.status is not SampleStatus.ACCEPTED:
                mean, covariance = np.zeros_like(mean), start
                mean[:, 0] = z
            else:
                dt = (stamp_ns - last_ns) / NANOSECONDS
                A = compute_transition(dt)
                mean, covariance = A @ mean, A @ covariance @ A.T + jerk[:, None, None] * compute_gramian(dt)
                S, v = np.maximum(covariance[:, 0, 0], 0.0) + position, z - mean[:, 0]
                total -= np.log(2.0 * np.pi * S) + (v**2).sum(axis=-1) / (2.0 * S)
                gain = covariance[:, :, 0] / S[:, None]
                mean = mean + gain[..., None] * v[:, None, :]
                covariance = covariance - gain[..., None] * covariance[:, None, 0, :]
            last_ns = stamp_ns
        totals.append(total)
    return SettingTable(np.array(totals), settings)


def fit_estimator(hands: Sequence[RecordedHand], config: Config) -> Findings:
    """Return the deviations of the filter."""
    given = {POSITION_STDDEV: config.estimator.position_stddev, JERK_DENSITY: config.estimator.jerk_density}
    # no tracker of hands is better than 10 um
    tried = {POSITION_STDDEV: np.geomspace(1e-5, 0.1, 13), JERK_DENSITY: np.geomspace(1e-3, 1e4, 22)}
    coarse = tabulate_innovations(hands, config.estimator, *([given[name], *tried[name]] for name in given))
    left, undetermined = coarse.determine(given)
    best, finer = left.best, {name: [value] for name, value in given.items()}
    for name in finer.keys() - undetermined:
        finer[name] += np.clip(best[name] * np.geomspace(0.46, 2.16, 25), tried[name][0], tried[name][-1]).tolist()
    fine, how = tabulate_innovations(hands, config.estimator, *finer.values()), 'innovations of the filter'
    return SettingTable(np.hstack([coarse.values, fine.values]), coarse.settings + fine.settings).estimate(given, how)[0]


def fit_fading(hands: Sequence[RecordedHand], config: Config) -> Findings:
    """Return the time in which an acceleration fades."""
    errors, fading = [], np.array(FADING_TIMES_S[1:])
    for hand in hands:
        states, times, path = [each.state for each in hand.filter(config.estimator)], hand.times, hand.path
        is_moving, mean = np.array([state.onset_ns is not None for state in states]), np.array([state.mean for state in states])
        own = []  # of the mean velocity until each horizon, for each of FADING_TIMES_S [m/s]
        for horizon in HORIZONS_S:
            known = is_moving & (times + horizon <= times[-1])
            later = path.interpolate(int(path.stamps_ns[0]), times[known] + horizon)
            gained = (later - mean[known, :2]) / horizon - mean[known, 2:4]
            share = np.append(horizon / 2.0, fading * (1.0 - fading / horizon * (1.0 - np.exp(-horizon / fading))))
            own.append(np.hypot(*(gained - share[:, None, None] * mean[known, 4:]).transpose(2, 0, 1)).T)
        together = np.concatenate(own)
        errors += [together.mean(axis=0)] if len(together) else []
    if not errors:
        return Findings(undetermined={FADING: f'no movement lasts for {min(HORIZONS_S):g} s'})
    table = SettingTable.from_errors(np.array(errors), [{FADING: time_s} for time_s in FADING_TIMES_S])
    return table.estimate({FADING: config.estimator.acceleration_time_s}, 'velocities after accelerations')[0]


def find_samples(hand: RecordedHand, config: Config) -> list[tuple[HandState, Array, float]]:
    """Return states, goal (2,) [m] and times left [s] of a movement that covered the distance to a goal; none of another one."""
    path = hand.path
    if path.goal is None or not has_covered_distance(path.positions, goal := path.goals[path.goal]):
        return []
    states = [each.state for each in hand.filter(config.estimator)]
    left = [(state, goal, (path.end_ns - state.stamp_ns) / NANOSECONDS) for state in states if state.onset_ns is not None]
    return [each for each in left if each[2] > 0.1]  # [s]: the end itself is known no better


def fit_duration(hands: Sequence[RecordedHand], config: Config) -> Findings:
    """Return the constants of the configured model of duration."""
    samples = [moving for hand in hands if (moving := find_samples(hand, config))]
    names = CONSTANTS[config.duration.model]
    if not samples:
        return Findings(undetermined=dict.fromkeys(names, 'no recording has a movement that ends near a goal'))
    given = np.array([flatten(config)[name] for name in names], dtype=float)

    def compute_errors(values: Array) -> Array:
        """Return the mean absolute error of the time to go in each recording, (n,) [s]."""
        leaves = (name.partition('.')[2] for name in names)
        duration = clip_values(config.duration, dict(zip(leaves, values.tolist(), strict=True)))
        errors = (
            [abs(estimate_times_to_go(hand, goal[None], duration)[0] - left) for hand, goal, left in each] for each in samples
        )
        return np.array([np.mean(each) for each in errors])

    tried = [given * factor for factor in FACTORS]
    errors = np.array([compute_errors(each) for each in tried])
    settings = [dict(zip(names, each.tolist(), strict=True)) for each in tried]
    _, undetermined = SettingTable.from_errors(errors.T, settings).determine(settings[FACTORS.index(1.0)])
    if undetermined:
        return Findings(undetermined=undetermined)
    best, found = _find_best_factor(errors), Findings()
    value = given * best
    if len(names) > 1:
        distances = np.array([np.hypot(*(each[0][1] - each[0][0].onset_position)) for each in samples])  # type: ignore[operator]
        deviation_bits = float(np.log2(distances / config.duration.target_width + 1.0).std())
        if deviation_bits > NARROW_BITS:
            value = np.abs(minimize(lambda each: float(compute_errors(np.abs(each)).mean()), value, method='Nelder-Mead').x)
        else:
            found.warnings.append(
                'duration.fitts_a_s, duration.fitts_b_s: the movements are too alike to tell intercept and slope apart '
                f'(indices of difficulty with a standard deviation of {deviation_bits:.2g} bit, {NARROW_BITS:g} are needed): '
                'their ratio is kept'
            )
    factors = np.percentile(resample(lambda rows: _find_best_factor(errors[:, rows]), errors.shape[1]) / best, CENTRAL)
    for name, each in zip(names, value.tolist(), strict=True):
        found.estimates[name] = Estimate.from_resamples(clip_to_bounds(name, each), each * factors, 'time to go')
    return found


def _find_best_factor(errors: Array) -> float:
    """Return the best factor by errors (f, n), by a parabola through the best of `FACTORS` and its neighbours."""
    mean = errors.mean(axis=1)
    index = int(np.clip(mean.argmin(), 1, len(FACTORS) - 2))
    before, here, after = mean[index - 1 : index + 2]
    bend = before - 2.0 * here + after
    shift = 0.5 * (before - after) / bend if bend > 0.0 else 0.0
    return float(FACTORS[index] * np.exp(np.log(FACTORS[1] / FACTORS[0]) * np.clip(shift, -1.0, 1.0)))


def fit_wait(hands: Sequence[RecordedHand], config: Config) -> Findings:
    """Return the mean time that a hand waits."""
    means = []
    for hand in hands:
        waits, onset_ns = list[float](), None  # from the samples at rest to the movement that follows, until the goal is reached
        for state in [each.state for each in reversed(hand.filter(config.estimator)) if each.state.stamp_ns <= hand.path.end_ns]:
            if state.onset_ns is not None:
                onset_ns = state.onset_ns
            elif onset_ns is not None:
                waits.append((onset_ns - state.stamp_ns) / NANOSECONDS)
        means += [np.mean(waits)] if waits else []
    if not means:
        return Findings(undetermined={WAIT: 'no hand waits before a movement'})
    value, table = clip_to_bounds(WAIT, float(np.mean(means))), np.array(means)
    resampled = resample(lambda rows: table[rows].mean(), len(table))
    return Findings({WAIT: Estimate.from_resamples(value, resampled, 'time until movements begin')})
