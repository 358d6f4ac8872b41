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
from typing import NamedTuple

import numpy as np

from foc_ros.core.kernels import Indices, Matrix, Tensor, Vector, compiled, compiled_with_caller
from foc_ros.core.types import Array, Obstacles

from .rounded_polygon import Polygons, find_offset

CERTAIN_K = 1e6
"""Safety factor reported where the variance is zero: eta then differs from 1 by 1e-12."""


class UncertainObstacles(NamedTuple):
    """m rounded polygons whose centres and radii are Gaussian.

    centre (m, 2): mean centres at step 0 [m]; drift (m, 2): how far they move in a step [m]; size_mean, size_variance (m,):
    E[R^2] [m^2] and Var[R^2] [m^4]; centre_covariance (m, 2, 2) [m^2]; ignored_until (m,): steps from now before which an
    obstacle does not count, because the hand is still leaving its margin; polygons: around the centres.
    """

    centre: Matrix
    drift: Matrix
    size_mean: Vector
    size_variance: Vector
    centre_covariance: Tensor
    ignored_until: Vector
    polygons: Polygons


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
    """Return mean centres at steps 0..N, (N + 1, n, 2) [m], from those now (n, 2) [m] and their drift per step (n, 2) [m]."""
    moved: Array = centre + np.arange(steps + 1.0)[:, None, None] * drift
    return moved


@compiled
def find_first_alike(obstacles: UncertainObstacles, tolerance: float) -> Indices:
    """Return for each obstacle the first one of the same shape, (m,).

    Their centres, drifts, root mean square radii and vertices differ by less than a tolerance.
    """
    first, reach, polygons = np.arange(len(obstacles.centre)), np.sqrt(obstacles.size_mean), obstacles.polygons
    for i in range(len(first)):
        for j in range(i):
            difference = abs(reach[i] - reach[j])
            for axis in range(2):
                difference = max(difference, abs(obstacles.centre[i, axis] - obstacles.centre[j, axis]))
                difference = max(difference, abs(obstacles.drift[i, axis] - obstacles.drift[j, axis]))
                for corner in range(polygons.corners[i]):
                    apart = polygons.vertices[i, corner, axis] - polygons.vertices[j, corner, axis]
                    difference = max(difference, abs(apart))
            if difference < tolerance and polygons.corners[i] == polygons.corners[j]:
                first[i] = j
                break
    return first


@compiled_with_caller
def safety_factor(mean: float, variance: float) -> float:
    """Return k = -E / sqrt(Var) of one obstacle at one time; +-CERTAIN_K where the variance is zero."""
    if variance > 0:
        return float(min(max(-mean / np.sqrt(variance), -CERTAIN_K), CERTAIN_K))
    return CERTAIN_K if mean <= 0 else -CERTAIN_K


@compiled
def constraint_moments(positions: Matrix, covariance: Matrix, obstacles: UncertainObstacles) -> tuple[Matrix, Matrix]:
    """Return E[C] [m^2] and Var[C] [m^4] of m obstacles at steps 1..N, (m, N) each, linearised at mean positions.

    positions (N, 2) [m]; covariance (3, N): rows xx, yy, xy [m^2]. E[C] is minus infinity where an obstacle does not count.
    """
    m, steps = len(obstacles.centre), len(positions)
    mean, variance = np.empty((m, steps)), np.empty((m, steps))
    for j in range(m):
        own = obstacles.centre_covariance[j]
        for t in range(steps):
            x = positions[t, 0] - (obstacles.centre[j, 0] + (t + 1) * obstacles.drift[j, 0])
            y = positions[t, 1] - (obstacles.centre[j, 1] + (t + 1) * obstacles.drift[j, 1])
            xx, yy, xy = covariance[0, t] + own[0, 0], covariance[1, t] + own[1, 1], covariance[2, t] + own[0, 1]
            offset = find_offset(obstacles.polygons, j, x, y)
            x, y = offset.x, offset.y
            mean[j, t] = (
                obstacles.size_mean[j] - offset.side * (x * x + y * y) if t + 1.0 >= obstacles.ignored_until[j] else -np.inf
            )
            variance[j, t] = obstacles.size_variance[j] + 4 * (x * x * xx + y * y * yy + 2 * x * y * xy)
    return mean, variance
