# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The Singer model of a manoeuvring target (Singer 1970, doi:10.1109/TAES.1970.310128), which knows no scene.

Per axis the state is (position, velocity, acceleration). The acceleration has the standard deviation sigma and decays with the
time constant tau. It is driven by white noise, a' = -a / tau + w, of spectral density 2 sigma^2 / tau. A Kalman filter follows
the recorded positions, and its state is propagated ahead. All settings are filtered together.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from itertools import product
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import expm

from foc_ros.core.types import NANOSECONDS, Array

from .observations import ObservedRecording
from .scores import choose_held_out
from .truth import HORIZONS, HORIZONS_S

FIRST_SPEED = 1.0
"""Standard deviation of the velocity at the first sample [m/s]."""


class SingerSetting(NamedTuple):
    """Standard deviations of the acceleration [m/s^2] and of a measured position [m], decay time of the acceleration [s]."""

    acceleration_stddev: float
    position_stddev: float
    decay_s: float


SINGER_SETTINGS = tuple(
    SingerSetting(*each) for each in product(np.geomspace(0.05, 6.4, 8).tolist(), (2e-4, 1e-3), (0.1, 0.3, 1.0))
)
"""The settings that are tried."""


def forecast_singer(stamps_ns: NDArray[np.int64], positions: Array, at_ns: Array, ahead_s: Array) -> tuple[Array, Array]:
    """Forecast the positions some times (h,) [s] after each of some stamps (m,) [ns], which are among those of the samples.

    stamps_ns (n,), rising, and positions (n, 2) [m] of the samples. Returns the mean (m, s, h, 2) [m] and the variance (m, s, h)
    [m^2] per axis under each of the s `SINGER_SETTINGS`; each forecast uses the samples up to its stamp.
    """
    accelerations, noises, _ = np.array(SINGER_SETTINGS).T
    state, covariance = np.zeros((len(SINGER_SETTINGS), 3, 2)), np.zeros((len(SINGER_SETTINGS), 3, 3))
    state[:, 0], covariance[:, 0, 0] = positions[0], noises**2
    covariance[:, 1, 1], covariance[:, 2, 2] = FIRST_SPEED**2, accelerations**2
    wanted, means, variances, last_ns = set(at_ns.tolist()), [], [], int(stamps_ns[0])
    ahead = [_discretise(float(each)) for each in ahead_s]
    for stamp_ns, position in zip(stamps_ns.tolist(), positions, strict=True):
        if stamp_ns > last_ns:
            state, covariance = _propagate(state, covariance, _discretise((stamp_ns - last_ns) / NANOSECONDS))
            gain = covariance[:, :, 0] / (covariance[:, 0, 0] + noises**2)[:, None]
            state = state + gain[:, :, None] * (position - state[:, 0])[:, None]
            kept = np.eye(3) - gain[:, :, None] * np.eye(3)[0]
            # Joseph form: the covariance stays positive
            covariance = kept @ covariance @ kept.swapaxes(1, 2) + noises[:, None, None] ** 2 * gain[:, :, None] * gain[:, None]
            last_ns = stamp_ns
        if stamp_ns in wanted:
            wanted.remove(stamp_ns)
            later = [_propagate(state, covariance, each) for each in ahead]
            means.append(np.stack([each[:, 0] for each, _ in later], axis=1))
            variances.append(np.stack([each[:, 0, 0] for _, each in later], axis=1))
    return np.array(means), np.array(variances)


def _propagate(state: Array, covariance: Array, model: tuple[Array, Array]) -> tuple[Array, Array]:
    transition, added = model
    return transition @ state, transition @ covariance @ transition.swapaxes(1, 2) + added


@lru_cache(maxsize=4096)
def _discretise(dt: float) -> tuple[Array, Array]:
    """Return transition and added covariance (s, 3, 3) over dt [s] for each setting, by Van Loan (1978)."""
    rate = np.zeros((len(SINGER_SETTINGS), 6, 6))
    accelerations, _, decays = np.array(SINGER_SETTINGS).T
    drift = np.zeros((len(SINGER_SETTINGS), 3, 3))
    drift[:, 0, 1] = drift[:, 1, 2] = 1.0
    drift[:, 2, 2] = -1.0 / decays
    rate[:, :3, :3], rate[:, 3:, 3:] = -drift, drift.swapaxes(1, 2)
    rate[:, 2, 5] = 2.0 * accelerations**2 / decays
    grown = expm(rate * dt)
    transition = grown[:, 3:, 3:].swapaxes(1, 2)
    return transition, transition @ grown[:, :3, 3:]


def score_singer(recordings: Sequence[ObservedRecording]) -> Array:
    """Return the negative log-densities (m, 3) of the true positions [nat, metres], each with the setting best for the others."""
    tables = [_tabulate_densities(each) for each in recordings]
    table = np.array([-np.nansum(each, axis=(0, 2)) for each in tables])
    chosen = choose_held_out(table, [each.name for each in recordings])
    return np.concatenate([each[:, setting] for each, setting in zip(tables, chosen, strict=True)])


def _tabulate_densities(recording: ObservedRecording) -> Array:
    """Return the negative log-densities of the true positions (m, s, 3) [nat, metres] under each setting."""
    path, observations = recording.path, recording.observations
    stamps_ns = np.array([each.stamp_ns for each in observations])
    mean, variance = forecast_singer(path.stamps_ns, path.positions, stamps_ns, np.array(HORIZONS_S))
    true = np.array([each.truth.positions[HORIZONS] for each in observations])
    squared = ((true[:, None] - mean) ** 2).sum(axis=-1)
    return np.asarray(np.log(2.0 * np.pi * variance) + squared / (2.0 * variance))
