# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""A goal that nobody announced: its share grows as the hand moves to none of the goals, and is published."""

from __future__ import annotations

import numpy as np
import pytest

from foc_ros.core.config import Config
from foc_ros.core.errors import ParameterError
from foc_ros.core.goals import compare_goals, find_common_time, find_other_share
from foc_ros.core.guidance.guide import weigh_candidates
from foc_ros.core.hand.straight import compute_straight_effort
from foc_ros.core.obstacle_table import make_obstacles
from foc_ros.core.pipeline import Pipeline
from foc_ros.core.prediction import Prediction
from foc_ros.core.types import NANOSECONDS, Array, HandSample, HandState
from foc_ros.io.bags import TYPESTORE
from foc_ros.io.json_output import encode_prediction
from foc_ros.reporting.received import read_snapshot
from foc_ros.ros.messages.encode_markers import encode_markers
from foc_ros.ros.messages.encode_prediction import encode_likelihoods, encode_prediction_cloud
from foc_ros.ros.messages.types import RosbagsTypes

TYPES = RosbagsTypes(TYPESTORE)
LEFT_GOAL, RIGHT_GOAL, MIDDLE = (0.3, 0.25), (0.3, -0.25), (0.32, 0.0)
PRIOR = Config().likelihood.other_goal


Place = tuple[float, float]


def reach(target: Place, goals: list[Place], share: float = 0.6, **values: object) -> list[Prediction]:
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


def test_before_the_hand_moves_the_share_is_the_parameter() -> None:
    assert reach(MIDDLE, [LEFT_GOAL, RIGHT_GOAL])[0].other == pytest.approx(PRIOR)
    assert all(each.other == 0.0 for each in reach(MIDDLE, [LEFT_GOAL, RIGHT_GOAL], **{'likelihood.other_goal': 0.0}))
    with pytest.raises(ParameterError, match=r'likelihood\.other_goal: expected a number in \[0, 0\.99\]'):
        Config().with_values({'likelihood.other_goal': 1.0})


def test_the_share_grows_if_the_hand_goes_between_the_goals_and_falls_if_it_goes_to_one() -> None:
    missed, met = reach(MIDDLE, [LEFT_GOAL, RIGHT_GOAL]), reach(MIDDLE, [LEFT_GOAL, RIGHT_GOAL, MIDDLE])
    assert missed[-1].other > 2.0 * PRIOR and met[-1].other < PRIOR / 4.0
    assert max(each.other for each in met) < 1.5 * PRIOR


def test_the_share_does_not_depend_on_the_length_unit_but_for_the_spread_of_end_points() -> None:
    state = np.array([0.1, 0.01, 0.5, 0.1, 0.0, 0.0])
    goals, times_s = np.array([LEFT_GOAL, RIGHT_GOAL]), [0.6, 0.7]

    def ask(scale: float) -> float:
        hand = HandState(0, scale * state, np.zeros((6, 6)), onset_ns=0, onset_position=np.zeros(2))
        return find_other_share(hand, scale * goals, times_s, 0.1, scale * 0.03)

    assert ask(3.0) == pytest.approx(ask(1.0), rel=1e-9)


def test_a_hand_at_a_goal_where_it_began_has_a_share_too() -> None:
    hand = HandState(0, np.zeros(6), np.zeros((6, 6)), onset_ns=0, onset_position=np.zeros(2))
    assert 0.0 < find_other_share(hand, np.zeros((1, 2)), [0.3], 0.1, 0.0) < 1.0


def test_guidance_yields_to_another_goal() -> None:
    alone, beside = weigh_candidates(np.array([0.5])), weigh_candidates(np.array([0.5]), 0.0, 0.5)
    assert alone == pytest.approx([1.0]) and beside == pytest.approx([0.5])


def test_the_share_is_published_and_read_back() -> None:
    prediction = reach(MIDDLE, [LEFT_GOAL, RIGHT_GOAL])[-1]
    table, cloud = encode_likelihoods(prediction, TYPES), encode_prediction_cloud(prediction, 'xy', TYPES)
    assert table.layout.dim[0].label.endswith(';other') and np.asarray(table.data).reshape(-1, 4)[:, 0].sum() == pytest.approx(
        1.0
    )
    read = read_snapshot(cloud, table, 'xy', prediction.obstacles, prediction.goal_positions)
    assert read.other == prediction.other == encode_prediction(prediction)['other']
    texts = [each.text for each in encode_markers(prediction, 'xy', TYPES).markers]
    assert any(text.endswith(f'{100 * prediction.other:.0f} % another goal') for text in texts)


def shares_of_goals(prediction: Prediction) -> Array:
    return np.bincount(
        [each.candidate.goal for each in prediction.candidates], [each.likelihood for each in prediction.candidates]
    )


def test_a_fast_hand_that_slows_down_goes_to_the_near_goal() -> None:
    """A farther goal has more time, so that by the efforts alone it would be the likelier one."""
    near, far = (0.2, 0.02), (0.6, 0.06)
    for share in (0.5, 0.6, 0.7):
        to_near, to_far = (shares_of_goals(reach(target, [near, far], share)[-1]) for target in (near, far))
        assert to_near[0] > 0.9 and to_far[1] > to_near[1]


def test_goals_are_compared_by_the_effort_to_be_there_at_a_common_time() -> None:
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


def test_ratios_between_candidates_to_one_goal_stay_as_they_are() -> None:
    obstacles = make_obstacles([[0.15, 0.01]], 0.03)
    hand = HandState(0, np.zeros(6), 1e-6 * np.eye(6))
    pipeline = Pipeline(Config().with_values({'foc.steps': 20}), is_timed=False)
    pipeline.set_obstacles('cloud', obstacles, None, 'world')
    pipeline.set_goals(np.array([[0.3, 0.0], [0.4, 0.1]]), 'world')
    pipeline.add_hand_sample(HandSample(0, np.zeros(2), 0.0, 'world'))
    prediction = pipeline.predict()
    assert prediction is not None
    compared = compare_goals(prediction.candidates, hand, prediction.goal_positions, [0.9, 1.2])
    for goal in (0, 1):
        pairs = [pair for pair in zip(compared, prediction.candidates, strict=True) if pair[1].candidate.goal == goal]
        assert len(pairs) > 1
        factors = [after.cost / before.cost for after, before in pairs]
        assert factors == pytest.approx([factors[0]] * len(factors))


def test_the_effort_of_a_straight_reach_is_that_of_minimum_jerk() -> None:
    effort = compute_straight_effort(np.zeros((3, 2)), np.array([[0.3, 0.4]]), np.array([2.0]))
    assert effort == pytest.approx([720.0 * 0.25 / 32.0])
