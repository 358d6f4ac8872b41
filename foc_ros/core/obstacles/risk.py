# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The chance constraint of an obstacle: moments of its linearised form, and the surrogate that implies it.

C = R^2 - |p - q|^2 <= 0 with R ~ N(mu_R, sigma_R^2) and p - o Gaussian, where q(p) is the point of the polygon with the centre o
that is nearest to p: that centre itself, for an obstacle. Linearised at a guess p*, with d = p* - q(p*) and mean(o):
E[C] = mu_R^2 + sigma_R^2 - |d|^2 - 2 d.(mean(p) - p*),  Var[C] = 4 mu_R^2 sigma_R^2 + 2 sigma_R^4 + 4 d' P d,
P the covariance of p - o. Cantelli: E[C] + k sqrt(Var[C]) <= 0 gives Pr(C <= 0) >= k^2 / (1 + k^2) (paper, equations 8-15). The
safety factor k of a movement is -E[C] / sqrt(Var[C]), linearised at its own mean. Where C is Gaussian, Pr(C <= 0) = Phi(k). By
Boole's inequality n events, each with a probability of failure of at most 1 - p, all succeed with at least 1 - n (1 - p).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from statistics import NormalDist

import numpy as np

from foc_ros.core.obstacle_table import Obstacles
from foc_ros.core.types import Array

CERTAIN_K = 1e6
"""Safety factor reported where the variance is zero: eta then differs from 1 by 1e-12."""


def k_of_eta(eta: float) -> float:
    """Return k = sqrt(eta / (1 - eta)), for eta in [0, 1)."""
    return math.sqrt(eta / (1.0 - eta))


def eta_of_k(k: float) -> float:
    """Return eta = k^2 / (1 + k^2); 0 for k <= 0, where the surrogate guarantees nothing."""
    return k * k / (1.0 + k * k) if k > 0 else 0.0


@dataclass(frozen=True)
class RiskBound:
    """What a safety factor k guarantees.

    bound: `cantelli`, for any distribution, or `gaussian`; events: number of pairs of an obstacle and a step that eta covers
    together, 1 where it covers each of them alone.
    """

    bound: str = 'cantelli'
    events: int = 1

    def find_safety_factor(self, eta: float) -> float:
        """Return the smallest k >= 0 that guarantees eta, for eta in [0, 1)."""
        share = 1.0 - (1.0 - eta) / self.events
        if self.bound == 'cantelli':
            return k_of_eta(share)
        return max(NormalDist().inv_cdf(share), 0.0) if share > 0.0 else 0.0

    def find_probability(self, k: float) -> float:
        """Return the eta that k guarantees."""
        share = eta_of_k(k) if self.bound == 'cantelli' else NormalDist().cdf(k)
        return max(1.0 - self.events * (1.0 - share), 0.0)


CANTELLI = RiskBound()
"""The bound of the paper, for each obstacle at each step."""


def count_events(risk: str, obstacles: int, steps: int) -> int:
    """Return the number of events that eta covers together, for a value of `foc.risk` and numbers of obstacles and steps."""
    return max(obstacles * steps, 1) if risk == 'path' else 1


def size_moments(obstacles: Obstacles) -> tuple[Array, Array]:
    """Return E[R^2] [m^2] and Var[R^2] [m^4] of each obstacle, (n,) each."""
    mean2, var = obstacles.radius**2, obstacles.radius_stddev**2
    return mean2 + var, 4 * mean2 * var + 2 * var**2


def centre_trajectories(centre: Array, drift: Array, steps: int) -> Array:
    """Return mean centres at steps 0..N, (N + 1, n, 2) [m], from those now (n, 2) [m] and their drift per step (n, 2) [m].

    For the drifts of r movements with different steps, (r, 1, n, 2), they are (r, N + 1, n, 2).
    """
    moved: Array = centre + np.arange(steps + 1.0)[:, None, None] * drift
    return moved


def compute_safety_factor(distance: Array, variance: Array, size_mean: Array, size_variance: Array) -> Array:
    """Return k = -E[C] / sqrt(Var[C]) at some positions, linearised there; +-CERTAIN_K where nothing is uncertain.

    Parameters
    ----------
    distance : Array
        Signed distance D from the polygon [m], of any shape (...).
    variance : Array
        Variance n' P n of the position along the normal [m^2], (...).
    size_mean, size_variance : Array
        E[R^2] [m^2] and Var[R^2] [m^4], which broadcast to (...).

    Returns
    -------
    Array
        (D |D| - E[R^2]) / sqrt(Var[R^2] + 4 D^2 n' P n), (...) (paper, equations 8-15).
    """
    square = distance * np.abs(distance)
    spread = np.sqrt(size_variance + 4.0 * np.abs(square) * variance)
    certain = np.where(square >= size_mean, CERTAIN_K, -CERTAIN_K)
    k: Array = np.divide(square - size_mean, spread, out=certain, where=spread > 0.0)
    return np.clip(k, -CERTAIN_K, CERTAIN_K)
