# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The time to go: whole durations, time since onset, slow hands, lower and upper limit."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from foc_ros.core.config import DurationConfig
from foc_ros.core.hand.duration import compute_movement_time, estimate_times_to_go
from foc_ros.core.types import NANOSECONDS, HandState

FITTS = DurationConfig(model='fitts', fitts_a_s=0.2, fitts_b_s=0.25, target_width=0.02)
FIXED = replace(FITTS, model='fixed', fixed_s=1.5)
GOAL = np.array([0.3, 0.0])


def hand(x: float, onset: float | None = None, since_s: float = 0.0, speed: float = 100.0) -> HandState:
    mean = np.array([x, 0.0, 0.6 * speed, -0.8 * speed, 0.0, 0.0])
    stamp = 5 * NANOSECONDS
    if onset is None:
        return HandState(stamp, mean, np.eye(6))
    return HandState(stamp, mean, np.eye(6), onset_ns=stamp - round(since_s * 1e9), onset_position=np.array([onset, 0.0]))


def time_to_go(state: HandState, goal: np.ndarray, config: DurationConfig) -> float:
    return estimate_times_to_go(state, goal[None], config)[0]


def test_fitts_law_at_whole_bits() -> None:
    for bits in range(8):
        distance = 0.02 * (2.0**bits - 1.0)
        assert compute_movement_time(distance, FITTS) == pytest.approx(0.2 + 0.25 * bits)


def test_during_a_movement_the_time_to_go_is_the_duration_less_the_time_since_onset() -> None:
    assert time_to_go(hand(0.1, onset=0.0, since_s=0.4), GOAL, FITTS) == pytest.approx(1.2 - 0.4)
    assert time_to_go(hand(0.1, onset=0.0, since_s=0.4), GOAL, FIXED) == pytest.approx(1.5 - 0.4)


def test_lower_and_upper_limit() -> None:
    assert time_to_go(hand(0.29, onset=0.0, since_s=5.0), GOAL, FITTS) == 0.3
    assert time_to_go(hand(0.3), GOAL, replace(FITTS, fitts_a_s=0.0)) == 0.3
    assert time_to_go(hand(0.0), GOAL, replace(FIXED, fixed_s=30.0)) == 10.0
    assert time_to_go(hand(0.1, onset=0.0, since_s=1.0, speed=0.0), GOAL, FIXED) == 10.0


def test_a_slow_hand_needs_the_time_of_the_distance_at_its_speed() -> None:
    assert time_to_go(hand(0.1, onset=0.0, since_s=1.0, speed=0.05), GOAL, FIXED) == pytest.approx(0.2 / 0.05)
    assert time_to_go(hand(0.1, onset=0.0, since_s=3.0, speed=0.05), GOAL, FIXED) == pytest.approx(0.2 / 0.05)
    # too early for the speed to count
    assert time_to_go(hand(0.01, onset=0.0, since_s=0.29 * 1.5, speed=0.05), GOAL, FIXED) == pytest.approx(0.71 * 1.5)


@pytest.mark.parametrize('share', np.linspace(0.0, 0.99, 10))
def test_a_minimum_jerk_movement_of_the_expected_duration_is_not_delayed(share: float) -> None:
    x = 0.3 * (10.0 * share**3 - 15.0 * share**4 + 6.0 * share**5)
    speed = 0.3 / 1.5 * (30.0 * share**2 - 60.0 * share**3 + 30.0 * share**4)
    state = hand(x, onset=0.0, since_s=1.5 * share, speed=speed)
    assert time_to_go(state, GOAL, FIXED) == pytest.approx(max(1.5 * (1.0 - share), 0.3), abs=1e-8)


@given(st.floats(-1e4, 1e4), st.floats(-1e4, 1e4), st.floats(0.0, 1e4), st.floats(0.0, 1e3), st.sampled_from([FITTS, FIXED]))
def test_the_time_to_go_stays_in_bounds_and_is_continuous_at_onset(
    x: float, onset: float, since_s: float, speed: float, config: DurationConfig
) -> None:
    assert 0.3 <= time_to_go(hand(x, onset, since_s, speed), GOAL, config) <= 10.0
    assert time_to_go(hand(x, x, 0.0, speed), GOAL, config) == time_to_go(hand(x, speed=speed), GOAL, config)
    slower = time_to_go(hand(x, onset, since_s, speed / 2.0), GOAL, config)
    assert slower >= time_to_go(hand(x, onset, since_s, speed), GOAL, config)


def test_the_goal_that_the_speed_fits_best_gives_the_factor_for_all_goals() -> None:
    """A hand that is slow near one goal gets no longer durations to the others."""
    goals = np.array([[0.3, 0.0], [-0.3, 0.0]])
    near = estimate_times_to_go(hand(0.28, onset=0.0, since_s=1.3, speed=0.1), goals, FIXED)
    assert near == pytest.approx([0.3, 0.3])
    late = estimate_times_to_go(hand(0.2, onset=0.0, since_s=3.0, speed=0.05), goals, FIXED)
    assert late == pytest.approx([2.0, 2.0])
