# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""A goal that nobody announced: its share grows as the hand moves to none of the goals, and is published."""

import numpy as np
import pytest

from foc_ros.core.config import Config
from foc_ros.core.errors import ParameterError
from foc_ros.core.goals import find_common_time
from foc_ros.core.guidance.guide import combine, weigh_candidates
from foc_ros.core.obstacle_table import make_obstacles
from foc_ros.core.pipeline import Pipeline
from foc_ros.core.types import NANOSECONDS, HandSample, HandState
from foc_ros.io.bags import TYPESTORE
from foc_ros.io.json_output import encode_prediction
from foc_ros.reporting.views import read_snapshot
from foc_ros.ros.messages.encode_markers import encode_markers
from foc_ros.ros.messages.encode_prediction import encode_likelihoods, encode_prediction_cloud
from foc_ros.ros.messages.types import RosbagsTypes

TYPES = RosbagsTypes(TYPESTORE)
LEFT_GOAL, RIGHT_GOAL, MIDDLE = (0.3, 0.25), (0.3, -0.25), (0.32, 0.0)
PRIOR = Config().likelihood.other_goal


def reach(target, goals, share=0.6, **values):
    """Return the predictions during a part of a minimum-jerk reach of 1 s to a target."""
    pipeline = Pipeline(Config().with_values({'foc.steps': 20, **values}), is_timed=False)
    pipeline.set_obstacles('cloud', make_obstacles(), None, 'world')
    found = []
    for tick in range(round(100 * share)):
        s = max(tick / 100 - 0.05, 0.0)
        place = np.array(target) * (10 * s**3 - 15 * s**4 + 6 * s**5)
        pipeline.add_hand_sample(HandSample(round(tick * NANOSECONDS / 100), place, 0.0, 'world'))
        pipeline.set_goals(np.array(goals), 'world')
        if tick % 5 == 0:
            prediction = pipeline.predict()
            assert prediction is not None
            assert sum(
                each.likelihood for each in prediction.candidates
            ) + prediction.unknown + prediction.other == pytest.approx(1)
            found.append(prediction)
    return found


def test_before_the_hand_moves_the_share_is_the_parameter():
    assert reach(MIDDLE, [LEFT_GOAL, RIGHT_GOAL])[0].other == pytest.approx(PRIOR)
    assert all(each.other == 0.0 for each in reach(MIDDLE, [LEFT_GOAL, RIGHT_GOAL], **{'likelihood.other_goal': 0.0}))
    with pytest.raises(ParameterError, match=r'likelihood\.other_goal: expected a number in \[0, 0\.99\]'):
        Config().with_values({'likelihood.other_goal': 1.0})


def test_the_share_grows_if_the_hand_goes_between_the_goals_and_falls_if_it_goes_to_one():
    missed, met = reach(MIDDLE, [LEFT_GOAL, RIGHT_GOAL]), reach(MIDDLE, [LEFT_GOAL, RIGHT_GOAL, MIDDLE])
    assert missed[-1].other > 2.0 * PRIOR and met[-1].other < PRIOR / 4.0
    assert max(each.other for each in met) < 1.5 * PRIOR


def test_guidance_yields_to_another_goal():
    pull, shares, still = np.array([[0.0, 2.0]]), ((1.0, 0.0), (0.7, 0.3), (0.3, 0.7)), np.zeros(2)
    weights = [weigh_candidates(np.array([known]), pull, still, other=other) for known, other in shares]
    sizes = [combine(each, pull, np.zeros(1, dtype=bool))[0][1] for each in weights]
    assert sizes[0] > 2.0 * sizes[1] > 0.0 and sizes[2] == 0.0


def test_the_share_is_published_and_read_back():
    prediction = reach(MIDDLE, [LEFT_GOAL, RIGHT_GOAL])[-1]
    table, cloud = encode_likelihoods(prediction, TYPES), encode_prediction_cloud(prediction, 'xy', TYPES)
    assert table.layout.dim[0].label.endswith(';other') and np.asarray(table.data).reshape(-1, 4)[:, 0].sum() == pytest.approx(
        1.0
    )
    read = read_snapshot(cloud, table, 'xy', prediction.obstacles, prediction.goal_positions)
    assert read.other == prediction.other == encode_prediction(prediction)['other']
    texts = [each.text for each in encode_markers(prediction, 'xy', TYPES).markers]
    assert any(text.endswith(f'{100 * prediction.other:.0f} % another goal') for text in texts)


def shares_of_goals(prediction):
    return np.bincount(
        [each.candidate.goal for each in prediction.candidates], [each.likelihood for each in prediction.candidates]
    )


def test_a_fast_hand_that_slows_down_goes_to_the_near_goal():
    """A farther goal has more time, so that by the efforts alone it would be the likelier one."""
    near, far = (0.2, 0.02), (0.6, 0.06)
    for share in (0.5, 0.6, 0.7):
        to_near, to_far = (shares_of_goals(reach(target, [near, far], share)[-1]) for target in (near, far))
        assert to_near[0] > 0.9 and to_far[1] > to_near[1]


def test_goals_are_compared_by_the_effort_to_be_there_at_a_common_time():
    hand = HandState(0, np.array([0.0, 0.0, 0.2, 0.0, 0.0, 0.0]), 1e-6 * np.eye(6), onset_ns=0, onset_position=np.zeros(2))
    goals, times_s = np.array([[0.2, 0.0], [0.4, 0.1]]), [0.8, 1.1]
    assert find_common_time(hand, goals, times_s) == pytest.approx(0.8)
    assert find_common_time(hand, goals / 4.0, times_s) == 0.5
    pipeline = Pipeline(Config().with_values({'foc.steps': 20, 'likelihood.other_goal': 0.0}), is_timed=False)
    pipeline.set_obstacles('cloud', make_obstacles(), None, 'world')
    pipeline.set_goals(goals, 'world')
    pipeline.add_hand_sample(HandSample(0, np.zeros(2), 0.0, 'world'))
    prediction = pipeline.predict()
    assert prediction is not None
    # free paths from rest: the efforts at a common time are as the squares of the distances, and beta is 2
    by_goal = shares_of_goals(prediction)
    assert by_goal[0] / by_goal[1] == pytest.approx((0.17 / 0.04) ** 2, rel=0.05)
