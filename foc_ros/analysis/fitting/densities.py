"""How likely true positions were under what was predicted, however unsure we are of the plans: no replay is needed to try."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import astuple, dataclass
from itertools import product

import numpy as np

from foc_ros.analysis.evaluation.observations import HORIZONS_S, TIMES_S, Observation
from foc_ros.analysis.evaluation.positions import EXACT
from foc_ros.analysis.evaluation.regions import log_mixture
from foc_ros.core.config import Config
from foc_ros.core.dynamics.replanning import triple_integrator_goal_map, triple_integrator_process_covariance
from foc_ros.core.estimation.duration import is_passing
from foc_ros.core.types import Array

NAMES = ('foc.process_noise', 'foc.endpoint_stddev', 'duration.spread')


@dataclass(frozen=True)
class Doubt:
    """How unsure predictions are of their plans: parameters that change nothing but their covariance."""

    process_noise: float = 0.0
    endpoint_stddev: float = 0.0
    spread: float = 0.0

    def parameters(self) -> Mapping[str, float]:
        """Return the values by dotted name."""
        return dict(zip(NAMES, astuple(self), strict=True))


NO_DOUBT = Doubt()
PROCESS_NOISES = (0.0, *(float(value) for value in np.geomspace(0.01, 100.0, 33)))
"""Process noises tried [m/s^2.5]: 0.01 is nothing beside a filter's jerk density, 100 is a hand that is thrown about."""
ENDPOINT_STDDEVS = (0.0, 5e-4, 1e-3, 2e-3, 3e-3, 4e-3, 6e-3, 8e-3, 12e-3, 16e-3, 24e-3, 32e-3, 48e-3)
"""Scatter of the ends tried [m]: 48 mm is what Fitts' law expects of a target of 0.2 m."""
SPREADS = (0.0, 0.1, 0.2, 0.3, 0.4, 0.6)
"""Spreads of the time to go tried."""
DOUBTS = tuple(Doubt(*values) for values in product(PROCESS_NOISES, ENDPOINT_STDDEVS, SPREADS))
FEWER_DOUBTS = tuple(
    Doubt(*values)
    for values in product(PROCESS_NOISES[:1] + PROCESS_NOISES[1::4], (0.0, 3e-3, 6e-3, 12e-3, 24e-3), (0.0, 0.2, 0.4))
)
"""Those among which the best is good enough to compare predictions that differ in more."""
FURTHEST = -30.0
"""Least log-density that counts [nat]: one position that nobody expected is not to rule the rest."""

_PLACES = [TIMES_S.index(horizon) for horizon in HORIZONS_S]


def log_densities(seen: Observation, shares: Array, config: Config, doubts: Sequence[Doubt]) -> Array | None:
    """Return the log-density of the true positions, mean over the horizons, for each of some doubts, (q,) [nat, metres].

    shares (k,): of the candidates; config: that they were predicted with, but for the doubt. None where the
    movement ends before the first horizon, or has not begun: a hand at rest tells how long it waits, not how it moves.
    """
    true = seen.truth.positions[_PLACES]
    known = np.isfinite(true[:, 0])
    weighed = np.flatnonzero(shares > 0.0)
    if seen.since_s == 0.0 or not known.any() or not len(weighed):
        return None
    places = np.array(_PLACES)[known]
    away = true[known] - seen.ways.mean[np.ix_(weighed, places)]
    base = seen.ways.covariance[np.ix_(weighed, places)] + EXACT * np.eye(2)
    jerk, end = np.array([_variances(float(seen.ways.time_s[row]), config)[:, places] for row in weighed]).swapaxes(0, 1)
    late = seen.ways.late[np.ix_(weighed, places)]
    squared = np.square([astuple(each) for each in doubts]).T
    both = np.multiply.outer(squared[0], jerk) + np.multiply.outer(squared[1], end)
    xx, yy, xy = (
        base[..., i, j] + (both if i == j else 0.0) + np.multiply.outer(squared[2], late[..., i] * late[..., j])
        for i, j in ((0, 0), (1, 1), (0, 1))
    )
    density: Array = np.maximum(log_mixture(shares[weighed], away, xx, yy, xy), FURTHEST).mean(axis=1)
    return density


def widened(seen: Observation, doubt: Doubt, config: Config) -> Array:
    """Return the covariance (k, h, 2, 2) [m^2] of the candidates' positions at `TIMES_S` with a doubt."""
    added = np.array([_variances(float(time_s), config) for time_s in seen.ways.time_s])
    both = doubt.process_noise**2 * added[:, 0] + doubt.endpoint_stddev**2 * added[:, 1]
    late = doubt.spread * seen.ways.late
    covariance: Array = seen.ways.covariance + both[..., None, None] * np.eye(2) + late[..., :, None] * late[..., None, :]
    return covariance


def _variances(time_s: float, config: Config) -> Array:
    """Return the variance of a position at `TIMES_S` by process noise and by scatter of the end, of 1 each, (2, h)."""
    steps = config.foc.steps
    kind = time_s / steps, steps, is_passing(config.duration)
    places = np.minimum(np.rint(np.array(TIMES_S) / kind[0]).astype(int), steps)
    jerk, end = triple_integrator_process_covariance(*kind), triple_integrator_goal_map(*kind) ** 2
    return np.array([jerk[places, 0, 0], end[places, 0, 0]])
