# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The Kalman filter of the hand: equations, consistency, movement onset, and all kinds of stamps."""

import itertools
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from foc_ros.core.config import EstimatorConfig
from foc_ros.core.hand.kalman import (
    JUMP_SPEED,
    JUMP_STDDEVS,
    FilterState,
    compute_gramian,
    compute_transition,
    update,
)
from foc_ros.core.types import NANOSECONDS, Array, HandSample, SampleStatus

CONFIG = EstimatorConfig(position_stddev=0.001, jerk_density=5.0, onset_speed=0.05, gap_s=0.5)
START = 100 * NANOSECONDS


def sample(seconds: float, x: float = 0.0, y: float = 0.0, height: float = 0.0) -> HandSample:
    return HandSample(START + round(seconds * 1e9), np.array([x, y]), height, 'world')


def run(times: Array, positions: Array, config: EstimatorConfig = CONFIG) -> list[FilterState]:
    states: list[FilterState] = []
    for t, (x, y) in zip(times, positions, strict=True):
        states.append(update(states[-1] if states else None, sample(t, x, y), config).state)
    return states


def test_the_filter_equals_a_plain_one_with_six_states() -> None:
    rng = np.random.default_rng(1)
    times = np.cumsum(rng.uniform(0.002, 0.1, 60))
    positions = 0.003 * rng.standard_normal((60, 2))
    observe = np.hstack([np.eye(2), np.zeros((2, 4))])
    first = run(times[:1], positions[:1])[0]
    mean, covariance = first.mean, first.covariance
    for state, dt, position in zip(run(times, positions)[1:], np.diff(np.round(times, 9)), positions[1:], strict=True):
        a, q = np.kron(compute_transition(dt), np.eye(2)), 25.0 * np.kron(compute_gramian(dt), np.eye(2))
        mean, covariance = a @ mean, a @ covariance @ a.T + q
        gain = covariance @ observe.T @ np.linalg.inv(observe @ covariance @ observe.T + 1e-6 * np.eye(2))
        mean, covariance = mean + gain @ (position - observe @ mean), (np.eye(6) - gain @ observe) @ covariance
        np.testing.assert_allclose(state.mean, mean, rtol=1e-7, atol=1e-9)
        np.testing.assert_allclose(state.covariance, covariance, rtol=1e-6, atol=1e-9)


@settings(deadline=None, max_examples=60)
@given(
    stddev=st.floats(1e-7, 1.0),
    density=st.floats(1e-6, 1e6),
    gap=st.floats(0.001, 60.0),
    steps=st.lists(st.floats(0.0, 1.0), min_size=1, max_size=30),
    far=st.floats(0.0, 1e6),
)
def test_the_estimate_stays_finite_and_positive_for_any_configuration(
    stddev: float, density: float, gap: float, steps: list[float], far: float
) -> None:
    config = EstimatorConfig(position_stddev=stddev, jerk_density=density, gap_s=gap)
    times = np.cumsum(np.maximum(np.array(steps) * gap, 1e-9))
    for state in run(times, far * np.array([[(-1.0) ** i, i % 3] for i in range(len(times))]), config):
        assert np.all(np.isfinite(state.mean))
        np.testing.assert_array_equal(state.covariance, state.covariance.T)
        scale = np.sqrt(np.diag(state.covariance))
        assert np.all(scale > 0.0)
        assert np.linalg.eigvalsh(state.covariance / np.outer(scale, scale)).min() > -1e-9


def test_duplicates_and_late_samples_change_nothing() -> None:
    state = run(np.arange(0.0, 1.0, 0.02), np.zeros((50, 2)))[-1]
    for seconds, status in [(0.0, SampleStatus.DUPLICATE), (-1e-9, SampleStatus.LATE), (-0.5, SampleStatus.LATE)]:
        updated = update(state, sample(0.98 + seconds, 9.0, 9.0), CONFIG)
        assert updated.status is status
        assert updated.state is state


