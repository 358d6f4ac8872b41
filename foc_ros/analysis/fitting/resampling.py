"""Fits of resampled recordings without fitting again, and what the data cannot tell.

Near its maximum x the log-likelihood of each recording i is a quadratic, l_i + g_i'd + d'H_i d / 2. With weights w of the
recordings the maximum moves by one Newton step,

    d(w) = -(sum_i w_i H_i)^-1 sum_i w_i g_i,

and weights drawn as counts with replacement give the bootstrap (Efron 1979, doi:10.1214/aos/1176344552; in one step: Giordano et
al. 2019, arXiv:1806.00550).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from foc_ros.core.types import Array, Record

RESAMPLES = 1000
SEED = 1
CENTRAL = (2.5, 97.5)
"""Percentiles of an interval of 95 %."""
STEP = 0.05
"""Step of the finite differences: the parameters are logarithms, or of that order."""
FLAT = 1.0
"""Standard deviation of a logarithm from which on the data do not tell a parameter: a factor of 7 either way is within 95 %."""
FARTHEST = 2.0
"""Step beyond which no quadratic is trusted."""
RIDGE = 1e-3
"""Curvature added along every parameter [nat]: where the data have none a resample goes nowhere, instead of to infinity."""

PerRecording = Callable[[Array], Array]
"""Log-likelihood of each recording (n,) [nat] at parameters (p,)."""


def resamples(n: int) -> NDArray[np.int64]:
    """Return how often each of n recordings is drawn in every resample, (RESAMPLES, n)."""
    return np.random.default_rng(SEED).multinomial(n, np.full(n, 1.0 / n), RESAMPLES)


@dataclass(frozen=True, eq=False)
class Quadratic(Record):
    """Log-likelihoods about x (p,): gradient (n, p) and curvature (n, p, p) of each recording; low and high (p,): bounds."""

    x: Array
    gradient: Array
    curvature: Array
    low: Array
    high: Array

    def moved(self, weights: Array) -> Array:
        """Return the maximum (p,) of the recordings weighted by (n,)."""
        gradient, curvature = weights @ self.gradient, np.einsum('i,ijk->jk', weights, self.curvature)
        values, vectors = np.linalg.eigh(-curvature)
        step = vectors @ ((vectors.T @ gradient) / np.maximum(values, RIDGE))
        moved: Array = np.clip(self.x + np.clip(step, -FARTHEST, FARTHEST), self.low, self.high)
        return moved

    def resampled(self) -> Array:
        """Return the maximum of each resample, (RESAMPLES, p)."""
        return np.array([self.moved(each) for each in resamples(len(self.gradient)).astype(float)])

    def interval(self) -> tuple[Array, Array]:
        """Return the bootstrap's interval of 95 %, low and high (p,)."""
        low, high = np.percentile(self.resampled(), CENTRAL, axis=0)
        return np.minimum(low, self.x), np.maximum(high, self.x)

    @property
    def deviation(self) -> Array:
        """Standard deviations (p,) by the curvature of the sum: what the data could tell at best; inf where they tell nothing."""
        values, vectors = np.linalg.eigh(-self.curvature.sum(axis=0))
        told = values > RIDGE
        variance = np.where(told, 1.0 / np.maximum(values, RIDGE), np.inf)
        share = vectors**2
        share[share < 1e-6] = 0.0
        with np.errstate(invalid='ignore'):
            summed = np.where(share > 0.0, share * variance, 0.0).sum(axis=1)
        deviation: Array = np.sqrt(summed)
        return deviation

    @property
    def undetermined(self) -> list[int]:
        """The parameters that the data do not tell, or put at a bound."""
        at_bound = (self.x <= self.low + STEP) | (self.x >= self.high - STEP)
        return np.flatnonzero((self.deviation > FLAT) | at_bound).tolist()


def quadratic(per_recording: PerRecording, x: Array, low: Array, high: Array) -> Quadratic:
    """Take the log-likelihoods about a maximum x (p,) within bounds (p,); beside a bound, differences are taken inward."""
    p, steps = len(x), STEP * np.eye(len(x))
    centre = np.clip(x, low + STEP, high - STEP)
    middle = per_recording(centre)
    ahead = np.array([per_recording(centre + step) for step in steps])
    behind = np.array([per_recording(centre - step) for step in steps])
    gradient = (ahead - behind).T / (2.0 * STEP)
    curvature = np.zeros((len(middle), p, p))
    for j in range(p):
        curvature[:, j, j] = (ahead[j] - 2.0 * middle + behind[j]) / STEP**2
        for k in range(j):
            both, neither = per_recording(centre + steps[j] + steps[k]), per_recording(centre - steps[j] - steps[k])
            mixed = both + neither + 2.0 * middle - ahead[j] - ahead[k] - behind[j] - behind[k]
            curvature[:, j, k] = curvature[:, k, j] = mixed / (2.0 * STEP**2)
    return Quadratic(centre, gradient, curvature, low, high)
