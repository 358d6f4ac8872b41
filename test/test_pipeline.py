# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The pipeline: when a prediction is due, what is rejected and why, and that nothing outdated is used as new."""

import math

import numpy as np
import pytest
from message_helpers import (
    BAGS,
    cloud,
    collision_object,
    detection,
    detections,
    marker,
    marker_array,
    obstacle_table,
    pose_stamped,
)
from reach_helpers import make_predictor

import foc_ros
from foc_ros.core import pipeline as module
from foc_ros.core.config import Config, replace_values
from foc_ros.core.deadline import NEVER, Deadline
from foc_ros.core.errors import SceneError
from foc_ros.core.obstacle_table import make_obstacles
from foc_ros.core.pipeline import Pipeline, SampleStatus
from foc_ros.core.prediction import Prediction
from foc_ros.core.scene import ObstacleSource, Scene
from foc_ros.core.tracks import Tracks
from foc_ros.core.types import NANOSECONDS, HandSample
from foc_ros.ros.health import Freshness
from foc_ros.ros.intake import Intake

START = 1000 * NANOSECONDS
MS = NANOSECONDS // 1000
CONFIG = replace_values(Config(), {'rate_hz': 50.0, 'scene.timeout_s': 2.0, 'foc.steps': 20})


def hand(ms):
    return HandSample(START + round(ms * MS), np.zeros(2), 0.3, 'world')


def ready():
    """Return a pipeline with a scene and a goal, but without a hand sample."""
    pipeline = Pipeline(CONFIG)
    pipeline.set_obstacles('cloud', make_obstacles([[0.15, 0.0]], 0.03), START, 'world')
    pipeline.set_goals(np.array([[0.3, 0.0]]), 'world')
    return pipeline


@pytest.mark.parametrize(('period_ms', 'expected'), [(1.0, 50), (14.0, 48), (19.9, 50), (30.0, 34)])
def test_the_rate_is_reached_whatever_the_period_of_the_samples(monkeypatch, period_ms, expected):
    def predict(config, hand, obstacles, goals, memory, knowledge, deadline, goal_heights):
        assert not knowledge.library.demonstrations and goal_heights is None and deadline is NEVER
        return Prediction(hand.stamp_ns, hand.frame_id, hand.height, (), None), Tracks()

    monkeypatch.setattr(module, 'predict', predict)
    pipeline, stamps = ready(), []
    for ms in np.arange(0.0, 1000.0, period_ms):
        pipeline.add_hand_sample(hand(ms))
        assert pipeline.is_due == (pipeline.until_due_s <= 0.0)
        if pipeline.is_due:
            prediction = pipeline.predict()
            assert prediction is not None
            stamps.append(prediction.stamp_ns)
    assert abs(len(stamps) - expected) <= 1
    assert np.diff(stamps).min() >= 10 * MS


def test_a_scene_that_the_predictor_refuses_is_counted(monkeypatch):
    def refuse(*arguments):
        raise SceneError('goals[0]', 'a goal outside of every obstacle', '(0.15, 0)')

    monkeypatch.setattr(module, 'predict', refuse)
    pipeline = ready()
    pipeline.add_hand_sample(hand(0.0))
    assert pipeline.predict() is None
    assert not pipeline.is_due
    assert pipeline.counts == {'predict_failed': 1}
    assert pipeline.last_refusal == 'goals[0]: expected a goal outside of every obstacle, got (0.15, 0)'


@pytest.fixture
def intake():
    return Intake(Pipeline(replace_values(Config(), {'scene.marker_radius_stddev': 0.004})))


def move(intake, seconds):
    intake.take('hand_pose', pose_stamped(BAGS, (0.0, 0.0, 0.2), round(seconds * NANOSECONDS)))


def show(intake, *markers):
    return intake.take('obstacle_markers', marker_array(BAGS, *markers))


def seen(intake):
    state = intake.pipeline.hand_state
    assert state is not None
    return intake.pipeline.scene.obstacles(state.stamp_ns).ids


def test_markers_from_before_the_working_frame_was_known_are_forgotten_if_they_are_in_another_one(intake):
    show(intake, marker(BAGS, id=1, frame_id='camera', lifetime=0.5), marker(BAGS, id=3, frame_id='camera'))
    for seconds in (1.0, 1.1, 1.6, 1.7, 1.8):
        move(intake, seconds)
    assert seen(intake) == () and intake.counts == {'obstacles_wrong_frame': 1}, 'also where a lifetime ends'
    show(intake, marker(BAGS, id=2, stamp_ns=2 * NANOSECONDS))
    assert seen(intake) == ('a/2',)


