# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Positions and covariances between the steps of a horizon.

Within a step the position of a plant is the cubic through its positions and velocities at both ends. For the triple integrator,
whose jerk is constant within a step, this is exact. Variances follow quintics through their values and their first two
derivatives.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from foc_ros.core.types import Array

CUBIC = np.array([[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [-3.0, -2.0, 3.0, -1.0], [2.0, 1.0, -2.0, 1.0]])
"""Coefficients of each power of the share (rows) in the weights of `hermite`."""
QUINTIC = np.array(
    [
        [1.0, 0.0, 0.0, 0.0, 0.0, 0.0],
        [0.0, 1.0, 0.0, 0.0, 0.0, 0.0],
        [0.0, 0.0, 0.5, 0.0, 0.0, 0.0],
        [-10.0, -6.0, -1.5, 10.0, -4.0, 0.5],
        [15.0, 8.0, 1.5, -15.0, 7.0, -1.0],
        [-6.0, -3.0, -0.5, 6.0, -3.0, 0.5],
    ]
)
"""Coefficients of each power of the share (rows) in the weights of `hermite_quintic`."""


def hermite(share: Array) -> Array:
    """Return the weights (..., 4) of the position and velocity at the beginning and the end of a step, for shares in [0, 1]."""
    weights: Array = _raise(share, len(CUBIC)) @ CUBIC
    return weights


def hermite_quintic(share: Array) -> Array:
    """Return the weights (..., 6) of value, rate and second derivative at both ends of a step, for shares in [0, 1]."""
    weights: Array = _raise(share, len(QUINTIC)) @ QUINTIC
    return weights


def _raise(share: Array, count: int) -> Array:
    """Return the first powers (..., count) of shares (...)."""
    powers = np.empty((*share.shape, count))
    powers[..., 0], powers[..., 1:] = 1.0, share[..., None]
    return np.multiply.accumulate(powers, axis=-1, out=powers)


def pair_steps(motion: Array) -> Array:
    """Return what is known at both ends of each step, (N, 4, ...), from positions and rates at steps 0..N, (N + 1, 2, ...)."""
    return np.concatenate((motion[:-1], motion[1:]), axis=1)


def locate(times: Array, steps: int) -> tuple[NDArray[np.intp], Array]:
    """Return the step of `steps` in which each time (...) [steps] lies, and the share of it that has passed."""
    step = np.minimum(times.astype(np.intp), steps - 1)
    return step, times - step


def interpolate_linear(values: Array, at: Array) -> Array:
    """Return values (..., m, n) at times (..., m) [steps], linear between those at steps 0..N, (..., N + 1, n)."""
    step, share = locate(at[..., None], values.shape[-2] - 1)
    found: Array = (1.0 - share) * np.take_along_axis(values, step, -2) + share * np.take_along_axis(values, step + 1, -2)
    return found


def interpolate_position(mean: Array, dt: Array | float, times: Array) -> Array:
    """Return the mean positions (..., m, 2) [m] at times (..., m) [s] from states (..., N + 1, n) at steps of dt (...) [s].

    All leading axes are the same.
    """
    dt = np.asarray(dt)[..., None]
    step, share = locate(times / dt, mean.shape[-2] - 1)
    known = np.concatenate((mean[..., :2], dt[..., None] * mean[..., 2:4]), axis=-1)
    ends = [np.take_along_axis(known, each[..., None], -2) for each in (step, step + 1)]
    position: Array = (hermite(share)[..., None, :] @ np.concatenate(ends, axis=-1).reshape(*times.shape, 4, 2))[..., 0, :]
    return position


def interpolate_covariance(covariance: Array, dt: float, times: Array) -> Array:
    """Return the covariance (..., 2, 2) of the position [m^2] at times (...) [s] from (N + 1, n, n) at steps of dt [s].

    The derivatives of the covariance of the position p are C' = cov(p, v) + cov(v, p) and C'' = 2 cov(v, v) + cov(p, a) +
    cov(a, p). A state without the acceleration a does not tell them, and then C changes evenly within a step.
    """
    step, share = locate(times / dt, len(covariance) - 1)
    position = covariance[:, :2, :2]
    if covariance.shape[1] < 6:
        share = share[..., None, None]
        even: Array = (1.0 - share) * position[step] + share * position[step + 1]
        return even
    rate, bend = covariance[:, :2, 2:4], covariance[:, :2, 4:6]
    change = dt * (rate + rate.swapaxes(1, 2))
    curvature = dt**2 * (2.0 * covariance[:, 2:4, 2:4] + bend + bend.swapaxes(1, 2))
    known = np.stack((position, change, curvature), axis=1)
    ends = np.concatenate((known[:-1], known[1:]), axis=1).reshape(-1, 6, 4)
    found: Array = (hermite_quintic(share)[..., None, :] @ ends[step])[..., 0, :].reshape(*times.shape, 2, 2)
    return found
