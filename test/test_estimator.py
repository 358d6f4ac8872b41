# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The Kalman filter of the hand: equations, consistency, movement onset, and all kinds of stamps."""

import itertools
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

from foc_ros.core.config import Config, DurationConfig, EstimatorConfig, replace_values
from foc_ros.core.hand.duration import estimate_times_to_go
from foc_ros.core.hand.kalman import FilterState, compute_gramian, compute_transition, update
from foc_ros.core.obstacle_table import make_obstacles
from foc_ros.core.ocp.problem import rest_to_goal
from foc_ros.core.ocp.solve import solve_problem
from foc_ros.core.ocp.start import cold_start
from foc_ros.core.plant.covariance import compute_duration_sensitivity, compute_onset_delay_covariance
from foc_ros.core.plant.models import TripleIntegratorModel, compute_error_map
from foc_ros.core.plant.plants import build_triple_integrator_horizon, condense, discretise_triple_integrator
from foc_ros.core.predict import predict
from foc_ros.core.tracks import NO_TRACKS
from foc_ros.core.types import NANOSECONDS, HandSample, HandState

CONFIG = EstimatorConfig(position_stddev=0.001, jerk_density=5.0, onset_speed=0.05, gap_s=0.5)
START = 100 * NANOSECONDS


def sample(seconds, x=0.0, y=0.0, height=0.0):
    return HandSample(START + round(seconds * 1e9), np.array([x, y]), height, 'world')


def run(times, positions, config=CONFIG):
    states: list[FilterState] = []
    for t, (x, y) in zip(times, positions, strict=True):
        states.append(update(states[-1] if states else None, sample(t, x, y), config).state)
    return states


def test_the_filter_equals_a_plain_one_with_six_states():
    rng = np.random.default_rng(1)
    times = np.cumsum(rng.uniform(0.002, 0.1, 60))
    positions = 0.003 * rng.standard_normal((60, 2))
    observe = np.hstack([np.eye(2), np.zeros((2, 4))])
    first, *others = run(times, positions)
    mean, covariance = first.mean, first.covariance
    for state, dt, position in zip(others, np.diff(np.round(times, 9)), positions[1:], strict=True):
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
def test_the_estimate_stays_finite_and_positive_for_any_configuration(stddev, density, gap, steps, far):
    config = EstimatorConfig(position_stddev=stddev, jerk_density=density, gap_s=gap)
    times = np.cumsum(np.maximum(np.array(steps) * gap, 1e-9))
    for state in run(times, far * np.array([[(-1.0) ** i, i % 3] for i in range(len(times))]), config):
        assert np.all(np.isfinite(state.mean))
        np.testing.assert_array_equal(state.covariance, state.covariance.T)
        scale = np.sqrt(np.diag(state.covariance))
        assert np.all(scale > 0.0)
        assert np.linalg.eigvalsh(state.covariance / np.outer(scale, scale)).min() > -1e-9


def test_a_movement_begins_above_the_onset_speed_and_ends_below_half_of_it():
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
def test_noise_at_rest_begins_no_movement(rate):
    rng = np.random.default_rng(8)
    false = 0
    for _ in range(10):
        times = np.arange(0.0, 1.0, 1.0 / rate)
        states = run(times, 1e-3 * rng.standard_normal((len(times), 2)))
        false += sum(b.onset_ns is not None and a.onset_ns is None for a, b in itertools.pairwise(states))
    assert false <= 1


FITTS = DurationConfig(model='fitts', fitts_a_s=0.2, fitts_b_s=0.25, target_width=0.02)
FIXED = replace(FITTS, model='fixed', fixed_s=1.5)


def hand(x, onset=None, since_s=0.0, speed=100.0):
    mean = np.array([x, 0.0, 0.6 * speed, -0.8 * speed, 0.0, 0.0])
    stamp = 5 * NANOSECONDS
    begun = {} if onset is None else {'onset_ns': stamp - round(since_s * 1e9), 'onset_position': np.array([onset, 0.0])}
    return HandState(stamp, mean, np.eye(6), **begun)


def time_to_go(state, config):
    return estimate_times_to_go(state, np.array([[0.3, 0.0]]), config)[0]


@pytest.mark.parametrize(
    ('state', 'config', 'expected'),
    [
        # during a movement, the duration, here that of four bits, less the time since its onset
        (hand(0.1, onset=0.0, since_s=0.4), FITTS, 1.2 - 0.4),
        (hand(0.1, onset=0.0, since_s=0.4), FIXED, 1.5 - 0.4),
        # the lower and the upper limit
        (hand(0.29, onset=0.0, since_s=5.0), FITTS, 0.3),
        (hand(0.3), replace(FITTS, fitts_a_s=0.0), 0.3),
        (hand(0.0), replace(FIXED, fixed_s=30.0), 10.0),
        (hand(0.1, onset=0.0, since_s=1.0, speed=0.0), FIXED, 10.0),
        # a slow hand needs the time of the distance at its speed, unless it is too early for the speed to count
        (hand(0.1, onset=0.0, since_s=1.0, speed=0.05), FIXED, 0.2 / 0.05),
        (hand(0.1, onset=0.0, since_s=3.0, speed=0.05), FIXED, 0.2 / 0.05),
        (hand(0.01, onset=0.0, since_s=0.29 * 1.5, speed=0.05), FIXED, 0.71 * 1.5),
    ],
)
def test_the_time_to_go(state, config, expected):
    assert time_to_go(state, config) == pytest.approx(expected)


