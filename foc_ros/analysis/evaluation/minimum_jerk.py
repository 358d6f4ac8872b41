"""The minimum-jerk movement from the hand straight to a goal, obstacles disregarded: the simplest model of a reach.

The quintic from position, velocity and acceleration to rest in T, in closed form (Mueller, Hehn and D'Andrea 2015,
doi:10.1109/TRO.2015.2479878): jerk alpha t^2 / 2 + beta t + gamma, where with what a hand without jerk would miss at T,

    (alpha, beta, gamma) = M (dp, dv, da),
    M = [[720, -360 T, 60 T^2], [-360 T, 168 T^2, -24 T^3], [60 T^2, -24 T^3, 3 T^4]] / T^5.
"""

from __future__ import annotations

import numpy as np

from foc_ros.core.types import Array

from .observations import Observation


def straight_cost(seen: Observation) -> Array:
    """Return the cost [m^2/s^5] of the movement to each goal, (g,): the integral of squared jerk, and what its time costs."""
    (alpha, beta, gamma), T = _jerk(seen)
    effort = (
        gamma**2 * T + beta * gamma * T**2 + (beta**2 + alpha * gamma) * T**3 / 3 + alpha * beta * T**4 / 4 + alpha**2 * T**5 / 20
    )
    return np.asarray(effort.sum(axis=1) + seen.ways.price * T[:, 0])


def straight_positions(seen: Observation, goal: int, seconds: Array) -> Array:
    """Return where the movement to a goal is (h, 2) [m] some seconds (h,) from now; at the goal once it has ended."""
    (alpha, beta, gamma), T = _jerk(seen)
    t = np.minimum(seconds, T[goal, 0])[:, None]
    x, v, a = _state(seen)
    made = gamma[goal] * t**3 / 6 + beta[goal] * t**4 / 24 + alpha[goal] * t**5 / 120
    return np.asarray(x + v * t + a * t**2 / 2 + made)


def _state(seen: Observation) -> Array:
    """Return position, velocity and acceleration (3, 2); those of a hand at rest are noise, as to the predictor."""
    state = seen.hand.reshape(3, 2).copy()
    if seen.since_s == 0.0:
        state[1:] = 0.0
    return state


def _jerk(seen: Observation) -> tuple[tuple[Array, Array, Array], Array]:
    """Return alpha, beta and gamma, (g, 2) each, and T (g, 1) [s] of the movement to each goal."""
    x, v, a = _state(seen)
    T = np.array([_time_to(seen, goal) for goal in range(len(seen.goals))])[:, None]
    dp, dv, da = seen.goals - x - v * T - a * T**2 / 2, -v - a * T, -a
    alpha = (720 * dp - 360 * T * dv + 60 * T**2 * da) / T**5
    beta = (-360 * T * dp + 168 * T**2 * dv - 24 * T**3 * da) / T**5
    gamma = (60 * T**2 * dp - 24 * T**3 * dv + 3 * T**4 * da) / T**5
    return (alpha, beta, gamma), T


def _time_to(seen: Observation, goal: int) -> float:
    """Return the time that the predictor gave the movement to a goal, or the longest one where it had no way there."""
    times = seen.ways.time_s[seen.ways.goal == goal]
    return float(times[0]) if len(times) else float(seen.ways.time_s.max())
