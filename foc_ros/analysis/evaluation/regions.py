"""The smallest region that holds the hand with a given probability by all candidates together.

The ellipse of a candidate says where the hand is if it takes that way. What a prediction says of the position is the mixture of
all, each by its likelihood; its smallest region of probability p is where the density is above a level (Hyndman 1996,
doi:10.2307/2684423). A position lies within it if less than p of the probability is denser:

    Pr(f(Y) > f(x)) < p,  f the density of the mixture, Y distributed by it,

which is summed over the same points of every candidate: rings of equal probability, evenly in the angle.
"""

from __future__ import annotations

import numpy as np

from foc_ros.core.types import Array

RINGS = 25
"""Of one Gaussian the region is then exact at 50 and 90 %: its border lies between two rings."""
SPOKES = 4
GOLDEN = np.pi * (3.0 - np.sqrt(5.0))
"""Angle from ring to ring, so that no two have their points in the same directions [rad]."""
NEGLIGIBLE = 1e-4
"""Likelihood below which a candidate is left out."""


def _points() -> Array:
    """Return points (m, 2) that stand for the standard Gaussian, each for as much."""
    radii = np.sqrt(-2.0 * np.log1p(-(np.arange(RINGS) + 0.5) / RINGS))
    angles = GOLDEN * np.arange(RINGS)[:, None] + 2.0 * np.pi / SPOKES * np.arange(SPOKES)
    return np.stack([radii[:, None] * np.cos(angles), radii[:, None] * np.sin(angles)], axis=-1).reshape(-1, 2)


POINTS = _points()


def denser(likelihood: Array, mean: Array, covariance: Array, position: Array) -> Array:
    """Return the probability (h,) of all that is denser than a position, nan where that is not known.

    likelihood (k,) of the candidates, with mean (k, h, 2) [m] and covariance (k, h, 2, 2) [m^2], positive definite;
    position (h, 2) [m].
    """
    counted = likelihood > NEGLIGIBLE
    weight, mean, covariance = likelihood[counted], mean[counted], covariance[counted]
    weight = weight / weight.sum()
    root = np.linalg.cholesky(covariance)
    points = mean + np.einsum('khij,mj->mkhi', root, POINTS)
    level = _log_density(weight, mean, covariance, position)
    above = _log_density(weight, mean, covariance, points) > level
    share: Array = (above.mean(axis=0) * weight[:, None]).sum(axis=0)
    return np.where(np.isfinite(level), share, np.nan)


def _log_density(weight: Array, mean: Array, covariance: Array, position: Array) -> Array:
    """Return the logarithm of the mixture's density (..., h) at positions (..., h, 2)."""
    away = position[..., None, :, :] - mean
    return log_mixture(weight, away, covariance[..., 0, 0], covariance[..., 1, 1], covariance[..., 0, 1])


def log_mixture(weight: Array, away: Array, xx: Array, yy: Array, xy: Array) -> Array:
    """Return the logarithm of the density (..., h) of normal distributions with weights (k,), together.

    At away (..., k, h, 2) [m] from the middle of each, for covariances [[xx, xy], [xy, yy]] (..., k, h) [m^2].
    """
    x, y, determinant = away[..., 0], away[..., 1], xx * yy - xy**2
    distance = (yy * x**2 - 2.0 * xy * x * y + xx * y**2) / determinant
    logs = np.log(weight)[:, None] + (-0.5 * (distance + np.log(determinant)) - np.log(2.0 * np.pi))
    greatest = logs.max(axis=-2)
    density: Array = greatest + np.log(np.exp(logs - greatest[..., None, :]).sum(axis=-2))
    return density
