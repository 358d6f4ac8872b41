# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Parameters that need no prediction: of the estimator, of durations, and the number of candidates.

**Deviations of the Kalman filter** are those under which its innovations are likeliest. A filter with the right deviations leaves
innovations v that are white and normal, so that with the expected variance S, which both axes share,

    log p(z) = -1/2 sum_k (2 log(2 pi S_k) + |v_k|^2 / S_k)

is exact (Schweppe 1965, doi:10.1109/TIT.1965.1053737).

**Fading.** An acceleration a that fades as exp(-t / tau) displaces a hand of speed v, after t, by

    v t + tau (t - tau (1 - exp(-t / tau))) a,

the model that predictions start from with `estimator.acceleration_time_s` = tau. Where that is 0 the acceleration lasts, and the
hand moves by v t + a t^2 / 2. The estimate minimises the mean absolute error of the mean velocity until 0.25, 0.5 and 1 s ahead,
over the samples of a movement and then over the recordings. The acceleration is that of the filter, and so is the noise in it.

**Durations.** Their constants minimise the mean absolute error of the time to go, over the samples of a movement and then over
the recordings. They are the likeliest values where errors follow Laplace's distribution, so that a few slow movements have little
weight. With Fitts' law, only distances that differ tell intercept and slope apart; otherwise their ratio is kept.

**The wait** is the mean time to the next movement over all samples at rest. That is the likeliest mean of an exponential
distribution, which does not depend on how long the hand has waited already.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize

from foc_ros.analysis.evaluation.truth import HORIZONS_S, RecordedPath
from foc_ros.analysis.intervals import CENTRAL, resample
from foc_ros.analysis.recordings import Recording
from foc_ros.analysis.replay import Replay
from foc_ros.core.config import Config, EstimatorConfig, flatten, replace_values
from foc_ros.core.errors import RecordingError
from foc_ros.core.hand.duration import CONSTANTS as MODEL_CONSTANTS
from foc_ros.core.hand.duration import estimate_times_to_go
from foc_ros.core.hand.kalman import Update, compute_gramian, compute_transition, update
from foc_ros.core.learning.movements import has_covered_distance
from foc_ros.core.obstacle_table import Obstacles
from foc_ros.core.parameter import clip_values
from foc_ros.core.types import NANOSECONDS, Array, HandSample, HandState, Record, SampleStatus

from . import Estimate, Findings, SettingTable, clip_to_bounds, list_settings

MIN_SAMPLES = 10
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


@dataclass(frozen=True, eq=False)
class RecordedHand(Record):
    """The hand in a recording, as the estimator receives it, and its scene.

    stamps_ns (m,), rising; positions (m, 2) [m]; obstacles at the first stamp; goals (g, 2) [m]; frame_id.
    """

    name: str
    stamps_ns: NDArray[np.int64]
    positions: Array
    obstacles: Obstacles
    goals: Array
    frame_id: str = ''

    @cached_property
    def times(self) -> Array:
        """Seconds since the first sample, (m,)."""
        return np.asarray((self.stamps_ns - self.stamps_ns[0]) / NANOSECONDS)

    @cached_property
    def path(self) -> RecordedPath:
        """The path of the hand, which ends where it is nearest to the goal that it reached."""
        return RecordedPath(self.stamps_ns, self.positions, self.goals)

    def filter(self, config: EstimatorConfig) -> list[Update]:
        """Return what an estimator makes of each sample: the state, and whether it continues or starts anew."""
        updates, state = list[Update](), None
        for stamp_ns, position in zip(self.stamps_ns.tolist(), self.positions, strict=True):
            updates.append(update(state, HandSample(stamp_ns, position, frame_id=self.frame_id), config))
            state = updates[-1].state
        return updates


def read_hand(recording: Recording, config: Config) -> RecordedHand:
    """Read a recording as a replay does, without predicting; raises RecordingError for one without goals or with few samples."""
    replayed = Replay(config)
    samples: list[HandSample] = []
    for _, status in replayed.take(recording.items()):
        sample = replayed.intake.sample
        if status is not None and status.is_taken and sample is not None and (not samples or sample is not samples[-1]):
            samples = samples if not samples or sample.stamp_ns > samples[-1].stamp_ns else []
            samples.append(sample)
    goals = replayed.pipeline.scene.goals
    if goals is None or not len(goals):
        raise RecordingError(f'{recording.name}: {replayed.pipeline.not_ready_reason() or "no goal received"}')
    if len(samples) < MIN_SAMPLES:
        raise RecordingError(f'{recording.name}: expected at least {MIN_SAMPLES} hand poses, got {len(samples)}')
    stamps_ns = np.array([sample.stamp_ns for sample in samples])
    positions = np.array([sample.position for sample in samples])
    obstacles = replayed.pipeline.scene.obstacles(samples[0].stamp_ns)
    return RecordedHand(recording.name, stamps_ns, positions, obstacles, goals, samples[0].frame_id)


