# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""How goals are compared: by what it takes to be there in the same time, and by what the movements to them cost.

The effort of a movement falls with the fifth power of its duration, and a farther goal is given more time. By the efforts alone,
a hand that moves fast would seem to go to the farthest goal. With T_i the time to go to goal i and v the speed of the hand, the
goals are therefore compared for the common time

    T = max(0.5 s, min_i min(T_i, 1.875 D_i / v)),

with the distance D_i of the goal: the last term is what a hand half way of a minimum-jerk movement has left, and the first one
what a hand that is at one goal takes to go to another. M_i(T) is the least integral of squared jerk that brings the hand to rest
at goal i at T. People take more time for farther goals: by M_i(T) alone, near goals would seem too likely. Obstacles would not
count in the choice of the goal. With the cost J_i of the best candidate to goal i, in the time T_i, and m = `MOVEMENT`,

    goal i costs M_i(T)^(1 - m) J_i^m.

The costs of all candidates to a goal get the same factor, so that ratios between candidates to one goal stay as they are.

The hand may also go to a goal that nobody announced. Without obstacles, M_i(T) = 720 / T^5 (|g_i - e|^2 + (v T)^2 / 60), with e =
x + v T / 2 the goal that takes least effort. As a density of the goal, M^-2 is a bivariate t distribution about e,

    k(g) = s^2 / (pi (|g - e|^2 + s^2)^2),   s^2 = (v T)^2 / 60 + `foc.endpoint_stddev`^2.

Announced goals are points, of which each is as likely as another; other goals are anywhere within A, the circle about the onset
whose radius is 1.5 times the distance of the farthest goal. The odds of another goal are those of `likelihood.other_goal`
times the factor

    (A mean_i k(g_i))^-c,   c = min(1, 2 distance from the onset / least distance of a goal from there).

The exponent c lets the motion of the hand count in full from half of the way on, and little before.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from .prediction import PredictedCandidate
from .safety_preference import COST_FLOOR
from .types import Array, HandState

MOVEMENT = 0.25
"""Exponent of the cost of the movement itself. From 0.2 to 0.35, people who pick objects are predicted about equally well."""
LEAST_SPREAD_M = 1e-3
"""Least spread of end points, and least distance, with which probabilities of goals are computed [m]."""


def compute_straight_effort(state: Array, goals: Array, times_s: Array) -> Array:
    """Return the least integral of squared jerk (g,) [m^2/s^5] from a state (3, 2) to rest at goals (g, 2) [m] in times (g,) [s].

    Obstacles are disregarded. This quintic has a closed form (Mueller, Hehn and D'Andrea 2015, doi:10.1109/TRO.2015.2479878). Its
    jerk is alpha t^2 / 2 + beta t + gamma. With (dp, dv, da), by which a hand without jerk would miss the goal at T,

        (alpha, beta, gamma) = M (dp, dv, da),
        M = [[720, -360 T, 60 T^2], [-360 T, 168 T^2, -24 T^3], [60 T^2, -24 T^3, 3 T^4]] / T^5.
    """
    (x, v, a), T = state, times_s[:, None]
    dp, dv, da = goals - x - v * T - a * T**2 / 2, -v - a * T, -a
    alpha = (720 * dp - 360 * T * dv + 60 * T**2 * da) / T**5
    beta = (-360 * T * dp + 168 * T**2 * dv - 24 * T**3 * da) / T**5
    gamma = (60 * T**2 * dp - 24 * T**3 * dv + 3 * T**4 * da) / T**5
    effort = (
        gamma**2 * T + beta * gamma * T**2 + (beta**2 + alpha * gamma) * T**3 / 3 + alpha * beta * T**4 / 4 + alpha**2 * T**5 / 20
    )
    return np.asarray(effort.sum(axis=1))


def compare_goals(
    candidates: Sequence[PredictedCandidate], hand: HandState, goals: Array, durations_s: Sequence[float]
) -> list[PredictedCandidate]:
    """Return candidates of a hand that is moved by jerk, with costs that are comparable between goals (g, 2) [m].

    durations_s: times to go [s].
    """
    best: dict[int, float] = {}
    for each in candidates:
        if each.has_likelihood:
            goal = each.candidate.goal
            best[goal] = min(max(each.cost, COST_FLOOR), best.get(goal, np.inf))
    if len(best) < 2:
        return list(candidates)
    common_s = np.full(len(goals), find_common_time(hand, goals, durations_s))
    least = compute_straight_effort(hand.mean.reshape(3, 2), goals, common_s) + COST_FLOOR
    factors = {goal: (float(least[goal]) / cost) ** (1.0 - MOVEMENT) for goal, cost in best.items()}
    return [
        replace(each, cost=factors[each.candidate.goal] * max(each.cost, COST_FLOOR)) if each.candidate.goal in factors else each
        for each in candidates
    ]


def find_common_time(hand: HandState, goals: Array, durations_s: Sequence[float]) -> float:
    """Return the time to go for which goals (g, 2) [m] with times to go [s] are compared [s]."""
    speed, nearest = math.hypot(*hand.mean[2:4]), float(np.hypot(*(goals - hand.mean[:2]).T).min())
    shortest = min(durations_s)
    return max(0.5, min(shortest, 1.875 * nearest / speed) if speed > 0.0 else shortest)


def find_other_share(hand: HandState, goals: Array, durations_s: Sequence[float], prior: float, spread_m: float) -> float:
    """Return the probability that the hand goes to none of the goals (g, 2) [m], with times to go [s].

    prior: `likelihood.other_goal`, which holds at rest; spread_m: standard deviation of end points about their goal [m].
    """
    if hand.onset_position is None or prior == 0.0:
        return prior
    position, velocity = hand.mean[:2], hand.mean[2:4]
    common_s = find_common_time(hand, goals, durations_s)
    square = float(velocity @ velocity) * common_s**2 / 60.0 + max(spread_m, LEAST_SPREAD_M) ** 2
    away = ((goals - position - velocity * (common_s / 2.0)) ** 2).sum(axis=1)
    distances = np.hypot(*(goals - hand.onset_position).T)
    density = float(np.mean(square / (np.pi * (away + square) ** 2)))
    area = np.pi * (1.5 * max(float(distances.max()), LEAST_SPREAD_M)) ** 2
    moved = 2.0 * math.dist(position, hand.onset_position) / max(float(distances.min()), LEAST_SPREAD_M)
    odds: float = prior / (1.0 - prior) * (area * density) ** -min(1.0, moved)
    return odds / (1.0 + odds)
