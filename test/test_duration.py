"""The time to go: whole durations, time since onset, and the two floors."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from foc_ros.foc.config import DurationConfig
from foc_ros.foc.duration import movement_time, time_to_go
from foc_ros.foc.records import NANOSECONDS, HandState

FITTS = DurationConfig(model='fitts', fitts_a_s=0.2, fitts_b_s=0.25, target_width=0.02, min_time_to_go_s=0.3, max_mean_speed=0.5)
FIXED = replace(FITTS, model='fixed', fixed_s=1.5)
GOAL = np.array([0.3, 0.0])


def hand(x: float, onset: float | None = None, since_s: float = 0.0) -> HandState:
    mean = np.array([x, 0.0, 0.0, 0.0, 0.0, 0.0])
    stamp = 5 * NANOSECONDS
    if onset is None:
        return HandState(stamp, mean, np.eye(6))
    return HandState(stamp, mean, np.eye(6), onset_ns=stamp - round(since_s * 1e9), onset_position=np.array([onset, 0.0]))


def test_fitts_law_at_whole_bits() -> None:
    for bits in range(8):
        distance = 0.02 * (2.0**bits - 1.0)
        assert movement_time(distance, FITTS) == pytest.approx(0.2 + 0.25 * bits)


def test_at_rest_the_whole_duration_from_here() -> None:
    assert time_to_go(hand(0.0), GOAL, FITTS) == pytest.approx(0.2 + 0.25 * math.log2(16.0))
    assert time_to_go(hand(0.2), GOAL, FIXED) == 1.5


def test_in_a_movement_the_duration_from_its_onset_less_the_time_since() -> None:
    assert time_to_go(hand(0.1, onset=0.0, since_s=0.4), GOAL, FITTS) == pytest.approx(1.2 - 0.4)
    assert time_to_go(hand(0.1, onset=0.0, since_s=0.4), GOAL, FIXED) == pytest.approx(1.5 - 0.4)


def test_never_below_the_floor_nor_faster_than_the_mean_speed() -> None:
    assert time_to_go(hand(0.29, onset=0.0, since_s=5.0), GOAL, FITTS) == 0.3
    assert time_to_go(hand(-0.7, onset=0.0, since_s=5.0), GOAL, FITTS) == pytest.approx(1.0 / 0.5)
    assert time_to_go(hand(0.3), GOAL, replace(FITTS, fitts_a_s=0.0)) == 0.3


@given(st.floats(-1e6, 1e6), st.floats(-1e6, 1e6), st.floats(0.0, 1e4), st.sampled_from([FITTS, FIXED]))
def test_is_continuous_at_onset_and_falls_with_time(x: float, onset: float, since_s: float, config: DurationConfig) -> None:
    assert time_to_go(hand(x, x, 0.0), GOAL, config) == time_to_go(hand(x), GOAL, config)
    now, before = time_to_go(hand(x, onset, since_s), GOAL, config), time_to_go(hand(x, onset, 0.0), GOAL, config)
    assert 0.3 <= now <= before
    assert now >= abs(x - 0.3) / 0.5


def test_the_frame_does_not_matter() -> None:
    turn, shift = np.array([[0.6, -0.8], [0.8, 0.6]]), np.array([3.0, -2.0])
    state = hand(0.1, onset=0.0, since_s=0.4)
    moved = replace(
        state,
        mean=np.concatenate([turn @ state.mean[:2] + shift, np.zeros(4)]),
        onset_position=turn @ state.onset_position + shift,
    )
    assert time_to_go(moved, turn @ GOAL + shift, FITTS) == pytest.approx(time_to_go(state, GOAL, FITTS), rel=1e-12)