def test_other_steps_count_at_once_also_where_there_is_no_time_to_search():
    pipeline = ready()
    pipeline.add_hand_sample(hand(0.0))
    before = pipeline.predict()
    pipeline.reconfigure(replace_values(CONFIG, {'foc.steps': 10}))
    pipeline.add_hand_sample(hand(20.0))
    after = pipeline.predict(Deadline(0.0))
    assert before is not None and after is not None and len(before) == 2
    assert [len(each.mean) for each in after] == [11] * len(after)


def test_what_is_held_expires_by_the_stamp_of_the_hand_and_has_the_deviation_of_the_present_parameters(intake):
    move(intake, 1.0)
    show(intake, marker(BAGS, id=1, lifetime=0.5), marker(BAGS, id=2))
    intake.take('detections', detections(detection((1, 2, 3), (0.4, 0.2, 0.1), 'cup')))
    intake.pipeline.reconfigure(replace_values(intake.pipeline.config, {'scene.marker_radius_stddev': 0.01}))
    for seconds, expected in ((1.1, ('a/1', 'a/2', 'cup')), (1.4, ('a/1', 'a/2', 'cup')), (1.6, ('a/2', 'cup'))):
        move(intake, seconds)
        assert sorted(seen(intake)) == list(expected)
    assert intake.pipeline.scene.obstacles(NANOSECONDS).radius_stddev.tolist() == [0.01] * 2


def test_markers_of_publishers_with_different_delays_are_all_used(intake):
    move(intake, 1.0)
    for name, seconds in (('a', 1.0), ('b', 0.9), ('c', 0.8)):
        assert show(intake, marker(BAGS, ns=name, stamp_ns=round(seconds * NANOSECONDS))) is SampleStatus.ACCEPTED
    assert seen(intake) == ('a/0', 'b/0', 'c/0')
    assert intake.pipeline.scene.obstacles(NANOSECONDS).radius_stddev.tolist() == [0.004] * 3
    assert intake.pipeline.scene.sources['markers'].stamp_ns == NANOSECONDS


def test_a_table_that_never_held_a_marker_is_no_source(intake):
    """One that did, and holds none any more, is an empty scene."""
    move(intake, 1.0)
    nothing = marker(BAGS, action=3, ns='', frame_id='')
    for message in ((), (nothing,)):
        assert show(intake, *message) is SampleStatus.ACCEPTED
        assert intake.pipeline.scene.sources == {}
    show(intake, marker(BAGS))
    assert seen(intake) == ('a/0',)
    assert show(intake, nothing) is SampleStatus.ACCEPTED
    assert seen(intake) == () and 'markers' in intake.pipeline.scene.sources
    assert intake.take('collision_objects', collision_object(operation=1)) is SampleStatus.ACCEPTED
    assert list(intake.pipeline.scene.sources) == ['markers'], 'nor is one of collision objects'


def test_a_source_that_is_removed_is_as_if_it_had_never_been_received(intake):
    move(intake, 1.0)
    show(intake, marker(BAGS, id=1, lifetime=5.0))
    intake.take('obstacles', cloud(BAGS, obstacle_table([(0.1, 0.2, 0.0, 0.03)])))
    intake.remove_source('markers')
    assert seen(intake) == ('0',)
    move(intake, 1.1)
    assert seen(intake) == ('0',), 'the markers do not come back with the next pose'
    show(intake, marker(BAGS, id=2))
    assert seen(intake) == ('0', 'a/2')
    intake.remove_source('cloud')
    assert seen(intake) == ('a/2',)
    for name, expected in (('cup', ('cup/0', 'a/2')), ('lamp', ('a/2', 'lamp/0'))):
        intake.take('collision_objects', collision_object((2, (0.05,), (0.5, 0, 0)), name=name))
        assert sorted(seen(intake)) == sorted(expected), 'the cup does not come back with the lamp'
        intake.remove_source('collision_objects')


A, S, R = SampleStatus.ACCEPTED, SampleStatus.SKIPPED, SampleStatus.RESTARTED_BACKWARD


