"""Goals that the hand passes: the velocity there is free, and no effort is spent on stopping."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from foc_ros.core.config import Config, replace_values
from foc_ros.core.hand.kalman import compute_gramian, compute_transition
from foc_ros.core.plant.plants import condense, discretise_triple_integrator
from foc_ros.core.plant.replanning import (
    compute_error_map,
    triple_integrator_error_map,
    triple_integrator_process_covariance,
)
from foc_ros.core.predict import predict
from foc_ros.core.tracks import NO_TRACKS
from foc_ros.core.types import HandState, make_obstacles

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


def hand(*mean: float) -> HandState:
    return HandState(0, np.array(mean), 1e-8 * np.eye(6), onset_ns=0, onset_position=np.array(mean[:2]))


def compute_least_effort(length: float, speed: float, acceleration: float) -> float:
    """Return the least integral of squared jerk [m^2/s^5] of an axis that passes its goal after 1 s with no acceleration."""
    held = [0, 2]
    missing = (np.array([length, 0.0, 0.0]) - compute_transition(1.0) @ [0.0, speed, acceleration])[held]
    return float(missing @ np.linalg.solve(compute_gramian(1.0)[np.ix_(held, held)], missing))


def test_a_hand_that_keeps_its_speed_passes_without_effort() -> None:
    (found,) = predict(PASSING, hand(0.0, 0.0, 0.3, 0.1, 0.0, 0.0), FREE, np.array([[0.3, 0.1]]), NO_TRACKS)[0].solved_candidates
    assert found.solution.effort == pytest.approx(0.0, abs=1e-12)
    assert_allclose(found.solution.mean[-1], [0.3, 0.1, 0.3, 0.1, 0.0, 0.0], atol=1e-9)


def test_the_effort_is_the_least_that_leads_to_the_goal_without_acceleration() -> None:
    start = np.array([0.0, 0.0, 0.2, -0.1, 0.5, 1.0])
    config = replace_values(PASSING, {'foc.steps': 400})
    (found,) = predict(config, hand(*start), FREE, np.array([[0.3, 0.1]]), NO_TRACKS)[0].solved_candidates
    along = [compute_least_effort(way, *start[2 + axis :: 2]) for axis, way in enumerate((0.3, 0.1))]
    assert found.solution.effort * found.solution.dt == pytest.approx(sum(along), rel=1e-3)
    assert_allclose(found.solution.mean[-1, [0, 1, 4, 5]], [0.3, 0.1, 0.0, 0.0], atol=1e-9)


def test_all_errors_but_those_of_the_velocity_are_corrected() -> None:
    dt, steps = 0.05, 20
    error_map = triple_integrator_error_map(dt, steps, True)
    assert_allclose(error_map, compute_error_map(condense(discretise_triple_integrator(dt), steps), True), atol=1e-9)
    assert_allclose(error_map[-1][[0, 1, 4, 5]], 0.0, atol=1e-9)
    kept = error_map[-1][2, 2]
    assert kept == pytest.approx(error_map[-1][3, 3]) and abs(kept) > 0.1
    rest, passed = (triple_integrator_process_covariance(dt, steps, passing) for passing in (False, True))
    assert passed[-1, 2, 2] > 2.0 * rest[-1, 2, 2]


def test_the_velocity_at_a_passed_goal_is_more_uncertain_than_at_rest() -> None:
    scene = FREE, np.array([[0.3, 0.1]]), NO_TRACKS
    now = hand(0.0, 0.0, 0.3, 0.1, 0.0, 0.0)
    passing = predict(PASSING, now, *scene)[0].solved_candidates[0].solution
    resting = predict(replace_values(PASSING, {'duration.arrival': 'rest'}), now, *scene)[0].solved_candidates[0].solution
    assert_allclose(resting.mean[-1, 2:], 0.0, atol=1e-9)
    assert resting.effort > 1.0
    assert passing.covariance[-1, 2, 2] > 2.0 * resting.covariance[-1, 2, 2]


def test_a_goal_behind_an_obstacle_is_passed_with_velocity() -> None:
    scene = make_obstacles([[0.15, 0.04]], 0.05), np.array([[0.3, 0.1]])
    solved = predict(PASSING, hand(0.0, 0.0, 0.3, 0.1, 0.0, 0.0), *scene, NO_TRACKS)[0].solved_candidates
    assert len(solved) == 2
    for each in solved:
        assert_allclose(each.solution.mean[-1, [0, 1, 4, 5]], [0.3, 0.1, 0.0, 0.0], atol=1e-6)
        assert np.hypot(*each.solution.mean[-1, 2:4]) > 0.1