def test_backward_jumps_and_gaps_restart_the_filter() -> None:
    state = run(np.arange(0.0, 1.0, 0.02), np.outer(np.arange(0.0, 1.0, 0.02), [0.5, 0.0]))[-1]
    assert state.onset_ns is not None
    for seconds, status in [
        (-0.501, SampleStatus.RESTARTED_BACKWARD),
        (0.501, SampleStatus.RESTARTED_GAP),
        (1e9, SampleStatus.RESTARTED_GAP),
    ]:
        jump = sample(0.98 + seconds, 0.7, 0.1)
        updated, fresh = update(state, jump, CONFIG), update(None, jump, CONFIG).state
        assert updated.status is status
        np.testing.assert_array_equal(updated.state.mean, fresh.mean)
        np.testing.assert_array_equal(updated.state.covariance, fresh.covariance)
        assert updated.state.onset_ns is None
    assert update(state, sample(0.98 + 0.5), CONFIG).status is SampleStatus.ACCEPTED


@pytest.mark.parametrize('dt', [0.0035, 0.02, 0.1])
def test_a_position_that_jumps_decides_nothing_before_the_next_one(dt: float) -> None:
    times = np.arange(0.0, 1.0, dt)
    state = run(times, np.outer(times, [2.0, 0.0]))[-1]
    expected = state.mean[0] + dt * state.mean[2]
    limit = JUMP_STDDEVS * CONFIG.position_stddev + JUMP_SPEED * dt
    assert update(state, sample(times[-1] + dt, expected - 0.99 * limit, 0.0), CONFIG).status is SampleStatus.ACCEPTED
    held = update(state, sample(times[-1] + dt, expected - 1.01 * limit, 0.0), CONFIG)
    assert held.status is SampleStatus.JUMPED and held.status.is_refused
    np.testing.assert_array_equal(held.state.mean, state.mean)
    following = times[-1] + 2 * dt

    movement = sample(following, expected + dt * state.mean[2], 0.0)
    continued = update(held.state, movement, CONFIG)
    assert continued.status is SampleStatus.ACCEPTED and continued.state.jumped is None
    np.testing.assert_array_equal(continued.state.mean, update(state, movement, CONFIG).state.mean)

    jump = sample(following, expected - 1.01 * limit + 2.0 * dt, 0.0)
    restarted = update(held.state, jump, CONFIG)
    assert restarted.status is SampleStatus.RESTARTED_JUMP and restarted.status.is_restart and restarted.state.onset_ns is None
    np.testing.assert_array_equal(restarted.state.mean, update(None, jump, CONFIG).state.mean)

    other = update(held.state, sample(following, expected + 9.0, 0.0), CONFIG)
    assert other.status is SampleStatus.JUMPED
    later = sample(times[-1] + CONFIG.gap_s + dt, expected - 9.0, 0.0)
    assert update(other.state, later, CONFIG).status is SampleStatus.RESTARTED_GAP


def test_a_movement_begins_above_the_onset_speed_and_ends_below_half_of_it() -> None:
    config = replace(CONFIG, position_stddev=1e-5)
    times = np.arange(0.0, 6.0, 0.01)
    speeds = np.interp(times, [0.0, 1.0, 3.0, 5.0, 6.0], [0.0, 0.0, 0.1, 0.0, 0.0])
    states = run(times, np.stack([np.cumsum(speeds) * 0.01, 0.0 * times], axis=1), config)
    moving = np.array([state.onset_ns is not None for state in states])
    begun, ended = times[moving][0], times[moving][-1]
    assert np.count_nonzero(np.diff(moving)) == 2
    assert np.interp(begun, times, speeds) == pytest.approx(0.05, abs=0.002)
    assert np.interp(ended, times, speeds) == pytest.approx(0.025, abs=0.002)
    first = next(state for state in states if state.onset_ns is not None)
    assert first.onset_ns == first.stamp_ns
    np.testing.assert_array_equal(first.onset_position, first.mean[:2])
    assert {state.onset_ns for state in states} == {None, first.onset_ns}


@pytest.mark.parametrize('rate', [15.0, 200.0])
def test_noise_at_rest_begins_no_movement(rate: float) -> None:
    rng = np.random.default_rng(8)
    false = 0
    for _ in range(10):
        times = np.arange(0.0, 1.0, 1.0 / rate)
        states = run(times, 1e-3 * rng.standard_normal((len(times), 2)))
        false += sum(b.onset_ns is not None and a.onset_ns is None for a, b in itertools.pairwise(states))
    assert false <= 1