def pose(ms, x=0.0, frame_id='world'):
    return pose_stamped(BAGS, (x, 0.0, 0.1), 10 * NANOSECONDS + round(ms * MS), frame_id)


@pytest.mark.parametrize(
    ('interval_s', 'stamps_ms', 'expected'),
    [
        pytest.param(0.0035, (0, 1, 2, 3, 4, 5, 6, 7, 8), (A, S, S, S, A, S, S, S, A), id='1 kHz'),
        pytest.param(0.0035, (0, 4, 8.2, 11.7, 16), (A, A, A, A, A), id='250 Hz with jitter'),
        pytest.param(0.003, (0, 0, 1, 1, -1, 3), (A, SampleStatus.DUPLICATE, S, S, SampleStatus.LATE, A), id='out of order'),
        pytest.param(0.003, (0, 1, -500, -501, -500, -497), (A, S, SampleStatus.LATE, R, S, A), id='back by more than gap_s'),
        pytest.param(0.003, (0, 500, 1001, 1002), (A, A, SampleStatus.RESTARTED_GAP, S), id='a gap of more than gap_s'),
        pytest.param(0.0, (0, 1, 1.001), (A, A, A), id='switched off'),
    ],
)
def test_poses_are_skipped_by_their_stamps(interval_s, stamps_ms, expected):
    intake = Intake(Pipeline(replace_values(Config(), {'estimator.min_interval_s': interval_s})))
    assert tuple(intake.take('hand_pose', pose(ms)) for ms in stamps_ms) == expected
    assert intake.counts.get('hand_skipped', 0) == expected.count(S)


def test_only_the_stamp_of_a_skipped_pose_is_looked_at():
    """Bad poses between good ones count as skipped; where no good one is near, they are refused with their reason."""
    intake = Intake(Pipeline(Config()))
    intake.take('hand_pose', pose(0))
    state, sample = intake.pipeline.hand_state, intake.sample
    for skipped in (pose(1, math.nan), pose(2, 0.0, 'camera'), pose(2, x=0.5)):
        assert intake.take('hand_pose', skipped) is S
    assert (intake.pipeline.hand_state, intake.sample, intake.last_refusal, intake.pipeline.refused) == (state, sample, None, 0)
    assert intake.take('hand_pose', pose(3.6, math.nan)) is None
    assert intake.last_refusal == 'hand_pose: pose.position.x: expected a finite number [m], got nan'
    assert intake.take('hand_pose', pose(4, 0.0, 'camera')) is SampleStatus.WRONG_FRAME
    assert intake.take('hand_pose', pose(4.5)) is A, 'a refused pose keeps no good one away'
    wrong = pose(5)
    wrong.header.stamp.nanosec = NANOSECONDS
    assert intake.take('hand_pose', wrong) is None


def test_the_union_of_the_sources_holds_the_latest_row_of_an_id():
    cloud = make_obstacles([[0.0, 0.0], [1.0, 0.0]], 0.1, 0.01, ids=('a', 'b'))
    markers = make_obstacles([[5.0, 0.0], [2.0, 0.0]], 0.2, 0.02, ids=('b', 'c'))
    scene = Scene().with_source('cloud', ObstacleSource(cloud, START, 'w'))
    scene = scene.with_source('markers', ObstacleSource(markers, START, 'w'))
    merged = scene.obstacles(START)
    assert (merged.ids, merged.centre[:, 0].tolist()) == (('a', 'b', 'c'), [0.0, 5.0, 2.0])
    assert (merged.radius.tolist(), merged.radius_stddev.tolist()) == ([0.1, 0.2, 0.2], [0.01, 0.02, 0.02])
    again = scene.with_source('cloud', ObstacleSource(cloud, START, 'w')).obstacles(START)
    assert dict(zip(again.ids, again.centre[:, 0], strict=True)) == {'a': 0.0, 'b': 1.0, 'c': 2.0}


