"""The predictive covariance: end points beside the goal, other durations and late onsets widen it and change nothing else."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from foc_ros.core.config import Config, replace_values
from foc_ros.core.ocp.problem import rest_to_goal
from foc_ros.core.ocp.solve import solve_problem
from foc_ros.core.ocp.start import cold_start
from foc_ros.core.plant.covariance import compute_duration_sensitivity, compute_onset_delay_covariance
from foc_ros.core.plant.plants import build_triple_integrator_horizon, condense, discretise_triple_integrator
from foc_ros.core.plant.replanning import compute_goal_map, triple_integrator_goal_map
from foc_ros.core.predict import predict
from foc_ros.core.tracks import NO_TRACKS
from foc_ros.core.types import HandState, Solution, make_obstacles

STEPS = 50
S = np.arange(STEPS + 1) / STEPS
GOAL = np.array([0.3, 0.1])
HAND = HandState(0, np.array([0.05, 0.0, 0.3, -0.1, 1.0, 0.0]), 1e-6 * np.eye(6), onset_ns=0, onset_position=np.zeros(2))


def _plan(duration_s: float, passing: bool, mean: np.ndarray) -> Solution:
    """Plan a movement without obstacles."""
    stacked = build_triple_integrator_horizon(duration_s / STEPS, STEPS)
    problem = rest_to_goal(stacked, mean, GOAL, make_obstacles([], []), np.array([0.05, 0.05]), 0.9, passing=passing)
    return solve_problem(problem, cold_start(np.linspace(mean[:2], GOAL, STEPS + 1)), Config().foc)


def test_a_displaced_goal_adds_a_minimum_jerk_movement() -> None:
    goal_map = triple_integrator_goal_map(0.02, STEPS)
    assert_allclose(goal_map[:, 0, 0], 10 * S**3 - 15 * S**4 + 6 * S**5, atol=2e-3)
    assert_allclose(goal_map[:, 0, 4], S**3 * (1 - S) ** 2 / 2, atol=2e-4)
    assert_allclose(goal_map[-1], np.eye(6), atol=1e-9)
    assert_allclose(goal_map, compute_goal_map(condense(discretise_triple_integrator(0.02), STEPS)), atol=1e-9)
    assert_array_equal(goal_map[0], 0.0)


def test_a_goal_that_is_passed_fixes_no_velocity() -> None:
    goal_map = triple_integrator_goal_map(0.02, STEPS, True)
    assert_array_equal(goal_map[:, :, 2:4], 0.0)
    assert_allclose(goal_map[-1][np.ix_([0, 1, 4, 5], [0, 1, 4, 5])], np.eye(4), atol=1e-9)
    assert goal_map[-1, 2, 0] > 1.0  # a farther goal is passed faster


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
    exact = replace_values(Config(), {'foc.endpoint_stddev': 0.0, 'duration.spread': 0.0})
    sure = predict(exact, HAND, *scene, NO_TRACKS)[0]
    unsure = predict(replace_values(Config(), {'foc.endpoint_stddev': 0.006, 'duration.spread': 0.3}), HAND, *scene, NO_TRACKS)[0]
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
