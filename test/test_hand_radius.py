# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The radius of the hand: what is computed has larger obstacles, what is shown has those that were given."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import foc_ros
from foc_ros.core.obstacles.shapes import collect_obstacles
from foc_ros.core.predict import predict
from foc_ros.core.tracks import NO_TRACKS
from foc_ros.core.types import HandState

WIDE = foc_ros.Config().with_values({'scene.hand_radius': 0.01})
CUPS = foc_ros.Circle((0.15, 0.01), radius=0.02, radius_stddev=0.002), foc_ros.Circle((0.2, -0.05), radius=0.015)
GOALS = np.array([[0.3, 0.0]])


def test_a_prediction_is_that_for_larger_obstacles_and_holds_the_given_ones() -> None:
    hand, given = HandState(0, np.zeros(6), np.zeros((6, 6))), collect_obstacles(CUPS)
    wide, _ = predict(WIDE, hand, given, GOALS, NO_TRACKS)
    grown, _ = predict(foc_ros.Config(), hand, replace(given, radius=given.radius + 0.01), GOALS, NO_TRACKS)
    narrow, _ = predict(foc_ros.Config(), hand, given, GOALS, NO_TRACKS)
    assert wide.obstacles is given
    assert [each.label for each in wide.candidates] == [each.label for each in grown.candidates]
    for each, other in zip(wide.candidates, grown.candidates, strict=True):
        np.testing.assert_array_equal(each.mean, other.mean)
    assert wide.candidates[0].effort > narrow.candidates[0].effort


def test_a_solution_keeps_the_hand_away_and_shows_the_given_obstacles() -> None:
    wide = foc_ros.solve((0, 0), (0.3, 0), CUPS, config=WIDE)
    grown = foc_ros.solve((0, 0), (0.3, 0), [replace(each, radius=each.radius + 0.01) for each in CUPS])
    np.testing.assert_array_equal(wide.mean, grown.mean)
    assert wide.obstacles.radius.tolist() == [0.02, 0.015]
    assert wide.problem is not None and wide.problem.obstacles.radius.tolist() == [0.03, 0.025]
    plots = pytest.importorskip('matplotlib.figure')
    axes = wide.plot(plots.Figure().subplots())
    assert {0.02, 0.015} <= {patch.radius for patch in axes.patches if hasattr(patch, 'radius')}


def test_the_hand_has_to_fit_at_the_start_and_a_goal_that_it_cannot_reach_beside_an_obstacle_is_that_obstacle() -> None:
    beside = (0.175, 0.01)
    with pytest.raises(foc_ros.SceneError, match=r'^start: expected a point outside obstacle 0, of radius 0\.03 m'):
        foc_ros.solve(beside, (0.3, 0), CUPS, config=WIDE)
    solution = foc_ros.solve((0, 0), beside, CUPS, config=WIDE)
    assert solution.status is foc_ros.Status.SOLVED
    np.testing.assert_allclose(solution.mean[-1, :2], beside, atol=1e-6)