@pytest.mark.parametrize(
    ('ages', 'timeout', 'words'),
    [
        ([3.1], 2.0, 'obstacles are 3.1 s older than the hand pose (scene.timeout_s is 2)'),
        ([-3.1], 2.0, 'obstacles are 3.1 s newer than the hand pose (scene.timeout_s is 2)'),
        ([0.0, 2.5], 2.0, 'obstacles are 2.5 s older than the hand pose (scene.timeout_s is 2)'),
        ([2.0], 2.0, None),
        ([1e6], 0.0, None),
        ([None], 2.0, None),
    ],
)
def test_stale_sources_are_found_by_their_stamps(ages, timeout, words):
    scene = Scene().with_goals(np.zeros((1, 2)), 'w')
    for i, age in enumerate(ages):
        stamp = None if age is None else START - round(age * 1e9)
        scene = scene.with_source(str(i), ObstacleSource(make_obstacles(), stamp, 'w'))
    assert scene.not_ready_reason(START, timeout) == (None if words is None else ('stale', words))


FRESH_CONFIG = replace_values(Config(), {'estimator.hand_timeout_s': 0.5, 'scene.timeout_s': 2.0})
ENDLESS_CONFIG = replace_values(Config(), {'estimator.hand_timeout_s': 0.0, 'scene.timeout_s': 0.0})


@pytest.mark.parametrize(
    'poses',
    [
        [(100.0, 100.1, False, ''), (100.1, 100.7, False, 'the hand pose is 0.6 s older than the time of the node')],
        [(100.0, 100.1, False, ''), (101.3, 100.7, False, 'newer'), (101.4, 101.4, False, '')],
        # a recording with its own stamps, until a movement begins at ROS time
        [(10.0, 1e9, False, ''), (1e9, 1e9, False, ''), (10.0, 1e9, False, '')],
        [(10.0, 1e9, False, ''), (1e9, 1e9, True, ''), (10.0, 1e9, True, 'older')],
        # a clock at zero is not used
        [(10.0, 0.0, False, ''), (10.1, 10.1, False, ''), (10.2, 11.2, False, 'older')],
    ],
)
def test_poses_stamped_by_ros_time_are_judged_by_it(poses):
    pipeline = Pipeline(FRESH_CONFIG)
    freshness = Freshness(pipeline)
    for stamp_s, clock_s, is_restart, words in poses:
        freshness.note_pose(round(stamp_s * NANOSECONDS), round(clock_s * NANOSECONDS), is_restart=is_restart)
        found = freshness.find_not_ready_reason(0.0)
        assert (found is not None) == bool(words) and words in (found or ('', ''))[1]
        pipeline.config = ENDLESS_CONFIG
        assert freshness.find_not_ready_reason(0.0) is None
        pipeline.config = FRESH_CONFIG
    freshness.forget_clock()
    assert freshness.find_not_ready_reason(0.0) is None


def predictor_of_one_goal(*obstacles):
    return make_predictor(replace_values(CONFIG, {'budget_s': 0.0}), (0.3, 0.0), obstacles or None)


@pytest.mark.parametrize('t', [5.0, 0.0, -5.0])
def test_moving_obstacles_move_on_from_the_update_that_first_sees_them(t):
    predictor = predictor_of_one_goal()
    predictor.update(t - 0.1, (0.0, 0.0))
    predictor.set_obstacles([foc_ros.Circle((0.15, 0.1), 0.02, velocity=(0.0, -0.5))])
    np.testing.assert_allclose(predictor.update(t, (0.0, 0.0)).obstacles.centre, [[0.15, 0.1]])
    np.testing.assert_allclose(predictor.update(t + 0.1, (0.0, 0.0)).obstacles.centre, [[0.15, 0.05]])
    predictor.reset()
    for later, y in ((0.0, 0.05), (0.1, 0.0)):  # after a reset, they go on from where they are, at any time
        np.testing.assert_allclose(predictor.update(later, (0.0, 0.0)).obstacles.centre, [[0.15, y]], atol=1e-12)
    predictor.reset()
    predictor.set_obstacles([foc_ros.Circle((0.2, 0.0), 0.02, name='new')])
    assert predictor.update(0.05, (0.0, 0.0)).obstacles.ids == ('new',)


def test_a_class_that_a_moving_obstacle_closes_is_not_estimated_from_its_guess():
    """The search knows where obstacles are now: by then this one has come to the other side of the guess."""
    closing = foc_ros.Circle((0.15, 0.04), 0.03, velocity=(0.0, -0.15), name='a')
    prediction = predictor_of_one_goal(closing, foc_ros.Circle((0.2, -0.06), 0.02, name='b')).update(0.0, (0.0, 0.0))
    assert prediction.most_likely == 'goal0:+a+b'
    assert all(each.label != 'goal0:-a+b' for each in prediction.candidates_with_likelihood)
