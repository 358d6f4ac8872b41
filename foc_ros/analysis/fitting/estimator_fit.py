"""The estimator's deviations: those under which the innovations of its own filter are likeliest."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.optimize import minimize

from foc_ros.core.config import Config
from foc_ros.core.types import Array

from .demonstrations import Demonstration
from .estimates import Estimate, bounded
from .innovations import Innovations
from .resampling import Quadratic, quadratic

NAMES = ('estimator.position_stddev', 'estimator.jerk_density')
LOW, HIGH = np.log([1e-5, 1e-3]), np.log([0.1, 1e4])
"""No tracker of hands is better than 10 um."""
STARTS = (1e-2, 1e-1, 1.0)
"""Where searches begin, as shares of the values given."""


def fit_estimator(demonstrations: Sequence[Demonstration], config: Config) -> tuple[dict[str, Estimate], list[str]]:
    """Return the estimates, and warnings in words."""
    innovations = Innovations(demonstrations, config.estimator.gap_s)

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
    found = quadratic(per_recording, min(searches, key=lambda each: float(each.fun)).x, LOW, HIGH)
    low, high = np.exp(found.interval())
    how = 'innovations of the filter'
    estimates = {
        name: Estimate(name, bounded(name, value), float(a), float(b), how)
        for name, value, a, b in zip(NAMES, np.exp(found.x), low, high, strict=True)
    }
    return estimates, _warnings(found, estimates)


def _warnings(found: Quadratic, estimates: dict[str, Estimate]) -> list[str]:
    told = {
        0: 'any smaller measurement noise would explain the positions as well',
        1: 'the positions show no jerk beyond their noise',
    }
    return [
        f'{NAMES[place]}: the recordings do not tell it (standard deviation of its logarithm {found.deviation[place]:.2g}): '
        f'{told[place]}; {estimates[NAMES[place]].value:.3g} is one value of many'
        for place in found.undetermined
    ]
