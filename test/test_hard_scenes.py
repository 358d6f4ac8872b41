# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Scenes at the edge of what can be predicted: each has a decided answer, finite and never a guess (doc/troubleshoot.md)."""

from dataclasses import replace

import numpy as np
import pytest

import foc_ros
from foc_ros.core.config import Config, replace_values
from foc_ros.core.obstacle_table import make_obstacles
from foc_ros.core.obstacles.shapes import collect_obstacles
from foc_ros.core.predict import predict
from foc_ros.core.tracks import NO_TRACKS
from foc_ros.core.types import HandState

GOAL = np.array([[0.3, 0.0]])
CONFIG = replace_values(Config(), {'foc.steps': 30})


def predicted(obstacles, goals=GOAL, config=CONFIG):
    hand = HandState(1, np.zeros(6), np.diag([1e-6, 1e-6, 1e-4, 1e-4, 1e-2, 1e-2]))
    prediction, memory = predict(config, hand, obstacles, goals, NO_TRACKS)
    for outcome in prediction.candidates:
        solution = outcome.solution
        for array in (solution.mean, solution.covariance, solution.control):
            assert np.isfinite(array).all()
        assert outcome.has_likelihood or outcome.likelihood == 0.0
    shares = [outcome.likelihood for outcome in prediction.candidates_with_likelihood]
    assert sum(shares) + prediction.unknown + prediction.other == pytest.approx(1.0)
    assert (prediction.most_likely is None) == (not shares)
    numbers = {each.way: each.label for each in prediction.candidates}
    assert numbers.get(memory.most_likely) == prediction.most_likely
    return prediction


def test_a_hand_inside_an_obstacle_leaves_it_or_says_why_not():
    prediction = predicted(make_obstacles([[0.01, 0.0]], [0.03], 0.001))
    assert prediction.notes['hand_inside'] == 1
    assert prediction.candidates
    for outcome in prediction.candidates:
        assert 'inside the margin of 0 now' in outcome.solution.message
        assert np.hypot(*(outcome.solution.path[-1] - [0.01, 0.0])) > 0.03
    assert not [outcome for outcome in prediction.solved_candidates if outcome.solution.eta < CONFIG.foc.eta]


def test_of_ten_thousand_obstacles_those_near_the_way_decide():
    near = [[0.1, 0.02], [0.2, -0.02]]
    angles = np.random.default_rng(7).uniform(0.0, 2.0 * np.pi, 9_998)
    far = [0.15, 0.0] + np.stack((np.cos(angles), np.sin(angles)), axis=1) * np.linspace(1.0, 3.0, 9_998)[:, None]
    few, many = predicted(make_obstacles(near, 0.02, 0.001)), predicted(make_obstacles([*near, *far], 0.02, 0.001))
    assert many.notes['culled'] == 10_000 - CONFIG.scene.max_obstacles
    assert 'culled' not in few.notes
    assert [outcome.candidate.label for outcome in many.solved_candidates] == [
        outcome.candidate.label for outcome in few.solved_candidates
    ]
    for one, other in zip(many.solved_candidates, few.solved_candidates, strict=True):
        assert one.likelihood == pytest.approx(other.likelihood, rel=1e-6)
        assert np.abs(one.solution.path - other.solution.path).max() < 1e-6


WIDE = foc_ros.Config().with_values({'scene.hand_radius': 0.01})
CUPS = foc_ros.Circle((0.15, 0.01), radius=0.02, radius_stddev=0.002), foc_ros.Circle((0.2, -0.05), radius=0.015)
ONE_GOAL = np.array([[0.3, 0.0]])


def test_a_prediction_is_that_for_larger_obstacles_and_holds_the_given_ones():
    hand, given = HandState(0, np.zeros(6), np.zeros((6, 6))), collect_obstacles(CUPS)
    wide, _ = predict(WIDE, hand, given, ONE_GOAL, NO_TRACKS)
    grown, _ = predict(foc_ros.Config(), hand, replace(given, radius=given.radius + 0.01), ONE_GOAL, NO_TRACKS)
    narrow, _ = predict(foc_ros.Config(), hand, given, ONE_GOAL, NO_TRACKS)
    assert wide.obstacles is given
    assert [each.label for each in wide.candidates] == [each.label for each in grown.candidates]
    for each, other in zip(wide.candidates, grown.candidates, strict=True):
        np.testing.assert_array_equal(each.mean, other.mean)
    assert wide.candidates[0].effort > narrow.candidates[0].effort


def test_a_solution_keeps_the_hand_away_and_shows_the_given_obstacles():
    wide = foc_ros.solve((0, 0), (0.3, 0), CUPS, config=WIDE)
    grown = foc_ros.solve((0, 0), (0.3, 0), [replace(each, radius=each.radius + 0.01) for each in CUPS])
    np.testing.assert_array_equal(wide.mean, grown.mean)
    assert wide.obstacles.radius.tolist() == [0.02, 0.015]
    assert wide.problem is not None and wide.problem.obstacles.radius.tolist() == [0.03, 0.025]
    plots = pytest.importorskip('matplotlib.figure')
    axes = wide.plot(plots.Figure().subplots())
    assert {0.02, 0.015} <= {patch.radius for patch in axes.patches if hasattr(patch, 'radius')}


def test_the_hand_has_to_fit_at_the_start_and_a_goal_that_it_cannot_reach_beside_an_obstacle_is_that_obstacle():
    beside = (0.175, 0.01)
    with pytest.raises(foc_ros.SceneError, match=r'^start: expected a point outside obstacle 0, of radius 0\.03 m'):
        foc_ros.solve(beside, (0.3, 0), CUPS, config=WIDE)
    solution = foc_ros.solve((0, 0), beside, CUPS, config=WIDE)
    assert solution.status is foc_ros.Status.SOLVED
    np.testing.assert_allclose(solution.mean[-1, :2], beside, atol=1e-6)
