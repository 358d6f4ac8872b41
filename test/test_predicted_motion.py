# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Predicted motion and covariance: the start, the arrival, process noise, end points, durations and late onsets."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from foc_ros.core.config import Config, replace_values
from foc_ros.core.hand.kalman import compute_gramian, compute_transition
from foc_ros.core.obstacle_table import make_obstacles
from foc_ros.core.ocp.problem import rest_to_goal
from foc_ros.core.ocp.solve import solve_problem
from foc_ros.core.ocp.start import cold_start
from foc_ros.core.plant.covariance import compute_duration_sensitivity, compute_onset_delay_covariance
from foc_ros.core.plant.plants import build_triple_integrator_horizon, condense, discretise_triple_integrator
from foc_ros.core.plant.replanning import compute_error_map, triple_integrator_goal_map, triple_integrator_process_covariance
from foc_ros.core.predict import predict
from foc_ros.core.solution import Solution
from foc_ros.core.tracks import NO_TRACKS
from foc_ros.core.types import HandState

MEAN = np.array([0.0, 0.0, 0.2, 0.1, -0.4, 1.0])


def first(time_s: float, onset_ns: int | None = 0) -> np.ndarray:
    """The state of the predicted movement at its first step."""
    config = replace_values(Config(), {'estimator.acceleration_time_s': time_s})
    hand = HandState(200_000_000, MEAN, 1e-6 * np.eye(6), onset_ns=onset_ns, onset_position=np.zeros(2))
    prediction, _ = predict(config, hand, make_obstacles(), np.array([[0.3, 0.1]]), NO_TRACKS)
    return prediction.candidates[0].solution.mean[0]


@pytest.mark.parametrize(
    ('time_s', 'expected'),
    [(0.0, MEAN), (0.1, [0.0, 0.0, 0.16, 0.2, 0.0, 0.0]), (0.5, [0.0, 0.0, 0.0, 0.6, 0.0, 0.0])],
)
def test_a_movement_goes_on_at_the_speed_that_its_acceleration_leads_to(time_s: float, expected: list[float]) -> None:
    np.testing.assert_allclose(first(time_s), expected, atol=1e-12)


@pytest.mark.parametrize('time_s', [0.0, 0.5])
def test_a_hand_that_has_not_begun_to_move_is_at_rest(time_s: float) -> None:
    np.testing.assert_allclose(first(time_s, None), np.zeros(6), atol=1e-12)


PASSING = replace_values(
    Config(),
    {
        'duration.arrival': 'passing',
        'duration.model': 'fixed',
        'duration.fixed_s': 1.0,
        'foc.process_noise': 0.5,
        'estimator.acceleration_time_s': 0.0,
    },
)
FREE = make_obstacles()


def moving_hand(*mean: float) -> HandState:
    return HandState(0, np.array(mean), 1e-8 * np.eye(6), onset_ns=0, onset_position=np.array(mean[:2]))


def compute_least_effort(length: float, speed: float, acceleration: float) -> float:
    """Return the least integral of squared jerk [m^2/s^5] of an axis that passes its goal after 1 s with no acceleration."""
    held = [0, 2]
    missing = (np.array([length, 0.0, 0.0]) - compute_transition(1.0) @ [0.0, speed, acceleration])[held]
    return float(missing @ np.linalg.solve(compute_gramian(1.0)[np.ix_(held, held)], missing))


def test_a_hand_that_keeps_its_speed_passes_without_effort() -> None:
    (found,) = predict(PASSING, moving_hand(0.0, 0.0, 0.3, 0.1, 0.0, 0.0), FREE, np.array([[0.3, 0.1]]), NO_TRACKS)[
        0
    ].solved_candidates
    assert found.solution.effort == pytest.approx(0.0, abs=1e-12)
    assert_allclose(found.solution.mean[-1], [0.3, 0.1, 0.3, 0.1, 0.0, 0.0], atol=1e-9)


def test_the_effort_is_the_least_that_leads_to_the_goal_without_acceleration() -> None:
    start = np.array([0.0, 0.0, 0.2, -0.1, 0.5, 1.0])
    config = replace_values(PASSING, {'foc.steps': 400})
    (found,) = predict(config, moving_hand(*start), FREE, np.array([[0.3, 0.1]]), NO_TRACKS)[0].solved_candidates
    along = [compute_least_effort(way, *start[2 + axis :: 2]) for axis, way in enumerate((0.3, 0.1))]
    assert found.solution.effort * found.solution.dt == pytest.approx(sum(along), rel=1e-3)
    assert_allclose(found.solution.mean[-1, [0, 1, 4, 5]], [0.3, 0.1, 0.0, 0.0], atol=1e-9)


def test_a_goal_behind_an_obstacle_is_passed_with_velocity() -> None:
    scene = make_obstacles([[0.15, 0.04]], 0.05), np.array([[0.3, 0.1]])
    solved = predict(PASSING, moving_hand(0.0, 0.0, 0.3, 0.1, 0.0, 0.0), *scene, NO_TRACKS)[0].solved_candidates
    assert len(solved) == 2
    for each in solved:
        assert_allclose(each.solution.mean[-1, [0, 1, 4, 5]], [0.3, 0.1, 0.0, 0.0], atol=1e-6)
        assert np.hypot(*each.solution.mean[-1, 2:4]) > 0.1


