# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The third axis: the height over the task plane, its variance, and the obstacles that it clears."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

import foc_ros
from foc_ros.core.config import Config, replace_values
from foc_ros.core.height import predict_height, reach_along_axis
from foc_ros.core.obstacle_table import make_obstacles
from foc_ros.core.ocp.solve import solve_problem
from foc_ros.core.ocp.start import cold_start
from foc_ros.core.plant.covariance import SharedCovariances
from foc_ros.core.predict import build_problem, predict
from foc_ros.core.tracks import NO_TRACKS
from foc_ros.core.types import HandState

CONFIG = replace_values(Config(), {'budget_s': 0.0, 'foc.noise_x': 0.1, 'foc.noise_y': 0.1})
STEPS, DT = CONFIG.foc.steps, 0.02
PRECISE = {'foc.endpoint_stddev': 0.0, 'duration.spread': 0.0}
"""Parameters without which the band of heights would be wider than most of these scenes."""
GOAL = np.array([[0.4, 0.0]])
START = np.array([0.1, 0.2, -0.5])


def hand_at(height, *, moving=True):
    """Return a hand at the origin of the plane that knows its state well."""
    onset = {'onset_ns': 0, 'onset_position': np.zeros(2)} if moving else {}
    return HandState(0, np.zeros(6), 1e-8 * np.eye(6), height, height_mean=np.array([height, 0.0, 0.0]), **onset)


def boxes(*heights, x=0.2, velocity=0.0):
    """Return circles beside each other, with their lowest and highest points."""
    centres = [[x, 0.06 * row] for row in range(len(heights))]
    return make_obstacles(centres, 0.02, 0.0, velocity=[velocity, 0.0], heights=heights)


def predict_over(obstacles, height, goal_height, **changes):
    """Return the prediction of a hand at a height that goes to a goal at another one."""
    config = replace_values(CONFIG, PRECISE | {name.replace('__', '.'): value for name, value in changes.items()})
    return predict(config, hand_at(height), obstacles, GOAL, NO_TRACKS, goal_heights=np.array([goal_height]))[0]


@pytest.mark.parametrize(
    'changes',
    [{}, {'foc.goal_weight': 1e7}, {'duration.arrival': 'passing'}, {'foc.plant': 'damped_mass', 'foc.plant_damping': 3.0}],
    ids=str,
)
def test_it_is_the_solution_of_the_plane_without_obstacles(changes):
    config = replace_values(CONFIG, changes)
    hand = replace(hand_at(0.0), mean=np.column_stack((START, np.zeros(3))).ravel())
    problem = build_problem(config, hand, make_obstacles(), np.array([0.4, 0.0]), DT * STEPS)
    expected = solve_problem(problem, cold_start(np.zeros((STEPS + 1, 2))), config.foc)
    found = reach_along_axis(config, START, 0.4, DT)
    assert_allclose(found.mean, expected.mean, atol=1e-6)
    assert_allclose(found.covariance, expected.covariance, atol=1e-9)
    assert found.effort == pytest.approx(expected.effort, rel=1e-6)


def test_the_variance_is_that_of_noisy_movements_that_are_replanned():
    """The initial error, the end point and the duration are drawn, and the movement is planned anew; motor noise is added."""
    generator, samples, spread = np.random.default_rng(4), 1500, 0.05
    config = replace_values(CONFIG, {'duration.spread': spread, 'foc.noise_x': 0.3, 'foc.noise_y': 0.3})
    root = np.diag([0.004, 0.03, 0.2])
    covariance = np.kron(root @ root, np.eye(2))
    hand = replace(hand_at(0.1), height_mean=START, covariance=covariance)
    found = predict_height(config, hand, 0.4, DT, SharedCovariances(hand, config)[DT])
    control = reach_along_axis(config, START, 0.4, DT).control[:, 0]
    A, B = np.array([[1.0, DT, DT**2 / 2], [0.0, 1.0, DT], [0.0, 0.0, 1.0]]), np.array([DT**3 / 6, DT**2 / 2, DT])
    noise = np.zeros((samples, STEPS + 1, 3))
    for step in range(STEPS):
        drawn = 0.3 * control[step] * generator.standard_normal(samples)
        noise[:, step + 1] = noise[:, step] @ A.T + drawn[:, None] * B
    times, heights = DT * np.arange(STEPS + 1), np.empty((samples, STEPS + 1))
    for row in range(samples):
        start = START + root @ generator.standard_normal(3)
        target = 0.4 + config.foc.endpoint_stddev * generator.standard_normal()
        slower = 1.0 + spread * generator.standard_normal()
        plan = reach_along_axis(config, start, target, DT * slower)
        heights[row] = np.interp(times, plan.times, plan.mean[:, 0])
    assert_allclose(found.motor_covariance[5:, 0, 0], noise[:, 5:, 0].var(axis=0), rtol=0.15)
    assert_allclose(found.covariance[5:, 0, 0], (heights + noise[..., 0])[:, 5:].var(axis=0), rtol=0.15)
    assert_allclose(found.mean[:, 0], heights.mean(axis=0), atol=3e-3)


