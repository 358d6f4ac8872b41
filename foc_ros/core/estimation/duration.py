"""How long the rest of the movement takes.

The whole movement lasts as long as a parameter says, or as Fitts' law gives from its distance D and the target's width W in the
Shannon form (MacKenzie 1992, doi:10.1207/s15327051hci0701_3), which is never less than its intercept:

    T = a + b log2(D / W + 1).

Operators differ, and so do their tools: by a thumb stick one moves at a third of the speed of the free hand. Once enough of the
expected duration has gone by for the speed to tell, the time to go is no shorter than the way left takes at that speed.
A minimum-jerk movement that keeps to its time is never held up by this: from 0.3 of its duration on, the way left at its
present speed takes less than the time left.

Model `cost_of_time` gives every way round the duration of least effort plus `time_cost` times duration (`time_cost`), so that
going round takes longer; it needs no clock, and knows slow operators by their speed as it is. What is least is what ways are
compared by: the time that a way takes is part of its cost (`time_price`).

Of several goals at most one is where the hand is going. The speed makes the operator as slow as the goal that it fits best says,
and all expected durations longer by the same factor. (Were each goal's own judged by the speed, a hand that slows down at one
would get seconds to reach another, and with them a path of hardly any effort.)
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from foc_ros.core.config import DurationConfig
from foc_ros.core.types import NANOSECONDS, Array, Candidate, HandState

from .time_cost import least_cost_time

PACE_AFTER = 0.3
"""Share of the expected duration after which the present speed counts."""
SLOWEST = 1e-6
"""Speed taken for a hand that stands still [m/s]."""
SHORTEST_M = 1e-9
SHORTEST_S = 1e-6
"""Duration taken for a movement that Fitts' law gives none."""


def movement_time(distance: float, config: DurationConfig) -> float:
    """Return the duration [s] of a whole movement over a distance [m]."""
    if config.model == 'fixed':
        return config.fixed_s
    return config.fitts_a_s + config.fitts_b_s * math.log2(distance / config.target_width + 1.0)


def is_passing(config: DurationConfig) -> bool:
    """Tell whether the hand passes its goal, at any velocity, instead of coming to rest there."""
    return config.arrival == 'passing'


def candidate_durations(
    hand: HandState, candidates: Sequence[Candidate], goal_times: Sequence[float], config: DurationConfig
) -> list[float]:
    """Return the time [s] of each way round: that of its goal (g,) [s], or with model `cost_of_time` its own."""
    if config.model != 'cost_of_time':
        return [goal_times[candidate.goal] for candidate in candidates]
    return [_least_cost_duration(hand, each.length, _heading(each.guess), config) for each in candidates]


def time_price(config: DurationConfig) -> float:
    """Return what a second costs beside effort [m^2/s^6]: nothing, but with model `cost_of_time`."""
    return config.time_cost if config.model == 'cost_of_time' else 0.0


def _heading(guess: Array) -> Array:
    """Return the direction (2,) in which a path (N + 1, 2) [m] begins."""
    way: Array = guess[len(guess) // 5] - guess[0]
    return way / max(math.hypot(*way), SHORTEST_M)


def _least_cost_duration(hand: HandState, length: float, heading: Array, config: DurationConfig) -> float:
    speed, acceleration = float(hand.mean[2:4] @ heading), float(hand.mean[4:6] @ heading)
    bounds = config.min_time_to_go_s, config.max_time_to_go_s
    return least_cost_time(length, speed, acceleration, config.time_cost, *bounds, is_passing(config))


def estimate_times_to_go(hand: HandState, goals: Array, config: DurationConfig) -> list[float]:
    """Return the time [s] until the hand would reach each goal (g, 2) [m], between `min_time_to_go_s` and `max_time_to_go_s`.

    In a movement: the duration from where it began, less the time since then; after `PACE_AFTER` of it the durations are
    longer by the least factor with which, for one goal, the way left at the present speed is in time. At rest: the duration from
    here.
    """
    here, places = hand.mean[:2].tolist(), goals.tolist()
    distances = [math.dist(here, goal) for goal in places]
    if config.model == 'cost_of_time':
        lines = [np.linspace(hand.mean[:2], goal, 6) for goal in goals]
        return [_least_cost_duration(hand, away, _heading(line), config) for away, line in zip(distances, lines, strict=True)]
    if hand.onset_ns is None or hand.onset_position is None:
        expected = [movement_time(distance, config) for distance in distances]
    else:
        since_s = (hand.stamp_ns - hand.onset_ns) / NANOSECONDS
        began = hand.onset_position.tolist()
        whole = [max(movement_time(math.dist(began, goal), config), SHORTEST_S) for goal in places]
        speed = max(math.hypot(hand.mean[2], hand.mean[3]), SLOWEST)
        told = [
            (since_s + distance / speed) / lasts
            for distance, lasts in zip(distances, whole, strict=True)
            if since_s >= PACE_AFTER * lasts
        ]
        slower = max(1.0, min(told, default=1.0))
        expected = [slower * lasts - since_s for lasts in whole]
    return [min(max(each, config.min_time_to_go_s), config.max_time_to_go_s) for each in expected]
