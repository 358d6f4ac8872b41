# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Bootstrap intervals by SciPy (Efron 1979, doi:10.1214/aos/1176344552); equal data give equal intervals.

What is drawn are recordings or trials, because predictions within one recording are not independent.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from foc_ros.core.types import Array

RESAMPLES, SEED = 1000, 1
CENTRAL = (2.5, 97.5)
"""Percentiles of an interval of 95 %."""


def resample(statistic: Callable[[NDArray[np.intp]], float], n: int) -> Array:
    """Return a statistic of the rows, out of n, that are drawn in each resample, (RESAMPLES,)."""
    if n == 1:
        return np.full(RESAMPLES, float(statistic(np.zeros(1, dtype=np.intp))))
    drawn = _bootstrap((np.arange(n),), lambda rows: float(statistic(rows)), vectorized=False)
    return np.asarray(drawn.bootstrap_distribution)


def compute_mean_interval(values: Array, group: NDArray[Any], seed: int = SEED, resamples: int = RESAMPLES) -> list[float]:
    """Return the interval of 95 % [low, high] of the mean of values (m,), at least one, of which groups (m,) are drawn."""
    _, number = np.unique(group, return_inverse=True)
    parts = np.bincount(number, values), np.bincount(number)
    if len(parts[0]) == 1:
        return [float(values.mean())] * 2

    def find_mean(sums: Array, counts: Array, axis: int) -> Array:
        return np.asarray(sums.sum(axis=axis) / counts.sum(axis=axis))

    found = _bootstrap(parts, find_mean, seed, resamples, paired=True, vectorized=True)
    return [float(end) for end in found.confidence_interval]


def _bootstrap(
    data: tuple[NDArray[Any], ...], statistic: Callable[..., Any], seed: int = SEED, resamples: int = RESAMPLES, **options: Any
) -> Any:
    from scipy.stats import bootstrap  # not before: worker processes do without its 30 MB

    draws = np.random.default_rng(seed)
    return bootstrap(data, statistic, n_resamples=resamples, method='percentile', random_state=draws, **options)
