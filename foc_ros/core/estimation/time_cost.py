"""How long a movement should take where time has a price: least effort plus rho times the duration.

Along a path of length L, from speed v and acceleration a along it to rest at its end, the least integral of squared jerk in a
time T is

    J(T) = e' G(T)^-1 e,  e = (L - v T - a T^2 / 2, -v - a T, -a),

with G the Gramian of the triple integrator; from rest J = 720 L^2 / T^5. So the duration that minimises J + rho T is
(3600 L^2 / rho)^(1/6) from rest: a way round that is longer takes longer, by the cube root. In a movement the minimum over the
time that is left agrees with itself from one moment to the next, without a clock: what is optimal from here is the rest of what
was optimal before.

Where the goal is passed at any velocity, the one in e is free: for e = (x, ., y), G without its row and column gives

    J(T) = 45 x^2 / T^5 - 15 x y / T^3 + 9 y^2 / (4 T),

which is nothing for a hand that keeps its speed.

The path is taken for straight. Bending costs effort, too: C times as much makes the best duration C^(1/6) times as long.
"""

from __future__ import annotations

import math

import numpy as np

from foc_ros.core.types import Array

GRID = 64
"""Durations among which the best is sought, evenly in the logarithm; between them by a parabola."""


def least_cost_time(
    length: float, speed: float, acceleration: float, time_cost: float, low: float, high: float, passing: bool = False
) -> float:
    """Return the duration [s] in [low, high] of least effort plus time_cost [m^2/s^6] times duration.

    length [m] of the path left; speed [m/s] and acceleration [m/s^2] along it now; passing: it need not end at rest.
    """
    times = np.geomspace(low, high, GRID)
    costs = effort_along(length, speed, acceleration, times, passing) + time_cost * times
    best = int(costs.argmin())
    if not 0 < best < GRID - 1:
        return float(times[best])
    before, here, after = costs[best - 1 : best + 2]
    bend = before - 2.0 * here + after
    shift = 0.5 * (before - after) / bend if bend > 0.0 else 0.0
    return float(times[best] * math.exp(shift * math.log(high / low) / (GRID - 1)))


def effort_along(length: float, speed: float, acceleration: float, times: Array, passing: bool = False) -> Array:
    """Return the least integral of squared jerk [m^2/s^5] that ends a path in given times (m,) [s]."""
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
