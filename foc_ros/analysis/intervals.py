# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Bootstrap intervals (Efron 1979, doi:10.1214/aos/1176344552); equal data give equal intervals.

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


def draw_rows(n: int, seed: int = SEED, resamples: int = RESAMPLES) -> NDArray[np.intp]:
    """Return the rows, out of n, that are drawn in each resample, (resamples, n)."""
    return np.random.default_rng(seed).integers(0, n, (resamples, n))


def resample(statistic: Callable[[NDArray[np.intp]], float], n: int) -> Array:
    """Return a statistic of the rows, out of n, that are drawn in each resample, (RESAMPLES,)."""
    return np.array([float(statistic(rows)) for rows in draw_rows(n)])


def compute_mean_interval(values: Array, group: NDArray[Any], seed: int = SEED, resamples: int = RESAMPLES) -> list[float]:
    """Return the interval of 95 % [low, high] of the mean of values (m,), at least one, of which groups (m,) are drawn."""
    _, number = np.unique(group, return_inverse=True)
    sums, counts = np.bincount(number, values), np.bincount(number)
    drawn = draw_rows(len(counts), seed, resamples)
    ends: list[float] = np.percentile(sums[drawn].sum(axis=1) / counts[drawn].sum(axis=1), CENTRAL).tolist()
    return ends
