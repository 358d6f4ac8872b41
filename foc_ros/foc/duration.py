"""How long the rest of the movement takes.

The whole movement lasts as long as a parameter says, or as Fitts' law gives from its distance D and the target's width W in the
Shannon form (MacKenzie 1992, doi:10.1207/s15327051hci0701_3), which is never less than its intercept:

    T = a + b log2(D / W + 1).
"""

from __future__ import annotations

import math

from .config import DurationConfig
from .records import NANOSECONDS, Array, HandState


def movement_time(distance: float, config: DurationConfig) -> float:
    """Return the duration [s] of a whole movement over a distance [m]."""
    if config.model == 'fixed':
        return config.fixed_s
    return config.fitts_a_s + config.fitts_b_s * math.log2(distance / config.target_width + 1.0)


def time_to_go(hand: HandState, goal: Array, config: DurationConfig) -> float:
    """Return the time [s] until the hand reaches a goal (2,) [m].

    In a movement: the duration from where it began, less the time since then. At rest: the duration from here. Never below
    `min_time_to_go_s`, nor so short that the straight way would need more than `max_mean_speed`.
    """
    distance = math.dist(hand.mean[:2], goal)
    if hand.onset_ns is None or hand.onset_position is None:
        expected = movement_time(distance, config)
    else:
        since_s = (hand.stamp_ns - hand.onset_ns) / NANOSECONDS
        expected = movement_time(math.dist(hand.onset_position, goal), config) - since_s
    return max(expected, config.min_time_to_go_s, distance / config.max_mean_speed)