@pytest.mark.parametrize('share', np.linspace(0.0, 0.99, 10))
def test_a_minimum_jerk_movement_of_the_expected_duration_is_not_delayed(share):
    x = 0.3 * (10.0 * share**3 - 15.0 * share**4 + 6.0 * share**5)
    speed = 0.3 / 1.5 * (30.0 * share**2 - 60.0 * share**3 + 30.0 * share**4)
    state = hand(x, onset=0.0, since_s=1.5 * share, speed=speed)
    assert time_to_go(state, FIXED) == pytest.approx(max(1.5 * (1.0 - share), 0.3), abs=1e-8)


@given(st.floats(-1e4, 1e4), st.floats(-1e4, 1e4), st.floats(0.0, 1e4), st.floats(0.0, 1e3), st.sampled_from([FITTS, FIXED]))
def test_the_time_to_go_stays_in_bounds_and_is_continuous_at_onset(x, onset, since_s, speed, config):
    expected = time_to_go(hand(x, onset, since_s, speed), config)
    assert 0.3 <= expected <= 10.0
    assert time_to_go(hand(x, x, 0.0, speed), config) == time_to_go(hand(x, speed=speed), config)
    assert time_to_go(hand(x, onset, since_s, speed / 2.0), config) >= expected


def test_the_goal_that_the_speed_fits_best_gives_the_factor_for_all_goals():
    """A hand that is slow near one goal gets no longer durations to the others."""
    goals = np.array([[0.3, 0.0], [-0.3, 0.0]])
    near = estimate_times_to_go(hand(0.28, onset=0.0, since_s=1.3, speed=0.1), goals, FIXED)
    assert near == pytest.approx([0.3, 0.3])
    late = estimate_times_to_go(hand(0.2, onset=0.0, since_s=3.0, speed=0.05), goals, FIXED)
    assert late == pytest.approx([2.0, 2.0])


MEAN = np.array([0.0, 0.0, 0.2, 0.1, -0.4, 1.0])


@pytest.mark.parametrize(
    ('time_s', 'onset_ns', 'expected'),
    [
        (0.0, 0, MEAN),
        (0.1, 0, [0.0, 0.0, 0.16, 0.2, 0.0, 0.0]),
        (0.5, 0, [0.0, 0.0, 0.0, 0.6, 0.0, 0.0]),
        (0.0, None, np.zeros(6)),
        (0.5, None, np.zeros(6)),
    ],
)
def test_a_movement_goes_on_at_the_speed_that_its_acceleration_leads_to_and_a_hand_at_rest_rests(time_s, onset_ns, expected):
    config = replace_values(Config(), {'estimator.acceleration_time_s': time_s})
    state = HandState(200_000_000, MEAN, 1e-6 * np.eye(6), onset_ns=onset_ns, onset_position=np.zeros(2))
    prediction, _ = predict(config, state, make_obstacles(), np.array([[0.3, 0.1]]), NO_TRACKS)
    np.testing.assert_allclose(prediction.candidates[0].solution.mean[0], expected, atol=1e-12)


def compute_least_effort(length, speed, acceleration):
    """Return the least integral of squared jerk [m^2/s^5] of an axis that passes its goal after 1 s with no acceleration."""
    held = [0, 2]
    missing = (np.array([length, 0.0, 0.0]) - compute_transition(1.0) @ [0.0, speed, acceleration])[held]
    return float(missing @ np.linalg.solve(compute_gramian(1.0)[np.ix_(held, held)], missing))


def test_the_effort_is_the_least_that_leads_to_the_goal_without_acceleration():
    start = np.array([0.0, 0.0, 0.2, -0.1, 0.5, 1.0])
    values = {'duration.arrival': 'passing', 'duration.model': 'fixed', 'duration.fixed_s': 1.0}
    config = replace_values(Config(), values | {'foc.steps': 150, 'estimator.acceleration_time_s': 0.0})
    state = HandState(0, start, 1e-8 * np.eye(6), onset_ns=0, onset_position=start[:2])
    (found,) = predict(config, state, make_obstacles(), np.array([[0.3, 0.1]]), NO_TRACKS)[0].solved_candidates
    along = [compute_least_effort(way, *start[2 + axis :: 2]) for axis, way in enumerate((0.3, 0.1))]
    assert found.solution.effort * found.solution.dt == pytest.approx(sum(along), rel=3e-3)
    assert_allclose(found.solution.mean[-1, [0, 1, 4, 5]], [0.3, 0.1, 0.0, 0.0], atol=1e-9)