def tabulate_innovations(
    hands: Sequence[RecordedHand], given: EstimatorConfig, position_stddevs: Sequence[float], jerk_densities: Sequence[float]
) -> SettingTable:
    """Return the log-likelihood of the positions of each recording under all combinations of deviations.

    Every filter that is tried starts anew where the given one does not continue, so that all are compared by the same samples.
    """
    settings = list_settings({POSITION_STDDEV: position_stddevs, JERK_DENSITY: jerk_densities})
    position, jerk = np.array([tuple(each.values()) for each in settings]).T ** 2
    start, totals = jerk[:, None, None] * compute_gramian(given.gap_s), []
    start[:, 0] = start[:, :, 0] = 0.0
    start[:, 0, 0] = position
    for hand in hands:
        mean, covariance, total, last_ns = np.zeros((len(jerk), 3, 2)), start, np.zeros(len(jerk)), None
        for stamp_ns, z, updated in zip(hand.stamps_ns.tolist(), hand.positions, hand.filter(given), strict=True):
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
    columns, undetermined = coarse.determine(given)
    best, finer = coarse.settings[coarse.find_best(columns)], {name: [value] for name, value in given.items()}
    for name in finer.keys() - undetermined:
        finer[name] += np.clip(best[name] * np.geomspace(0.46, 2.16, 25), tried[name][0], tried[name][-1]).tolist()
    fine, how = tabulate_innovations(hands, config.estimator, *finer.values()), 'innovations of the filter'
    return SettingTable(np.hstack([coarse.values, fine.values]), coarse.settings + fine.settings).estimate(given, how)[0]


def fit_fading(hands: Sequence[RecordedHand], config: Config) -> Findings:
    """Return the time in which an acceleration fades."""
    errors, fading = [], np.array(FADING_TIMES_S[1:])
    for hand in hands:
        states, times = [each.state for each in hand.filter(config.estimator)], hand.times
        is_moving, mean = np.array([state.onset_ns is not None for state in states]), np.array([state.mean for state in states])
        own = []  # of the mean velocity until each horizon, for each of FADING_TIMES_S [m/s]
        for horizon in HORIZONS_S:
            known = is_moving & (times + horizon <= times[-1])
            later = np.column_stack([np.interp(times[known] + horizon, times, axis) for axis in hand.positions.T])
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
    if path.goal is None or not has_covered_distance(hand.positions, hand.goals[path.goal]):
        return []
    states, goal = [each.state for each in hand.filter(config.estimator)], hand.goals[path.goal]
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
        leaves = [name.partition('.')[2] for name in names]
        duration = clip_values(config.duration, dict(zip(leaves, values.tolist(), strict=True)))
        errors = [
            [abs(estimate_times_to_go(hand, goal[None], duration)[0] - left) for hand, goal, left in each] for each in samples
        ]
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
        found.estimates[name] = Estimate.from_resamples(name, clip_to_bounds(name, each), each * factors, 'time to go')
    return found


def _find_best_factor(errors: Array) -> float:
    """Return the best factor by errors (f, n), by a parabola through the best of `FACTORS` and its neighbours."""
    mean = errors.mean(axis=1)
    index = int(np.clip(mean.argmin(), 1, len(FACTORS) - 2))
    before, here, after = mean[index - 1 : index + 2]
    bend = before - 2.0 * here + after
    shift = 0.5 * (before - after) / bend if bend > 0.0 else 0.0
    return float(FACTORS[index] * np.exp(np.log(FACTORS[1] / FACTORS[0]) * np.clip(shift, -1.0, 1.0)))


def fit_other_models(hands: Sequence[RecordedHand], config: Config) -> list[Config]:
    """Return the configuration with Fitts' law, by which durations depend on distances, and its fitted constants."""
    if config.duration.model == 'fitts':
        return []
    other = replace_values(config, {'duration.model': 'fitts'})
    return [replace_values(other, fit_duration(hands, other).values)]


def fit_wait(hands: Sequence[RecordedHand], config: Config) -> Findings:
    """Return the mean time that a hand waits."""
    means = []
    for hand in hands:
        waits, onset_ns = list[float](), None  # from the samples at rest to the movement that follows, until the goal is reached
        for state in [each.state for each in reversed(hand.filter(config.estimator))]:
            if state.stamp_ns > hand.path.end_ns:
                continue
            if state.onset_ns is not None:
                onset_ns = state.onset_ns
            elif onset_ns is not None:
                waits.append((onset_ns - state.stamp_ns) / NANOSECONDS)
        means += [np.mean(waits)] if waits else []
    if not means:
        return Findings(undetermined={WAIT: 'no hand waits before a movement'})
    value, table = clip_to_bounds(WAIT, float(np.mean(means))), np.array(means)
    resampled = resample(lambda rows: table[rows].mean(), len(table))
    return Findings({WAIT: Estimate.from_resamples(WAIT, value, resampled, 'time until movements begin')})