def test_the_plane_does_not_depend_on_it():
    obstacles = make_obstacles([[0.2, 0.01]], 0.03, 0.003)
    on, off = (predict_over(obstacles, 0.1, 0.3, predict_height=each) for each in (True, False))
    assert [each.label for each in on.candidates] == [each.label for each in off.candidates]
    for with_height, without in zip(on.candidates, off.candidates, strict=True):
        assert without.height is None
        assert_allclose(with_height.height.mean[[0, -1], 0], [0.1, 0.3], atol=1e-9)
        assert_array_equal(with_height.mean, without.mean)
        assert_array_equal(with_height.covariance, without.covariance)
        assert with_height.likelihood == without.likelihood


@pytest.mark.parametrize(
    ('hand', 'goal', 'expected'),
    [
        (0.3, 0.3, (True, True, False)),  # over both
        (0.05, 0.05, (False, True, False)),  # at the height of the low one
        (0.15, 0.15, (True, True, False)),  # between them
        (0.05, 0.3, (False, False, False)),  # through the heights of both
    ],
)
def test_obstacles_above_and_below_the_hand_do_not_block(hand, goal, expected):
    prediction = predict_over(boxes((0.0, 0.1), (0.2, 0.25), (-np.inf, np.inf)), hand, goal)
    assert prediction.cleared == expected
    assert prediction.notes.get('cleared_by_height', 0) == sum(expected)
    named = {name for each in prediction.candidates for name, _ in each.candidate.sides}
    assert named.isdisjoint({str(row) for row in range(3) if expected[row]})
    assert len(prediction.obstacles) == 3 and len(prediction.blocking_obstacles) == 3 - sum(expected)


def test_it_blocks_until_the_band_clears_it():
    assert predict_over(boxes((0.0, 0.1)), 0.14, 0.14).cleared == (True,)
    assert predict_over(boxes((0.0, 0.1)), 0.14, 0.14, scene__hand_radius=0.05).cleared == (False,)
    assert predict_over(boxes((0.0, 0.1), x=0.05), 0.14, 0.14, foc__endpoint_stddev=0.03).cleared == (True,)
    assert predict_over(boxes((0.0, 0.1), x=0.38), 0.14, 0.14, foc__endpoint_stddev=0.03).cleared == (False,)
    assert predict_over(boxes((0.0, 0.1)), 0.14, 0.14, predict_height=False).cleared == (False,)


def test_an_obstacle_is_cleared_on_the_way_to_every_goal_or_blocks():
    goals, table = np.array([[0.4, 0.0], [0.4, 0.2]]), boxes((0.0, 0.1), x=0.35)
    config = replace_values(CONFIG, PRECISE)
    for heights, expected in (((0.3, 0.3), True), ((0.3, 0.05), False)):
        prediction = predict(config, hand_at(0.3), table, goals, NO_TRACKS, goal_heights=np.array(heights))[0]
        assert prediction.cleared == (expected,)
        assert {each.height.mean[-1, 0].round(9) for each in prediction.candidates} == set(heights)


def test_a_predictor_with_heights_predicts_and_clears():
    predictor = foc_ros.Predictor(CONFIG)
    predictor.set_goals([(0.4, 0.0, 0.25)])
    low, post = foc_ros.Circle((0.2, 0.0), 0.03, heights=(0.0, 0.1), name='low'), foc_ros.Circle((0.2, 0.1), 0.03, name='post')
    predictor.set_obstacles([low, post])
    for tick in range(20):
        t = 0.01 * tick
        prediction = predictor.update(t, (t**2, 0.0, 0.3 - 0.1 * t**2))
    assert prediction.cleared == (True, False)
    assert prediction.blocking_obstacles.ids == ('post',)
    height = prediction.candidates[0].height
    assert height.mean.shape == (STEPS + 1, 3) and height.covariance.shape == (STEPS + 1, 3, 3)
    assert height.mean[0, 1] == pytest.approx(-0.2 * t, rel=0.2)
    for position in ((0.1, 0.0), (0.1, 0.0, float('nan'))):
        with pytest.raises(foc_ros.SceneError, match=r'^position: expected'):
            predictor.update(1.0, position)
