"""Bootstrap over recordings (Efron 1979, doi:10.1214/aos/1176344552): predictions within one recording are not independent."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from foc_ros.core.types import Array

RESAMPLES = 1000
SEED = 1
CENTRAL = (2.5, 97.5)
"""Percentiles of an interval of 95 %."""


def draw_resamples(n: int) -> NDArray[np.int64]:
    """Return how often each of n recordings is drawn in every resample, (RESAMPLES, n)."""
    return np.random.default_rng(SEED).multinomial(n, np.full(n, 1.0 / n), RESAMPLES)


def compute_mean_interval(values: Array, recording: Array) -> list[float]:
    """Return the interval of 95 % [low, high] of the mean of values (m,), at least one, from recordings (m,)."""
    _, number = np.unique(recording, return_inverse=True)
    weights = draw_resamples(int(number.max()) + 1)
    sums, counts = weights @ np.bincount(number, values), weights @ np.bincount(number)
    low, high = np.percentile(sums / counts, CENTRAL).tolist()
    return [low, high]
