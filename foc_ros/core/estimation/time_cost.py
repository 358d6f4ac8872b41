"""Optimal duration of a movement if time has a cost: least effort plus rho times the duration.

Along a path of length L, from speed v and acceleration a along it to rest at its end, the least integral of squared jerk in a
time T is

    J(T) = e' G(T)^-1 e,  e = (L - v T - a T^2 / 2, -v - a T, -a),

with G the Gramian of the triple integrator; from rest J = 720 L^2 / T^5. From rest, the duration that minimises J + rho T is
therefore (3600 L^2 / rho)^(1/6): a longer path takes longer, by the cube root of its length. During a movement, the optimal time
to go is consistent from one moment to the next without a clock, since the optimum from here is the remainder of the previous
optimum.

If the goal is passed at any velocity, the velocity in e is free: for e = (x, ., y), G without its row and column gives

    J(T) = 45 x^2 / T^5 - 15 x y / T^3 + 9 y^2 / (4 T),

which is zero for a hand that keeps its speed.

The path is taken as straight. Bends increase the effort; C times the effort makes the optimal duration C^(1/6) times as long.
"""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np

from foc_ros.core.types import Array, as_readonly

GRID = 64
"""Number of durations that are compared, evenly in the logarithm; the optimum between them is interpolated by a parabola."""


def find_least_cost_time(
    length: float, state: tuple[float, float], time_cost: float, bounds: tuple[float, float], passing: bool = False
) -> float:
    """Return the duration [s] within bounds of least effort plus time_cost [m^2/s^6] times the duration.

    length [m] of the remaining path; state: speed [m/s] and acceleration [m/s^2] along it now; passing: it need not end at rest.
    """
    low, high = bounds
    times = _choose_times(low, high)
    costs = compute_least_effort(length, *state, times, passing) + time_cost * times
    best = int(costs.argmin())
    if not 0 < best < GRID - 1:
        return float(times[best])
    before, here, after = costs[best - 1 : best + 2]
    bend = before - 2.0 * here + after
    shift = 0.5 * (before - after) / bend if bend > 0.0 else 0.0
    return float(times[best] * math.exp(shift * math.log(high / low) / (GRID - 1)))


@lru_cache(maxsize=4)
def _choose_times(low: float, high: float) -> Array:
    return as_readonly(np.geomspace(low, high, GRID))


def compute_least_effort(length: float, speed: float, acceleration: float, times: Array, passing: bool = False) -> Array:
    """Return the least integral of squared jerk [m^2/s^5] that completes a path in each of the times (m,) [s]."""
    x = length - speed * times - acceleration * times**2 / 2.0
    v = -speed - acceleration * times
    a = -acceleration
    if passing:
        return np.asarray(45.0 * x**2 / times**5 - 15.0 * x * a / times**3 + 2.25 * a**2 / times)
    effort: Array = (
        720.0 * x**2 / times**5
        - 720.0 * x * v / times**4
        + (192.0 * v**2 + 120.0 * x * a) / times**3
        - 72.0 * v * a / times**2
        + 9.0 * a**2 / times
    )
    return effort
