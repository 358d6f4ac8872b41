# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Paths of recordings, pooled with the planned path of a candidate.

The recordings e that pass the next row as a candidate does, displaced so that they begin at the hand, are at a time t from now at
x_e with weights w_e, which fade out over the FADE_S before a recording ends or parts from the class. With P the covariance of the
position of the hand and b = `recordings.VELOCITY_STDDEV`, by which their velocities differ from that of the hand,

    n = sum w_e,   r = sum w_e x_e / n,   R = sum w_e (x_e - r) (x_e - r)' / n + P + (b t / 2)^2 I.

The position of a plan with mean m and covariance S becomes the logarithmic opinion pool (Genest and Zidek 1986,
doi:10.1214/ss/1177013825) of both normal distributions, in which the plan counts as n_0 recordings:

    S' = ((1 - a) S^-1 + a R^-1)^-1,   m' = S' ((1 - a) S^-1 m + a R^-1 r),   a = n / (n + n_0).

From the time on at which less than half of the weight is left, m' - m decreases linearly to zero at the end of the plan.
Velocity and acceleration change by the derivatives of m' - m. Given the position, their distribution remains that of the plan.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from foc_ros.core.classes import find_path_sides
from foc_ros.core.obstacle_table import Obstacles
from foc_ros.core.obstacles.clearance import measure_clearance
from foc_ros.core.obstacles.risk import centre_trajectories
from foc_ros.core.prediction import PredictedCandidate
from foc_ros.core.solution import Solution
from foc_ros.core.types import Array, as_readonly

FADE_S = 0.25
"""Time over which the weight of a recording falls to zero before its end [s]."""
EXACT = 1e-12
"""Variance of a position that is known [m^2]: that of a micrometre."""


def pool_path(
    solution: Solution, paths: Array, weights: Array, position_covariance: Array, drift: float, prior_count: float
) -> Solution:
    """Return a solution with the mean and the covariance that recordings change; effort, costs and eta stay those of the plan.

    Parameters
    ----------
    solution
        The plan; its motor covariance remains.
    paths, weights
        What e recordings do at the m times of the plan: paths (e, m, 2) [m] that begin at the hand, and their weights (e, m).
    position_covariance
        That of the hand now (2, 2) [m^2].
    drift
        The b / 2 by which a recording departs from the hand [m/s].
    prior_count
        The number n_0 of recordings as which the plan counts.
    """
    times, count = solution.times, weights.sum(axis=0)
    covered = int(np.flatnonzero(count >= 0.5 * count[0])[-1])
    shares = np.divide(weights, count, out=np.zeros_like(weights), where=count > 0.0)
    centre = np.einsum('em,emi->mi', shares, paths)
    offset = paths - centre
    spread = np.einsum('em,emi,emj->mij', shares, offset, offset) + position_covariance
    spread += ((drift * times) ** 2 + EXACT)[:, None, None] * np.eye(2)
    position = solution.covariance[:, :2, :2] + EXACT * np.eye(2)
    share = (count / (count + prior_count))[:, None, None]
    precision, recorded_precision = np.linalg.inv(position), np.linalg.inv(spread)
    pooled = np.linalg.inv((1.0 - share) * precision + share * recorded_precision)
    pooled[0] = position[0]
    displaced = (pooled @ (share * recorded_precision) @ (centre - solution.path)[..., None])[..., 0]
    displaced[0] = 0.0
    if covered < len(times) - 1:
        displaced[covered:] = displaced[covered] * np.linspace(1.0, 0.0, len(times) - covered)[:, None]
    gain = solution.covariance[:, :, :2] @ precision
    covariance = solution.covariance + gain @ (pooled - position) @ gain.swapaxes(1, 2)
    mean = solution.mean + _differentiate(displaced, solution.dt, solution.mean.shape[1] // 2)
    return replace(solution.with_covariance(covariance), mean=as_readonly(mean))


def _differentiate(positions: Array, dt: float, orders: int) -> Array:
    """Return positions (m, 2) and their derivatives (m, 2 orders) at steps of dt [s]; the first state stays as it is."""
    found = [positions]
    for _ in range(orders - 1):
        rate = np.gradient(found[-1], dt, axis=0)
        rate[0] = 0.0
        found.append(rate)
    return np.concatenate(found, axis=1)


def stays_in_class(planned: PredictedCandidate, pooled: Solution, obstacles: Obstacles) -> bool:
    """Tell whether a pooled path passes all obstacles that the plan does, on its sides, and enters none more deeply.

    obstacles: grown by the radius of the hand.
    """
    centres = centre_trajectories(obstacles.centre, pooled.dt * obstacles.velocity, len(pooled.mean) - 1)
    sides = find_path_sides(pooled.path, obstacles, centres)
    if any(sides.get(identity) != side for identity, side in planned.sides.items()):
        return False
    clearance = measure_clearance(pooled.path, obstacles, pooled.dt)
    return clearance >= 0.0 or clearance >= measure_clearance(planned.solution.path, obstacles, pooled.dt)
