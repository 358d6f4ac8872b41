"""The chance constraint of one circle, linearised, and the surrogate that guarantees it.

C = R^2 - |p - o|^2 <= 0 with R ~ N(mu_R, sigma_R^2), and p - o Gaussian. Linearised at a guess p*, with d = p* - mean(o):
E[C] = mu_R^2 + sigma_R^2 - |d|^2 - 2 d.(mean(p) - p*),  Var[C] = 4 mu_R^2 sigma_R^2 + 2 sigma_R^4 + 4 d' P d,
P the covariance of p - o. Cantelli: E[C] + k sqrt(Var[C]) <= 0 gives Pr(C <= 0) >= k^2 / (1 + k^2) (paper, equations 8-15).
"""

from __future__ import annotations

import math

import numpy as np

from .records import Array, Obstacles

CERTAIN_K = 1e6
"""k reported where the variance is zero: eta differs from 1 by 1e-12."""


def k_of_eta(eta: float) -> float:
    """k = sqrt(eta / (1 - eta)), for eta in [0, 1)."""
    return math.sqrt(eta / (1.0 - eta))


def eta_of_k(k: float) -> float:
    """eta = k^2 / (1 + k^2); 0 where k <= 0: the surrogate then guarantees nothing."""
    return k * k / (1.0 + k * k) if k > 0 else 0.0


def centres(obstacles: Obstacles, dt: float, steps: int) -> Array:
    """Mean centres at steps 1..N, (n, N, 2) [m]: moved on at their velocity."""
    times = dt * np.arange(1, steps + 1)
    moved: Array = obstacles.centre[:, None, :] + times[None, :, None] * obstacles.velocity[:, None, :]
    return moved


def size_moments(obstacles: Obstacles) -> tuple[Array, Array]:
    """E[R^2] and Var[R^2], each (n,) [m^2, m^4]."""
    mean2, var = obstacles.radius**2, obstacles.radius_stddev**2
    return mean2 + var, 4 * mean2 * var + 2 * var**2


def expectation(offset: Array, position_minus_guess: Array, size_mean: Array) -> Array:
    """E[C] (n, N) [m^2]: offset d (n, N, 2), position_minus_guess (N, 2), size_mean E[R^2] (n,)."""
    value: Array = (
        size_mean[:, None] - np.einsum('jti,jti->jt', offset, offset) - 2 * np.einsum('jti,ti->jt', offset, position_minus_guess)
    )
    return value


def variance(offset: Array, covariance: Array, size_variance: Array, centre_covariance: Array) -> Array:
    """Var[C] (n, N) [m^4]: offset d (n, N, 2); covariance (3, N) of the position, xx, yy, xy; centre_covariance (n, 2, 2)."""
    x, y = offset[..., 0], offset[..., 1]
    xx = covariance[0] + centre_covariance[:, 0, 0, None]
    yy = covariance[1] + centre_covariance[:, 1, 1, None]
    xy = covariance[2] + centre_covariance[:, 0, 1, None]
    value: Array = size_variance[:, None] + 4 * (x * x * xx + y * y * yy + 2 * x * y * xy)
    return value


def achieved_k(mean: Array, stddev: Array) -> Array:
    """k = -E / sqrt(Var), elementwise; +-CERTAIN_K where the variance is zero."""
    with np.errstate(divide='ignore', invalid='ignore'):
        k = np.where(stddev > 0, -mean / stddev, np.where(mean <= 0, CERTAIN_K, -CERTAIN_K))
    return np.clip(k, -CERTAIN_K, CERTAIN_K)
