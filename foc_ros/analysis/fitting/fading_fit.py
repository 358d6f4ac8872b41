"""How soon an acceleration fades, by where the hands really were after each sample.

An acceleration a that fades as exp(-t / tau) displaces a hand of speed v, after t, by

    v t + tau (t - tau (1 - exp(-t / tau))) a,

the model that predictions start from where `estimator.acceleration_time_s` is tau; one that lasts, where it is 0, by
v t + a t^2 / 2. The estimate minimises the mean absolute error of the mean velocity until 0.25, 0.5 and 1 s ahead, over the
samples of a movement and then over the recordings. The acceleration is the filter's: what it makes of noise fades, too.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from foc_ros.analysis.evaluation.observations import HORIZONS_S
from foc_ros.core.config import Config
from foc_ros.core.types import Array

from .demonstrations import Demonstration
from .estimates import Estimate, bounded
from .resampling import CENTRAL, resamples

NAME = 'estimator.acceleration_time_s'
TIMES_S = np.array([0.0, *np.geomspace(0.01, 0.5, 60)])
"""Times that are tried; 0: the acceleration lasts."""


def fit_fading(demonstrations: Sequence[Demonstration], config: Config) -> tuple[dict[str, Estimate], list[str]]:
    """Return the estimate, and warnings in words."""
    errors = [each for demonstration in demonstrations if (each := _errors(demonstration, config)) is not None]
    if not errors:
        return {}, [f'{NAME}: no movement lasts for {min(HORIZONS_S):g} s; it is kept']
    table = np.array(errors)
    low, high = np.percentile(TIMES_S[(resamples(len(table)) @ table).argmin(axis=1)], CENTRAL)
    value = bounded(NAME, float(f'{TIMES_S[table.mean(axis=0).argmin()]:.3g}'))
    found = Estimate(NAME, value, float(min(low, value)), float(max(high, value)), 'velocities after accelerations')
    return {NAME: found}, []


def _errors(demonstration: Demonstration, config: Config) -> Array | None:
    """Return the mean error of a recording for each of `TIMES_S` [m/s]; None where nothing can be compared."""
    states, times, positions = demonstration.states(config), demonstration.times, demonstration.positions
    moving = np.array([state.onset_ns is not None for state in states])
    mean = np.array([state.mean for state in states])
    errors = []
    for horizon in HORIZONS_S:
        known = moving & (times + horizon <= times[-1])
        later = np.column_stack([np.interp(times[known] + horizon, times, axis) for axis in positions.T])
        gained = (later - mean[known, :2]) / horizon - mean[known, 2:4]
        fading = TIMES_S[1:]
        share = np.append(horizon / 2.0, fading * (1.0 - fading / horizon * (1.0 - np.exp(-horizon / fading))))
        errors.append(np.hypot(*(gained - share[:, None, None] * mean[known, 4:]).transpose(2, 0, 1)).T)
    together = np.concatenate(errors)
    return together.mean(axis=0) if len(together) else None
