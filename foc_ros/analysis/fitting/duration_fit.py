"""The duration of movements: the constants of the duration models, and how long a hand at rest waits.

The constants minimise the mean absolute error of the time to go, over the samples of a movement and then over the recordings.
They are the likeliest values where errors follow Laplace's distribution, so that a few slow movements have little weight. With
Fitts' law, only distances that differ tell intercept and slope apart; otherwise their ratio is kept and one factor is fitted.

The wait is the mean time to the next movement over all samples at rest. That is the likeliest mean of an exponential
distribution, which does not depend on how long the hand has waited already.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.optimize import minimize

from foc_ros.analysis.evaluation.bootstrap import CENTRAL, RESAMPLES, SEED, draw_resamples
from foc_ros.analysis.evaluation.ground_truth import RecordedPath
from foc_ros.core.config import Config, DurationConfig, clip_values, replace_values
from foc_ros.core.hand.duration import CONSTANTS as MODEL_CONSTANTS
from foc_ros.core.hand.duration import estimate_times_to_go
from foc_ros.core.learning.movements import has_covered_distance
from foc_ros.core.types import NANOSECONDS, Array, HandState

from .estimates import Estimate, Estimates, apply_estimates, clip_to_bounds
from .recorded_hand import RecordedHand

CONSTANTS = {model: {f'duration.{name}': power for name, power in powers.items()} for model, powers in MODEL_CONSTANTS.items()}
"""By model, the constants that determine durations by dotted name, each with its power in a factor on all durations."""
DISTANCE_MODELS = ('fitts',)
"""Models whose durations depend on the distance."""
NARROW_BITS = 0.5
"""Standard deviation of the index of difficulty below which intercept and slope are not told apart [bit]."""
FACTORS = tuple(2.0 ** (np.arange(-10, 11) / 4.0))
"""Factors on the given values, 0.18 to 5.7, among which the best is sought first."""
MIN_TIME_S = 0.1
"""Least time to the end of a sample that is used, because the end itself is known no better."""
WAIT = 'duration.wait_s'

Sample = tuple[HandState, Array, float]
"""State of the hand, goal (2,) [m], time left [s]."""


class TimesToGo:
    """The samples in movement of each recording that reached a goal."""

    def __init__(self, hands: Sequence[RecordedHand], config: Config) -> None:
        samples = [find_samples(each, config) for each in hands]
        self.samples = [each for each in samples if each]

    def compute_errors(self, duration: DurationConfig) -> Array:
        """Return the mean absolute error of the time to go in each recording, (n,) [s]."""
        return np.array(
            [
                np.mean([abs(estimate_times_to_go(hand, goal[None], duration)[0] - left) for hand, goal, left in each])
                for each in self.samples
            ]
        )

    def compute_difficulties(self, width: float) -> Array:
        """Return the index of difficulty of each movement, (n,) [bit]."""
        distances = [np.hypot(*(each[0][1] - each[0][0].onset_position)) for each in self.samples]  # type: ignore[operator]
        return np.log2(np.array(distances) / width + 1.0)


def find_samples(hand: RecordedHand, config: Config) -> list[Sample]:
    """Return the samples in movement of a recording that covered the distance to a goal; none of another one."""
    path = RecordedPath(hand.stamps_ns, hand.positions, hand.goals)
    if path.goal is None or not has_covered_distance(hand.positions, hand.goals[path.goal]):
        return []
    left = [(state, (path.end_ns - state.stamp_ns) / NANOSECONDS) for state in hand.estimate_states(config)]
    goal = hand.goals[path.goal]
    return [(state, goal, seconds) for state, seconds in left if state.onset_ns is not None and seconds > MIN_TIME_S]


def fit_duration(hands: Sequence[RecordedHand], config: Config) -> tuple[Estimates, list[str]]:
    """Return the estimates of the constants of the configured model, and warnings in words."""
    times = TimesToGo(hands, config)
    if not times.samples:
        return {}, ['duration: no recording has a movement that ends near a goal; its parameters are kept']
    names, powers = tuple(CONSTANTS[config.duration.model]), np.array(list(CONSTANTS[config.duration.model].values()))
    given = np.array([getattr(config.duration, name.partition('.')[2]) for name in names])

    def compute_errors(values: Array) -> Array:
        leaves = [name.partition('.')[2] for name in names]
        return times.compute_errors(clip_values(config.duration, dict(zip(leaves, values.tolist(), strict=True))))

    errors = np.array([compute_errors(given * factor**powers) for factor in FACTORS])
    best, warnings = _find_best_factor(errors), []
    value = given * best**powers
    if len(names) == 2:
        deviation_bits = times.compute_difficulties(config.duration.target_width).std()
        if deviation_bits > NARROW_BITS:
            found = minimize(lambda values: float(compute_errors(np.abs(values)).mean()), value, method='Nelder-Mead')
            value = np.abs(found.x)
        else:
            warnings.append(
                'duration.fitts_a_s, duration.fitts_b_s: the movements are too alike to tell intercept and slope apart '
                f'(indices of difficulty with a standard deviation of {deviation_bits:.2g} bit, {NARROW_BITS:g} are needed): '
                'their ratio is kept'
            )
    low, high = np.percentile(_resample_best_factor(errors) / best, CENTRAL)
    estimates = {}
    for name, each, power in zip(names, value.tolist(), powers, strict=True):
        ends = sorted((each * min(low, 1.0) ** power, each * max(high, 1.0) ** power))
        estimates[name] = Estimate(name, clip_to_bounds(name, each), float(ends[0]), float(ends[1]), 'time to go')
    return estimates, warnings


def fit_other_models(hands: Sequence[RecordedHand], config: Config) -> list[Config]:
    """Return the configuration with each other model of duration that depends on distance, its constants fitted."""
    others = [replace_values(config, {'duration.model': model}) for model in DISTANCE_MODELS if model != config.duration.model]
    return [apply_estimates(each, fit_duration(hands, each)[0]) for each in others]


def fit_wait(hands: Sequence[RecordedHand], config: Config) -> Estimates:
    """Return the estimate of the wait, none where no hand waits before a movement."""
    waits = [mean for each in hands if (mean := _compute_mean_wait(each, config)) is not None]
    if not waits:
        return {}
    resampled = draw_resamples(len(waits)) @ np.array(waits) / len(waits)
    value = clip_to_bounds(WAIT, float(np.mean(waits)))
    return {WAIT: Estimate.from_resamples(WAIT, value, resampled, 'time until movements begin')}


def _compute_mean_wait(hand: RecordedHand, config: Config) -> float | None:
    """Return the mean time [s] from the samples at rest to the movement that follows, until the goal is reached."""
    path = RecordedPath(hand.stamps_ns, hand.positions, hand.goals)
    waits, onset_ns = list[float](), None
    for state in reversed(hand.estimate_states(config)):
        if state.stamp_ns > path.end_ns:
            continue
        if state.onset_ns is not None:
            onset_ns = state.onset_ns
        elif onset_ns is not None:
            waits.append((onset_ns - state.stamp_ns) / NANOSECONDS)
    return float(np.mean(waits)) if waits else None


def _find_best_factor(errors: Array) -> float:
    """Return the best factor, by a parabola through the best of `FACTORS` and its neighbours."""
    mean = errors.mean(axis=1)
    index = int(np.clip(mean.argmin(), 1, len(FACTORS) - 2))
    before, here, after = mean[index - 1 : index + 2]
    bend = before - 2.0 * here + after
    shift = 0.5 * (before - after) / bend if bend > 0.0 else 0.0
    return float(FACTORS[index] * np.exp(np.log(FACTORS[1] / FACTORS[0]) * np.clip(shift, -1.0, 1.0)))


def _resample_best_factor(errors: Array) -> Array:
    draws, n = np.random.default_rng(SEED), errors.shape[1]
    return np.array([_find_best_factor(errors[:, draws.integers(n, size=n)]) for _ in range(RESAMPLES)])