def test_the_covariance_agrees_with_a_hand_that_replans_at_each_step() -> None:
    steps, dt, draws = 12, 0.1, 20_000
    plant, noise = discretise_triple_integrator(dt), np.random.default_rng(3)
    root = np.linalg.cholesky(np.kron(compute_gramian(dt), np.eye(2)))
    error = np.zeros((draws, 6))
    expected = triple_integrator_process_covariance(dt, steps)
    for step in range(steps):
        if steps - step < 3:  # too few steps to bring every state to the goal
            break
        error = error @ compute_error_map(condense(plant, steps - step))[1].T
        error = error + noise.standard_normal((draws, 6)) @ root.T
        assert_allclose(error.var(axis=0), np.diag(expected[step + 1]), rtol=0.05)


STEPS = 50
GOAL = np.array([0.3, 0.1])
HAND = HandState(0, np.array([0.05, 0.0, 0.3, -0.1, 1.0, 0.0]), 1e-6 * np.eye(6), onset_ns=0, onset_position=np.zeros(2))


def _plan(duration_s: float, passing: bool, mean: np.ndarray) -> Solution:
    """Plan a movement without obstacles."""
    stacked = build_triple_integrator_horizon(duration_s / STEPS, STEPS)
    problem = rest_to_goal(stacked, mean, GOAL, make_obstacles([], []), np.array([0.05, 0.05]), 0.9, passing=passing)
    return solve_problem(problem, cold_start(np.linspace(mean[:2], GOAL, STEPS + 1)), Config().foc)


@pytest.mark.parametrize('passing', [False, True])
@pytest.mark.parametrize('mean', [np.zeros(6), HAND.mean])
def test_the_duration_sensitivity_is_the_difference_between_plans_of_other_durations(passing: bool, mean: np.ndarray) -> None:
    duration_s, share = 0.8, 0.01
    sooner, later = (_plan(duration_s * (1 + each), passing, mean) for each in (-share, share))
    now = _plan(duration_s, passing, mean)
    expected = np.zeros((STEPS + 1, 2))
    for axis in range(2):
        early, late = (np.interp(now.times, each.times, each.mean[:, axis]) for each in (sooner, later))
        expected[:, axis] = (early - late) / (2.0 * share)
    middle = slice(0, int(0.95 * STEPS))  # the shorter plan ends earlier
    found = compute_duration_sensitivity(now, passing)[:, :2]
    assert np.abs(found).max() > 0.05
    # the free velocity at the goal changes as well, which the map does not contain
    assert_allclose(found[middle], expected[middle], atol=(0.04 if passing else 0.015) * np.abs(found).max())


def test_end_points_and_durations_widen_predictions_and_keep_means_and_likelihoods() -> None:
    scene = make_obstacles([[0.2, 0.0]], 0.02), np.array([GOAL, [0.4, -0.1]])
    announced = replace_values(Config(), {'likelihood.other_goal': 0.0})
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
        late = compute_duration_sensitivity(before.solution, False)[STEPS // 2, :2]
        across = np.array([-late[1], late[0]]) / np.hypot(*late)
        half_way = triple_integrator_goal_map(before.solution.dt, STEPS)[STEPS // 2, 0, 0]
        assert across @ added[STEPS // 2, :2, :2] @ across == pytest.approx((0.006 * half_way) ** 2)
        assert np.trace(added[STEPS // 2, :2, :2]) == pytest.approx(2 * (0.006 * half_way) ** 2 + 0.3**2 * late @ late)


def test_the_onset_delay_covariance_agrees_with_samples() -> None:
    plan, wait_s = _plan(0.8, False, np.zeros(6)), 0.15
    delays = np.random.default_rng(4).exponential(wait_s, 20_000)
    found = compute_onset_delay_covariance(plan, wait_s)
    for step in (5, 20, 40, STEPS):
        began = np.maximum(plan.times[step] - delays, 0.0)
        away = np.stack(
            [np.interp(began, plan.times, plan.mean[:, state]) - plan.mean[step, state] for state in range(6)], axis=1
        )
        drawn = away.T @ away / len(delays)
        scale = np.sqrt(np.outer(np.diag(drawn), np.diag(drawn)))
        assert np.abs(found[step] - drawn).max() > 0.0
        assert_allclose(found[step], drawn, atol=0.05 * scale.max())
        assert_allclose(found[step, :2, :2], drawn[:2, :2], atol=0.05 * drawn[:2, :2].max())


def test_the_onset_delay_widens_predictions_at_rest_only() -> None:
    scene = make_obstacles([], []), GOAL[None]
    delayed = replace_values(Config(), {'duration.wait_s': 0.2})
    for hand, widens in ((HandState(0, np.zeros(6), 1e-6 * np.eye(6)), True), (HAND, False)):
        plain, unsure = (predict(config, hand, *scene, NO_TRACKS)[0].candidates[0] for config in (Config(), delayed))
        assert_array_equal(plain.solution.mean, unsure.solution.mean)
        added = (unsure.solution.covariance - plain.solution.covariance)[STEPS // 2, :2, :2]
        assert (np.trace(added) > 0.05**2) == widens and (widens or not added.any())
