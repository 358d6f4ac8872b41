# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""A posterior over a grid of values: a prior, what observations add, and the mean. All that is learnt of an operator uses it.

With the prior p and the log-likelihoods l_i of independent observations, the probability of a point g of the grid is

    P(g) ~ p(g) exp(sum_i l_i(g)).

Where l is a loss that is no likelihood, c times its negative takes its place (the Gibbs posterior of Bissiri et al. 2016,
doi:10.1111/rssb.12158).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from foc_ros.core.types import Array, Record


@dataclass(frozen=True, eq=False)
class GridPosterior(Record):
    """Probabilities of the points of a grid.

    axes: the values along each axis; logs: logarithm of the probability of each point, up to a constant.
    """

    axes: tuple[Array, ...]
    logs: Array

    @classmethod
    def from_normal(cls, axes: tuple[Array, ...], stddevs: tuple[float, ...]) -> GridPosterior:
        """Return the prior of independent normal distributions with the mean 0; infinite deviations make all values alike."""
        squares = [-0.5 * (axis / stddev) ** 2 for axis, stddev in zip(axes, stddevs, strict=True)]
        grids = np.meshgrid(*squares, indexing='ij')
        return cls(axes, np.sum(grids, axis=0))

    def add(self, logs: Array) -> GridPosterior:
        """Return the posterior after an observation; logs: its log-likelihood at each point of the grid."""
        return GridPosterior(self.axes, self.logs + logs)

    def weights(self) -> Array:
        """Return the probability of each point."""
        weights: Array = np.exp(self.logs - self.logs.max())
        return np.asarray(weights / weights.sum())

    def mean(self) -> tuple[float, ...]:
        """Return the mean along each axis."""
        weights = self.weights()
        others = [tuple(other for other in range(weights.ndim) if other != axis) for axis in range(weights.ndim)]
        return tuple(float(weights.sum(axis=rest) @ values) for rest, values in zip(others, self.axes, strict=True))

    def given(self, row: int) -> GridPosterior:
        """Return the posterior of the other axes given the value in a row of the first one."""
        return GridPosterior(self.axes[1:], self.logs[row])
