"""How long the operator's movements take: the duration model's constants, by the time that was really left at each sample.

The estimates minimise the mean absolute error of the time to go, over the samples of a movement and then over the recordings: the
likeliest values where errors follow Laplace's distribution, which the few that dawdle do not rule. With Fitts' law,
intercept and slope are told apart only by distances that differ; else their ratio is kept and one factor is fitted.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.optimize import minimize

from foc_ros.analysis.evaluation.path import Path
from foc_ros.core.config import Config, DurationConfig, updated
from foc_ros.core.estimation.duration import estimate_times_to_go
from foc_ros.core.types import NANOSECONDS, Array, HandState

from .demonstrations import Demonstration
from .estimates import Estimate, applied, bounded
from .resampling import CENTRAL, RESAMPLES, SEED

CONSTANTS = {
    'fixed': {'duration.fixed_s': 1.0},
    'fitts': {'duration.fitts_a_s': 1.0, 'duration.fitts_b_s': 1.0},
    'cost_of_time': {'duration.time_cost': -6.0},
}
"""By model, the constants that make durations longer, each with its power in a factor on all durations (`time_cost`)."""
DISTANCED = ('fitts', 'cost_of_time')
"""Models of which durations follow from distances."""
NARROW_BITS = 0.5
"""Standard deviation of the index of difficulty below which intercept and slope are not told apart [bit]."""
FACTORS = tuple(2.0 ** (np.arange(-10, 11) / 4.0))
"""Factors on the values given among which the best is sought first: 0.18 to 5.7."""
REACHED = 0.25
"""Share of the first distance from a goal within which it was reached."""
LEAST_LEFT_S = 0.1
"""Samples nearer to the end than this tell nothing: the end itself is known no better."""

Sample = tuple[HandState, Array, float]
"""State of the hand, goal (2,) [m], time left [s]."""


class TimesToGo:
    """The samples in movement of each recording that reached a goal."""

    def __init__(self, demonstrations: Sequence[Demonstration], config: Config) -> None:
        taken = [_samples(each, config) for each in demonstrations]
        self.samples = [each for each in taken if each]

    def errors(self, duration: DurationConfig) -> Array:
        """Return the mean absolute error of the time to go in each recording, (n,) [s]."""
        return np.array(
            [
                np.mean([abs(estimate_times_to_go(hand, goal[None], duration)[0] - left) for hand, goal, left in each])
                for each in self.samples
            ]
        )

    def difficulties(self, width: float) -> Array:
        """Return the index of difficulty of each movement, (n,) [bit]."""
        distances = [np.hypot(*(each[0][1] - each[0][0].onset_position)) for each in self.samples]  # type: ignore[operator]
        return np.log2(np.array(distances) / width + 1.0)


def _samples(demonstration: Demonstration, config: Config) -> list[Sample]:
    path = Path(demonstration.stamps_ns, demonstration.positions, demonstration.goals)
    if path.goal is None:
        return []
    goal = demonstration.goals[path.goal]
    apart = np.hypot(*(demonstration.positions - goal).T)
    if apart.min() > REACHED * apart[0]:
        return []
    left = [(state, (path.end_ns - state.stamp_ns) / NANOSECONDS) for state in demonstration.states(config)]
    return [(state, goal, seconds) for state, seconds in left if state.onset_ns is not None and seconds > LEAST_LEFT_S]


def fit_duration(demonstrations: Sequence[Demonstration], config: Config) -> tuple[dict[str, Estimate], list[str]]:
    """Return the estimates, and warnings in words."""
    times = TimesToGo(demonstrations, config)
    if not times.samples:
        return {}, ['duration: no recording has a movement that ends near a goal; its parameters are kept']
    names, powers = tuple(CONSTANTS[config.duration.model]), np.array(list(CONSTANTS[config.duration.model].values()))
    given = np.array([getattr(config.duration, name.partition('.')[2]) for name in names])
    errors = np.array([times.errors(_changed(config.duration, names, given * factor**powers)) for factor in FACTORS])
    best = _finer(errors)
    how, warnings = 'time to go', []
    value = given * best**powers
    if len(names) == 2 and times.difficulties(config.duration.target_width).std() > NARROW_BITS:
        value = _both(times, config.duration, names, value)
    elif len(names) == 2:
        warnings.append(
            'duration.fitts_a_s, duration.fitts_b_s: the movements are too alike to tell intercept and slope apart '
            f'(indices of difficulty {times.difficulties(config.duration.target_width).std():.2g} bit about their mean, '
            f'{NARROW_BITS:g} are needed): their ratio is kept'
        )
    spread = _resampled(errors) / best
    low, high = np.percentile(spread, CENTRAL)
    found = {}
    for name, each, power in zip(names, value.tolist(), powers, strict=True):
        ends = sorted((each * min(low, 1.0) ** power, each * max(high, 1.0) ** power))
        found[name] = Estimate(name, bounded(name, each), float(ends[0]), float(ends[1]), how)
    return found, warnings


def other_models(demonstrations: Sequence[Demonstration], config: Config) -> list[Config]:
    """Return the configuration with each model of duration that can serve any distance, its constants fitted, but for its own."""
    others = [updated(config, {'duration.model': model}) for model in DISTANCED if model != config.duration.model]
    return [applied(each, fit_duration(demonstrations, each)[0]) for each in others]


def _finer(errors: Array) -> float:
    """Return the best factor, by a parabola through the best on the grid and its neighbours."""
    mean = errors.mean(axis=1)
    place = int(np.clip(mean.argmin(), 1, len(FACTORS) - 2))
    before, here, after = mean[place - 1 : place + 2]
    bend = before - 2.0 * here + after
    shift = 0.5 * (before - after) / bend if bend > 0.0 else 0.0
    step = np.log(FACTORS[1] / FACTORS[0])
    return float(FACTORS[place] * np.exp(step * np.clip(shift, -1.0, 1.0)))


def _resampled(errors: Array) -> Array:
    draws, n = np.random.default_rng(SEED), errors.shape[1]
    return np.array([_finer(errors[:, draws.integers(n, size=n)]) for _ in range(RESAMPLES)])


def _both(times: TimesToGo, duration: DurationConfig, names: tuple[str, ...], start: Array) -> Array:
    """Return intercept and slope, each by itself."""
    found = minimize(
        lambda values: float(times.errors(_changed(duration, names, np.abs(values))).mean()), start, method='Nelder-Mead'
    )
    values: Array = np.abs(found.x)
    return values


def _changed(duration: DurationConfig, names: tuple[str, ...], values: Array) -> DurationConfig:
    leaves = [name.partition('.')[2] for name in names]
    return replace(duration, **dict(zip(leaves, values.tolist(), strict=True)))
