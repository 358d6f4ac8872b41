# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Duration of the rest of the movement.

The duration of the whole movement is a parameter, or follows Fitts' law from its distance D and the width W of the target in the
Shannon form (MacKenzie 1992, doi:10.1207/s15327051hci0701_3), which is never less than its intercept:

    T = a + b log2(D / W + 1).

Operators and devices differ: with a thumb stick one moves at a third of the speed of the free hand. After a part of the expected
duration, the speed is therefore taken into account: the time to go is at least the remaining distance divided by the present
speed. This never delays a minimum-jerk movement that keeps its expected duration: from 0.3 of the duration on, the remaining
distance at the present speed takes less than the remaining time.

The hand goes to at most one of several goals. The speed gives the factor by which the operator is slow for the goal that fits
best, and all expected durations are multiplied by this factor. (If each goal had its own factor, a hand that slows down at one
goal would get seconds to reach another, and a path with hardly any effort.)
"""

from __future__ import annotations

import math

from foc_ros.core.config import DurationConfig
from foc_ros.core.parameter import clip_values
from foc_ros.core.types import NANOSECONDS, Array, HandState

CONSTANTS = {'fixed': ('fixed_s',), 'fitts': ('fitts_a_s', 'fitts_b_s')}
"""By model, the constants that determine durations, and are proportional to them."""
CHANGE_S = 0.25
"""Time in which the time to go grows, or falls faster than time goes by, by a factor of e at most [s]."""


def compute_movement_time(distance: float, config: DurationConfig) -> float:
    """Return the duration [s] of a whole movement over a distance [m]."""
    if config.model == 'fixed':
        return config.fixed_s
    return config.fitts_a_s + config.fitts_b_s * math.log2(distance / config.target_width + 1.0)


def scale_durations(config: DurationConfig, factor: float) -> DurationConfig:
    """Return the configuration by which all movements take longer by a factor; constants stay within their bounds."""
    return clip_values(config, {name: getattr(config, name) * factor for name in CONSTANTS[config.model]})


def limit_change(expected_s: float, before_s: float, elapsed_s: float) -> float:
    """Return a time to go [s] that differs from the one before by no more than is possible in the time elapsed [s].

    The remaining distance divided by the speed grows without bound where a hand slows down: it was seen to grow from 2.2 s to
    4.8 s within 60 ms, and with it all paths changed.
    """
    if math.isinf(elapsed_s):
        return expected_s
    factor = math.exp(elapsed_s / CHANGE_S)
    return min(max(expected_s, min(before_s / factor, before_s - elapsed_s)), before_s * factor)


def is_passing(config: DurationConfig) -> bool:
    """Return whether the hand passes its goal at any velocity, instead of coming to rest there."""
    return config.arrival == 'passing'


def estimate_times_to_go(hand: HandState, goals: Array, config: DurationConfig) -> list[float]:
    """Return the time to go [s] to each goal (g, 2) [m].

    It is 0.3 s at least, for which a hand corrects near its goal, and 10 s at most: plans beyond that say nothing.
    During a movement it is the expected duration from its onset, less the time since then. After 0.3 of it, all
    expected durations are multiplied by the smallest factor with which, for one of the goals, the present speed suffices for the
    remaining distance. At rest it is the expected duration from here.
    """
    here, places = hand.mean[:2].tolist(), goals.tolist()
    distances = [math.dist(here, goal) for goal in places]
    if hand.onset_ns is None or hand.onset_position is None:
        expected = [compute_movement_time(distance, config) for distance in distances]
    else:
        since_s = (hand.stamp_ns - hand.onset_ns) / NANOSECONDS
        began = hand.onset_position.tolist()
        whole = [max(compute_movement_time(math.dist(began, goal), config), 1e-6) for goal in places]
        speed = max(math.hypot(hand.mean[2], hand.mean[3]), 1e-6)
        factors = [
            (since_s + distance / speed) / duration
            for distance, duration in zip(distances, whole, strict=True)
            if since_s >= 0.3 * duration
        ]
        factor = max(1.0, min(factors, default=1.0))
        expected = [factor * duration - since_s for duration in whole]
    return [min(max(each, 0.3), 10.0) for each in expected]
