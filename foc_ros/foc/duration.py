"""How long the rest of the movement takes.

The whole movement lasts as long as a parameter says, or as Fitts' law gives from its distance D and the target's width W in the
Shannon form (MacKenzie 1992, doi:10.1207/s15327051hci0701_3), which is never less than its intercept:

    T = a + b log2(D / W + 1).

Operators differ, and so do their tools: by a thumb stick one moves at a third of the speed of the free hand. Once enough of the
expected duration has gone by for the speed to tell, the time to go is no shorter than the way left takes at that speed.
A minimum-jerk movement that keeps to its time is never held up by this: from 0.3 of its duration on, the way left at its
present speed takes less than the time left.
"""

from __future__ import annotations

import math

from .config import DurationConfig
from .records import NANOSECONDS, Array, HandState

PACE_AFTER = 0.3
"""Share of the expected duration after which the present speed counts."""
SLOWEST = 1e-6
"""Speed taken for a hand that stands still [m/s]."""


def movement_time(distance: float, config: DurationConfig) -> float:
    """Return the duration [s] of a whole movement over a distance [m]."""
    if config.model == 'fixed':
        return config.fixed_s
    return config.fitts_a_s + config.fitts_b_s * math.log2(distance / config.target_width + 1.0)


def time_to_go(hand: HandState, goal: Array, config: DurationConfig) -> float:
    """Return the time [s] until the hand reaches a goal (2,) [m], between `min_time_to_go_s` and `max_time_to_go_s`.

    In a movement: the duration from where it began, less the time since then, or the way left at the present speed if that takes
    longer (after `PACE_AFTER` of the duration). At rest: the duration from here.
    """
    distance = math.dist(hand.mean[:2], goal)
    if hand.onset_ns is None or hand.onset_position is None:
        expected = movement_time(distance, config)
    else:
        since_s = (hand.stamp_ns - hand.onset_ns) / NANOSECONDS
        whole = movement_time(math.dist(hand.onset_position, goal), config)
        expected = whole - since_s
        if since_s >= PACE_AFTER * whole:
            expected = max(expected, distance / max(math.hypot(hand.mean[2], hand.mean[3]), SLOWEST))
    return min(max(expected, config.min_time_to_go_s), config.max_time_to_go_s)
