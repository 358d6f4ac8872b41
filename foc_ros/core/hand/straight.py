# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
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


def compute_straight_jerk(state: Array, goals: Array, times_s: Array) -> tuple[Array, Array, Array]:
    """Return alpha, beta and gamma, (g, 2) each, from a state (3, 2) to rest at goals (g, 2) [m] in times (g,) [s]."""
    (x, v, a), T = state, times_s[:, None]
    dp, dv, da = goals - x - v * T - a * T**2 / 2, -v - a * T, -a
    alpha = (720 * dp - 360 * T * dv + 60 * T**2 * da) / T**5
    beta = (-360 * T * dp + 168 * T**2 * dv - 24 * T**3 * da) / T**5
    gamma = (60 * T**2 * dp - 24 * T**3 * dv + 3 * T**4 * da) / T**5
    return alpha, beta, gamma


def compute_straight_effort(state: Array, goals: Array, times_s: Array) -> Array:
    """Return the integral of squared jerk (g,) [m^2/s^5] of these movements; arguments as in `compute_straight_jerk`."""
    (alpha, beta, gamma), T = compute_straight_jerk(state, goals, times_s), times_s[:, None]
    effort = (
        gamma**2 * T + beta * gamma * T**2 + (beta**2 + alpha * gamma) * T**3 / 3 + alpha * beta * T**4 / 4 + alpha**2 * T**5 / 20
    )
    return np.asarray(effort.sum(axis=1))