def test_the_covariance_agrees_with_a_hand_that_replans_at_each_step():
    steps, dt, draws = 12, 0.1, 20_000
    plant, noise = discretise_triple_integrator(dt), np.random.default_rng(3)
    root = np.linalg.cholesky(np.kron(compute_gramian(dt), np.eye(2)))
    error = np.zeros((draws, 6))
    expected = TripleIntegratorModel().compute_process_covariance(dt, steps, False)
    for step in range(steps):
        if steps - step < 3:  # too few steps to bring every state to the goal
            break
        error = error @ compute_error_map(condense(plant, steps - step))[1].T
        error = error + noise.standard_normal((draws, 6)) @ root.T
        assert_allclose(error.var(axis=0), np.diag(expected[step + 1]), rtol=0.05)


STEPS = 50
GOAL = np.array([0.3, 0.1])
HAND = HandState(0, np.array([0.05, 0.0, 0.3, -0.1, 1.0, 0.0]), 1e-6 * np.eye(6), onset_ns=0, onset_position=np.zeros(2))


def test_end_points_and_durations_widen_predictions_and_keep_means_and_likelihoods():
    scene = make_obstacles([[0.2, 0.0]], 0.02), np.array([GOAL, [0.4, -0.1]])
    announced = replace_values(Config(), {'likelihood.other_goal': 0.0, 'foc.steps': STEPS})
    exact = replace_values(announced, {'foc.endpoint_stddev': 0.0, 'duration.spread': 0.0})
    sure = predict(exact, HAND, *scene, NO_TRACKS)[0]
    wide = replace_values(announced, {'foc.endpoint_stddev': 0.006, 'duration.spread': 0.3})
    unsure = predict(wide, HAND, *scene, NO_TRACKS)[0]
    assert len(sure.solved_candidates) == len(unsure.solved_candidates) >= 3
    for before, after in zip(sure.candidates, unsure.candidates, strict=True):
        assert_array_equal(before.solution.mean, after.solution.mean)
        assert before.likelihood == after.likelihood
        added = after.solution.covariance - before.solution.covariance
        assert_allclose(added[-1, :2, :2], 0.006**2 * np.eye(2), atol=1e-9)
        assert_allclose(added, added.swapaxes(1, 2), atol=1e-12)
        late = compute_duration_sensitivity(before.solution, False, TripleIntegratorModel())[STEPS // 2, :2]
        across = np.array([-late[1], late[0]]) / np.hypot(*late)
        half_way = TripleIntegratorModel().compute_goal_map(before.solution.dt, STEPS, False)[STEPS // 2, 0, 0]
        assert across @ added[STEPS // 2, :2, :2] @ across == pytest.approx((0.006 * half_way) ** 2)
        assert np.trace(added[STEPS // 2, :2, :2]) == pytest.approx(2 * (0.006 * half_way) ** 2 + 0.3**2 * late @ late)


def test_the_onset_delay_covariance_agrees_with_samples():
    horizon, wait_s = build_triple_integrator_horizon(0.8 / STEPS, STEPS), 0.15
    problem = rest_to_goal(horizon, np.zeros(6), GOAL, make_obstacles(), np.array([0.05, 0.05]), 0.9)
    plan = solve_problem(problem, cold_start(np.linspace(np.zeros(2), GOAL, STEPS + 1)), Config().foc)
    delays = np.random.default_rng(4).exponential(wait_s, 20_000)
    found = compute_onset_delay_covariance(plan, wait_s)
    for step in (5, 20, 40, STEPS):
        began = np.maximum(plan.times[step] - delays, 0.0)
        away = np.column_stack([np.interp(began, plan.times, state) for state in plan.mean.T]) - plan.mean[step]
        drawn = away.T @ away / len(delays)
        scale = np.sqrt(np.outer(np.diag(drawn), np.diag(drawn)))
        assert np.abs(found[step] - drawn).max() > 0.0
        assert_allclose(found[step], drawn, atol=0.05 * scale.max())
        assert_allclose(found[step, :2, :2], drawn[:2, :2], atol=0.05 * drawn[:2, :2].max())


def test_the_onset_delay_widens_predictions_at_rest_only():
    scene = make_obstacles([], []), GOAL[None]
    delayed = replace_values(Config(), {'duration.wait_s': 0.2})
    for hand, widens in ((HandState(0, np.zeros(6), 1e-6 * np.eye(6)), True), (HAND, False)):
        plain, unsure = (predict(config, hand, *scene, NO_TRACKS)[0].candidates[0] for config in (Config(), delayed))
        assert_array_equal(plain.solution.mean, unsure.solution.mean)
        added = (unsure.solution.covariance - plain.solution.covariance)[STEPS // 2, :2, :2]
        assert (np.trace(added) > 0.05**2) == widens and (widens or not added.any())
