"""The minimum-jerk movement from the hand straight to a goal as a forecast: `core.hand.straight`."""

from __future__ import annotations

import numpy as np

from foc_ros.core.hand.straight import compute_straight_effort, compute_straight_jerk
from foc_ros.core.types import Array

from .observations import Observation


def compute_straight_costs(observation: Observation) -> Array:
    """Return the cost [m^2/s^5] of the movement to each goal, (g,): the integral of squared jerk."""
    return compute_straight_effort(_find_state(observation), observation.goals, _find_times(observation))


def compute_straight_positions(observation: Observation, goal: int, seconds: Array) -> Array:
    """Return the positions (h, 2) [m] of the movement to a goal some seconds (h,) from now; at the goal once it has ended."""
    state, times_s = _find_state(observation), _find_times(observation)[[goal]]
    alpha, beta, gamma = (each[0] for each in compute_straight_jerk(state, observation.goals[[goal]], times_s))
    t = np.minimum(seconds, times_s[0])[:, None]
    x, v, a = state
    return np.asarray(x + v * t + a * t**2 / 2 + (gamma * t**3 / 6 + beta * t**4 / 24 + alpha * t**5 / 120))


def _find_state(observation: Observation) -> Array:
    """Return position, velocity and acceleration (3, 2); at rest the last two are noise, and 0 as in the predictor."""
    state = observation.hand.reshape(3, 2).copy()
    if observation.movement_age_s == 0.0:
        state[1:] = 0.0
    return state


def _find_times(observation: Observation) -> Array:
    """Return the time to each goal, (g,) [s]."""
    return np.array([_find_time(observation, goal) for goal in range(len(observation.goals))])


def _find_time(observation: Observation, goal: int) -> float:
    """Return the time that the predictor gave the movement to a goal, or the longest time where no candidate leads there."""
    candidates = observation.candidates
    times = candidates.time_s[candidates.goal == goal]
    return float(times[0]) if len(times) else float(candidates.time_s.max())
