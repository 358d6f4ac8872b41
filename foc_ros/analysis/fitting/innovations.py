"""The likelihood of measured positions under the estimator's own model: the Kalman filter's innovations.

A filter with the right deviations leaves innovations v that are white and normal, so that with S the variance it expected,

    log p(z) = -1/2 sum_k (2 log(2 pi S_k) + |v_k|^2 / S_k)

is exact (Schweppe 1965, doi:10.1109/TIT.1965.1053737); both axes share S. It costs a filter's pass and no prediction.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from foc_ros.core.estimation.kalman_filter import gramian, transition
from foc_ros.core.types import Array

from .demonstrations import Demonstration


class Innovations:
    """The recordings side by side, so that one pass filters them all; gap_s: beyond it the filter starts anew [s]."""

    def __init__(self, demonstrations: Sequence[Demonstration], gap_s: float) -> None:
        most = max(len(each.times) for each in demonstrations)
        dt = np.full((most - 1, len(demonstrations)), np.inf)
        self._positions = np.zeros((most, len(demonstrations), 2))
        for row, each in enumerate(demonstrations):
            dt[: len(each.times) - 1, row] = np.diff(each.times)
            self._positions[: len(each.times), row] = each.positions
        self._goes_on = dt <= gap_s
        dt = np.where(self._goes_on, dt, gap_s)
        self._transition = np.array([[transition(each) for each in row] for row in dt])
        self._gramian = np.array([[gramian(each) for each in row] for row in dt])
        self._start = gramian(gap_s)

    def log_likelihood(self, position_stddev: float, jerk_density: float) -> Array:
        """Return the log-likelihood of the positions of each recording, (n,) [nat]; deviations in the estimator's units."""
        start = jerk_density**2 * self._start
        start[0] = start[:, 0] = 0.0
        start[0, 0] = position_stddev**2
        mean = np.zeros((self._positions.shape[1], 3, 2))
        mean[:, 0] = self._positions[0]
        covariance = np.broadcast_to(start, (len(mean), 3, 3))
        total = np.zeros(len(mean))
        for A, G, goes_on, z in zip(self._transition, self._gramian, self._goes_on, self._positions[1:], strict=True):
            mean, covariance = A @ mean, A @ covariance @ A.swapaxes(1, 2) + jerk_density**2 * G
            S = np.maximum(covariance[:, 0, 0], 0.0) + position_stddev**2
            v = z - mean[:, 0]
            total -= np.where(goes_on, np.log(2.0 * np.pi * S) + (v**2).sum(axis=1) / (2.0 * S), 0.0)
            gain = covariance[:, :, 0] / S[:, None]
            mean = mean + gain[:, :, None] * v[:, None, :]
            covariance = covariance - gain[:, :, None] * covariance[:, None, 0, :]
            if not goes_on.all():
                mean[~goes_on] = 0.0
                mean[~goes_on, 0] = z[~goes_on]
                covariance[~goes_on] = start
        return total
