"""How likely true positions were under what was predicted, for any process noise: no replay is needed to try one."""

from __future__ import annotations

import numpy as np

from foc_ros.evaluation.observations import HORIZONS_S, TIMES_S, Observation
from foc_ros.evaluation.positions import EXACT, held
from foc_ros.foc.config import Config
from foc_ros.foc.duration import is_passing
from foc_ros.foc.records import Array
from foc_ros.foc.replanning import triple_integrator_process_covariance

PROCESS_NOISES = (0.0, *(float(value) for value in np.geomspace(0.01, 100.0, 33)))
"""Process noises tried [m/s^2.5]: 0.01 is nothing beside a filter's jerk density, 100 is a hand that is thrown about."""
FURTHEST = -30.0
"""Least log-density that counts [nat]: one position that nobody expected is not to rule the rest."""

_PLACES = [TIMES_S.index(horizon) for horizon in HORIZONS_S]


def log_densities(seen: Observation, shares: Array, config: Config) -> Array | None:
    """Return the log-density of the true positions, mean over the horizons, for each of `PROCESS_NOISES`, (q,) [nat, metres].

    shares (k,): of the candidates; config: that they were predicted with, but for the process noise. None where the
    movement ends before the first horizon, or has not begun: how long a hand will wait is no part of the model.
    """
    true = seen.truth.positions[_PLACES]
    known = np.isfinite(true[:, 0])
    weighed = np.flatnonzero(shares > 0.0)
    if seen.since_s == 0.0 or not known.any() or not len(weighed):
        return None
    places = np.array(_PLACES)[known]
    away = true[known] - seen.ways.mean[np.ix_(weighed, places)]
    base = seen.ways.covariance[np.ix_(weighed, places)] + EXACT * np.eye(2)
    added = np.array([_process_variance(float(seen.ways.time_s[row]), config)[places] for row in weighed])
    squared = np.square(PROCESS_NOISES)[:, None, None]
    xx, yy, xy = base[..., 0, 0] + squared * added, base[..., 1, 1] + squared * added, base[..., 0, 1]
    determinant = xx * yy - xy**2
    x, y = away[..., 0], away[..., 1]
    distance = (yy * x**2 - 2.0 * xy * x * y + xx * y**2) / determinant
    logs = np.log(shares[weighed])[:, None] - 0.5 * (distance + np.log(determinant)) - np.log(2.0 * np.pi)
    mixed = np.logaddexp.reduce(logs, axis=1)
    density: Array = np.maximum(mixed, FURTHEST).mean(axis=1)
    return density


def inside(seen: Observation, row: int, process_noise: float, config: Config, level: float) -> Array:
    """Return 1 where the ellipse of a candidate holds the true position at `TIMES_S`, 0 where not, nan beyond the end, (h,)."""
    variance = process_noise**2 * _process_variance(float(seen.ways.time_s[row]), config)
    covariance = seen.ways.covariance[row] + variance[:, None, None] * np.eye(2)
    return held(seen.truth.positions - seen.ways.mean[row], covariance, level)


def _process_variance(time_s: float, config: Config) -> Array:
    """Return the variance of a position at `TIMES_S` that process noise of unit density causes, (h,); none beyond the goal."""
    steps = config.foc.steps
    dt = time_s / steps
    places = np.minimum(np.rint(np.array(TIMES_S) / dt).astype(int), steps)
    variance: Array = triple_integrator_process_covariance(dt, steps, is_passing(config.duration))[places, 0, 0]
    return variance
