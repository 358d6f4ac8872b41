"""The minimum-jerk movement from the hand straight to a goal, obstacles disregarded: the simplest model of a reach.

The quintic from position, velocity and acceleration to rest after T has a closed form (Mueller, Hehn and D'Andrea 2015,
doi:10.1109/TRO.2015.2479878). Its jerk is alpha t^2 / 2 + beta t + gamma. With (dp, dv, da), by which a hand without jerk would
miss the goal at T,

    (alpha, beta, gamma) = M (dp, dv, da),
    M = [[720, -360 T, 60 T^2], [-360 T, 168 T^2, -24 T^3], [60 T^2, -24 T^3, 3 T^4]] / T^5.
"""

from __future__ import annotations

import numpy as np

from foc_ros.core.types import Array

from .observations import Observation


def compute_straight_costs(observation: Observation) -> Array:
    """Return the cost [m^2/s^5] of the movement to each goal, (g,): the integral of squared jerk."""
    alpha, beta, gamma, T = _compute_jerk(observation)
    effort = (
        gamma**2 * T + beta * gamma * T**2 + (beta**2 + alpha * gamma) * T**3 / 3 + alpha * beta * T**4 / 4 + alpha**2 * T**5 / 20
    )
    return np.asarray(effort.sum(axis=1))


def compute_straight_positions(observation: Observation, goal: int, seconds: Array) -> Array:
    """Return the positions (h, 2) [m] of the movement to a goal some seconds (h,) from now; at the goal once it has ended."""
    alpha, beta, gamma, T = (each[goal] for each in _compute_jerk(observation))
    t = np.minimum(seconds, T[0])[:, None]
    x, v, a = _find_state(observation)
    return np.asarray(x + v * t + a * t**2 / 2 + (gamma * t**3 / 6 + beta * t**4 / 24 + alpha * t**5 / 120))


def _find_state(observation: Observation) -> Array:
    """Return position, velocity and acceleration (3, 2); at rest the last two are noise, and 0 as in the predictor."""
    state = observation.hand.reshape(3, 2).copy()
    if observation.movement_age_s == 0.0:
        state[1:] = 0.0
    return state


def _compute_jerk(observation: Observation) -> tuple[Array, Array, Array, Array]:
    """Return alpha, beta and gamma, (g, 2) each, and T (g, 1) [s] of the movement to each goal."""
    x, v, a = _find_state(observation)
    T = np.array([_find_time(observation, goal) for goal in range(len(observation.goals))])[:, None]
    dp, dv, da = observation.goals - x - v * T - a * T**2 / 2, -v - a * T, -a
    alpha = (720 * dp - 360 * T * dv + 60 * T**2 * da) / T**5
    beta = (-360 * T * dp + 168 * T**2 * dv - 24 * T**3 * da) / T**5
    gamma = (60 * T**2 * dp - 24 * T**3 * dv + 3 * T**4 * da) / T**5
    return alpha, beta, gamma, T


def _find_time(observation: Observation, goal: int) -> float:
    """Return the time that the predictor gave the movement to a goal, or the longest time where no candidate leads there."""
    candidates = observation.candidates
    times = candidates.time_s[candidates.goal == goal]
    return float(times[0]) if len(times) else float(candidates.time_s.max())
