"""Bootstrap over recordings without fitting again, and parameters that the data do not determine.

Near its maximum x the log-likelihood of each recording i is a quadratic, l_i + g_i'd + d'H_i d / 2. With weights w of the
recordings the maximum moves by one Newton step,

    d(w) = -(sum_i w_i H_i)^-1 sum_i w_i g_i,

and weights drawn as counts with replacement give the bootstrap (Efron 1979, doi:10.1214/aos/1176344552; in one step: Giordano et
al. 2019, arXiv:1806.00550). Where every setting of a grid was tried on every recording, the bootstrap is exact.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from foc_ros.analysis.evaluation.bootstrap import CENTRAL, draw_resamples
from foc_ros.analysis.evaluation.cross_validation import choose_held_out
from foc_ros.core.types import Array, Record

STEP = 0.05
"""Step of the finite differences: the parameters are logarithms, or of that order."""
FLAT = 1.0
"""Standard deviation of a logarithm above which a parameter is undetermined: 95 % then span a factor of 7 either way."""
FARTHEST = 2.0
"""Step beyond which no quadratic is trusted."""
RIDGE = 1e-3
"""Least curvature along every parameter [nat], so that a resample without any stays where it is."""


@dataclass(frozen=True)
class SettingTable:
    """Mean log-likelihood, or log-density, per prediction of n recordings under s settings (n, s); nan where nothing is known."""

    values: Array
    settings: tuple[Any, ...]

    def find_best(self, columns: Sequence[int]) -> int:
        """Return the column of some that is best for all recordings."""
        return int(columns[int(np.nansum(self.values[:, columns], axis=0).argmax())])

    def choose_held_out(self, columns: Sequence[int], groups: Sequence[Hashable]) -> NDArray[np.intp]:
        """Return the column of some, for each recording (n,), that is best for the other groups."""
        return np.array(columns)[choose_held_out(np.nan_to_num(self.values[:, columns]), groups)]

    def score(self, chosen: int | NDArray[np.intp]) -> float:
        """Return the mean over the recordings under the column chosen for all, or for each of them (n,)."""
        return float(np.nanmean(self.values[np.arange(len(self.values)), chosen]))

    def resample_best(self, columns: Sequence[int]) -> list[int]:
        """Return the best of some columns in each resample of the recordings."""
        sums = draw_resamples(len(self.values)) @ np.nan_to_num(self.values[:, columns])
        return [columns[index] for index in sums.argmax(axis=1)]


@dataclass(frozen=True, eq=False)
class Quadratic(Record):
    """Log-likelihoods about x (p,): gradient (n, p) and curvature (n, p, p) of each recording; low and high (p,): bounds."""

    x: Array
    gradient: Array
    curvature: Array
    low: Array
    high: Array

    def find_maximum(self, weights: Array) -> Array:
        """Return the maximum (p,) of the recordings weighted by (n,)."""
        gradient, curvature = weights @ self.gradient, np.einsum('i,ijk->jk', weights, self.curvature)
        values, vectors = np.linalg.eigh(-curvature)
        step = vectors @ ((vectors.T @ gradient) / np.maximum(values, RIDGE))
        return np.asarray(np.clip(self.x + np.clip(step, -FARTHEST, FARTHEST), self.low, self.high))

    def compute_interval(self) -> tuple[Array, Array]:
        """Return the 95 % interval of the bootstrap, low and high (p,)."""
        resampled = [self.find_maximum(weights) for weights in draw_resamples(len(self.gradient)).astype(float)]
        low, high = np.percentile(resampled, CENTRAL, axis=0)
        return np.minimum(low, self.x), np.maximum(high, self.x)

    @property
    def deviation(self) -> Array:
        """Standard deviations (p,) by the curvature of the sum, the least that the data allow; inf where it has no curvature."""
        values, vectors = np.linalg.eigh(-self.curvature.sum(axis=0))
        variance = np.where(values > RIDGE, 1.0 / np.maximum(values, RIDGE), np.inf)
        share = vectors**2
        share[share < 1e-6] = 0.0
        with np.errstate(invalid='ignore'):
            deviation: Array = np.sqrt(np.where(share > 0.0, share * variance, 0.0).sum(axis=1))
        return deviation

    @property
    def undetermined(self) -> list[int]:
        """The parameters that the data do not determine, or put at a bound."""
        at_bound = (self.x <= self.low + STEP) | (self.x >= self.high - STEP)
        return np.flatnonzero((self.deviation > FLAT) | at_bound).tolist()


def expand_quadratic(per_recording: Callable[[Array], Array], x: Array, low: Array, high: Array) -> Quadratic:
    """Expand log-likelihoods about a maximum x (p,) within bounds (p,) by finite differences, beside a bound inward.

    per_recording: log-likelihood of each recording (n,) [nat] at parameters (p,).
    """
    p, steps = len(x), STEP * np.eye(len(x))
    centre = np.clip(x, low + STEP, high - STEP)
    middle = per_recording(centre)
    ahead = np.array([per_recording(centre + step) for step in steps])
    behind = np.array([per_recording(centre - step) for step in steps])
    curvature = np.zeros((len(middle), p, p))
    for j in range(p):
        curvature[:, j, j] = (ahead[j] - 2.0 * middle + behind[j]) / STEP**2
        for k in range(j):
            both, neither = per_recording(centre + steps[j] + steps[k]), per_recording(centre - steps[j] - steps[k])
            mixed = both + neither + 2.0 * middle - ahead[j] - ahead[k] - behind[j] - behind[k]
            curvature[:, j, k] = curvature[:, k, j] = mixed / (2.0 * STEP**2)
    return Quadratic(centre, (ahead - behind).T / (2.0 * STEP), curvature, low, high)
