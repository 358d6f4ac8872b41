# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Goals that are obstacles: their own object does not block the way to them, and blocks all others."""

import numpy as np
import pytest

import foc_ros
from foc_ros.core.config import Config
from foc_ros.core.learning.learnt import Knowledge
from foc_ros.core.obstacle_table import make_obstacles
from foc_ros.core.obstacles.clearance import measure_clearance
from foc_ros.core.obstacles.geometry import find_holders
from foc_ros.core.predict import predict
from foc_ros.core.tracks import NO_TRACKS
from foc_ros.core.types import HandState

BOX = np.array([[-0.03, -0.03], [0.03, -0.03], [0.03, 0.03], [-0.03, 0.03]])
PLACES = np.array([[0.2, 0.0], [0.4, 0.01]])
CUPS = make_obstacles(PLACES, 1e-3, ids=('front', 'back'), polygons=[BOX, BOX])
HAND = HandState(0, np.zeros(6), 1e-6 * np.eye(6))


def predict_in(obstacles, goals, **values):
    knowledge = values.pop('knowledge', Knowledge())
    assert isinstance(knowledge, Knowledge)
    return predict(Config().with_values(values), HAND, obstacles, goals, NO_TRACKS, knowledge)[0]


def measure(candidate, obstacle):
    return measure_clearance(candidate.solution.path, obstacle, candidate.solution.dt)


@pytest.mark.parametrize('hand_radius', [0.0, 0.01])
def test_the_object_of_a_goal_blocks_all_goals_but_its_own(hand_radius):
    prediction = predict_in(CUPS, PLACES, **{'scene.hand_radius': hand_radius})
    assert {each.candidate.goal for each in prediction.solved_candidates} == {0, 1}
    for each in prediction.solved_candidates:
        np.testing.assert_allclose(each.solution.path[-1], PLACES[each.candidate.goal], atol=1e-6)
        others = CUPS.take([1 - each.candidate.goal])
        assert measure(each, others) > hand_radius
        assert measure(each, CUPS.take([each.candidate.goal])) < 0.0
    to_back = [each for each in prediction.solved_candidates if each.candidate.goal == 1]
    assert {each.candidate.sides[0][0] for each in to_back} == {'front'}


def test_an_obstacle_is_the_goal_that_the_grown_obstacle_holds():
    beside = np.array([[0.235, 0.0]])
    assert find_holders(beside, CUPS).tolist() == [[False, False]]
    assert find_holders(beside, CUPS.grow(0.01)).tolist() == [[True, False]]
    assert not [each for each in predict_in(CUPS, beside, **{'scene.hand_radius': 0.01}).candidates if each.candidate.sides]


def test_obstacles_decide_on_the_way_and_not_on_the_goal():
    shares = []
    for obstacles in (CUPS, make_obstacles(), make_obstacles([[0.1, 0.0], [0.1, 0.07]], 0.03)):
        found = predict_in(obstacles, PLACES, **{'likelihood.planning_horizon_s': 1000.0})
        total = [sum(each.likelihood for each in found.candidates if each.candidate.goal == goal) for goal in (0, 1)]
        shares.append(total[0] / sum(total))
    assert shares == pytest.approx([shares[0]] * 3, abs=0.02)


def test_the_predictor_takes_the_object_of_a_goal():
    predictor = foc_ros.Predictor(Config().with_values({'budget_s': 0.0}))
    predictor.set_obstacles([foc_ros.Circle((0.2, 0.0), 0.03, name='cup')])
    for given, label in ((None, 'goal0:+cup'), ('cup', 'goal0:')):
        predictor.set_goals([foc_ros.Goal((0.25, 0.001), object=given)])
        assert label in [each.label for each in predictor.update(0.0 if given is None else 10.0, (0.0, 0.0)).candidates]
