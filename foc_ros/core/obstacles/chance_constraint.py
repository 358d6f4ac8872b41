"""The chance constraint of one circle, linearised, and the surrogate that guarantees it.

C = R^2 - |p - o|^2 <= 0 with R ~ N(mu_R, sigma_R^2), and p - o Gaussian. Linearised at a guess p*, with d = p* - mean(o):
E[C] = mu_R^2 + sigma_R^2 - |d|^2 - 2 d.(mean(p) - p*),  Var[C] = 4 mu_R^2 sigma_R^2 + 2 sigma_R^4 + 4 d' P d,
P the covariance of p - o. Cantelli: E[C] + k sqrt(Var[C]) <= 0 gives Pr(C <= 0) >= k^2 / (1 + k^2) (paper, equations 8-15).
"""

from __future__ import annotations

import math

import numpy as np

from foc_ros.core.kernels import Matrix, Tensor, Vector, compiled
from foc_ros.core.types import Array, Obstacles

CERTAIN_K = 1e6
"""k reported where the variance is zero: eta differs from 1 by 1e-12."""


def k_of_eta(eta: float) -> float:
    """k = sqrt(eta / (1 - eta)), for eta in [0, 1)."""
    return math.sqrt(eta / (1.0 - eta))


def eta_of_k(k: float) -> float:
    """eta = k^2 / (1 + k^2); 0 where k <= 0: the surrogate then guarantees nothing."""
    return k * k / (1.0 + k * k) if k > 0 else 0.0


@compiled
def centre_trajectories(centre: Matrix, drift: Matrix, steps: int) -> Tensor:
    """Mean centres at steps 0..N, step by step, (N + 1, n, 2) [m]; centre (n, 2): now; drift (n, 2): in a step."""
    moved = np.empty((steps + 1, len(centre), 2))
    for t in range(steps + 1):
        for j in range(len(centre)):
            for axis in range(2):
                moved[t, j, axis] = centre[j, axis] + t * drift[j, axis]
    return moved


@compiled
def centres_by_obstacle(centre: Matrix, drift: Matrix, steps: int) -> Tensor:
    """Mean centres at steps 1..N, circle by circle, (n, N, 2) [m]: `courses`."""
    return np.ascontiguousarray(centre_trajectories(centre, drift, steps)[1:].transpose((1, 0, 2)))


def size_moments(obstacles: Obstacles) -> tuple[Array, Array]:
    """E[R^2] and Var[R^2], each (n,) [m^2, m^4]."""
    mean2, var = obstacles.radius**2, obstacles.radius_stddev**2
    return mean2 + var, 4 * mean2 * var + 2 * var**2


@compiled
def expected_values(offset: Tensor, position_minus_guess: Matrix, size_mean: Vector) -> Matrix:
    """E[C] (n, N) [m^2]: offset d (n, N, 2), position_minus_guess (N, 2), size_mean E[R^2] (n,)."""
    n, steps, _ = offset.shape
    value = np.empty((n, steps))
    for j in range(n):
        for t in range(steps):
            x, y = offset[j, t, 0], offset[j, t, 1]
            value[j, t] = size_mean[j] - x * x - y * y - 2 * (x * position_minus_guess[t, 0] + y * position_minus_guess[t, 1])
    return value


@compiled
def variance_at(x: float, y: float, xx: float, yy: float, xy: float, size_variance: float) -> float:
    """Var[C] of one circle at one time: d = (x, y), and xx, yy, xy the covariance of the position relative to the centre."""
    return float(size_variance + 4 * (x * x * xx + y * y * yy + 2 * x * y * xy))


@compiled
def variances(offset: Tensor, covariance: Matrix, size_variance: Vector, centre_covariance: Tensor) -> Matrix:
    """Var[C] (n, N) [m^4]: offset d (n, N, 2); covariance (3, N) of the position, xx, yy, xy; centre_covariance (n, 2, 2)."""
    n, steps, _ = offset.shape
    value = np.empty((n, steps))
    for j in range(n):
        own_xx, own_yy, own_xy = centre_covariance[j, 0, 0], centre_covariance[j, 1, 1], centre_covariance[j, 0, 1]
        for t in range(steps):
            xx, yy, xy = covariance[0, t] + own_xx, covariance[1, t] + own_yy, covariance[2, t] + own_xy
            value[j, t] = variance_at(offset[j, t, 0], offset[j, t, 1], xx, yy, xy, size_variance[j])
    return value


@compiled
def safety_factor(mean: float, variance: float) -> float:
    """k = -E / sqrt(Var) of one circle at one time; +-CERTAIN_K where the variance is zero."""
    if variance > 0:
        return float(min(max(-mean / np.sqrt(variance), -CERTAIN_K), CERTAIN_K))
    return CERTAIN_K if mean <= 0 else -CERTAIN_K


@compiled
def safety_factors(mean: Matrix, variance: Matrix) -> Matrix:
    """`k_of`, elementwise."""
    n, steps = mean.shape
    k = np.empty((n, steps))
    for j in range(n):
        for t in range(steps):
            k[j, t] = safety_factor(mean[j, t], variance[j, t])
    return k


@compiled
def safety_factors_at(
    positions: Matrix,
    covariance: Matrix,
    centres: Tensor,
    size_mean: Vector,
    size_variance: Vector,
    centre_covariance: Tensor,
) -> Matrix:
    """k achieved at mean positions (N, 2), linearised there: (n, N). centres (n, N, 2), covariance (3, N) of the position."""
    offset = np.expand_dims(positions, 0) - centres
    mean = expected_values(offset, np.zeros_like(positions), size_mean)
    return safety_factors(mean, variances(offset, covariance, size_variance, centre_covariance))
