# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Decoding of hand poses and goals: every number is checked, and errors name field, value and bound."""

import math
import re

import pytest
from hypothesis import given
from hypothesis import strategies as st
from message_helpers import SECOND, both_kinds, message_types, pose, pose_array, pose_stamped

from foc_ros.core.errors import LostHandError, MessageError, RecordingError
from foc_ros.io.topics import assign_topics
from foc_ros.ros.messages.decode_poses import MAX_GOALS, decode_goal, decode_goals, decode_hand_sample

BAGS = message_types('rosbags')


@both_kinds
def test_a_hand_pose_becomes_a_sample_whatever_its_orientation(types):
    message = pose_stamped(types, (0.1, 0.2, 0.3), 5 * SECOND + 7, 'base')
    message.pose.orientation = types.make('geometry_msgs/msg/Quaternion', x=math.nan, y=7.0, z=0.0, w=0.0)
    sample = decode_hand_sample(message, 'xz')
    assert (sample.stamp_ns, sample.frame_id) == (5 * SECOND + 7, 'base')
    assert (*sample.position, sample.height) == (0.1, 0.3, 0.2)
    assert not sample.position.flags.writeable


@both_kinds
@pytest.mark.parametrize('turn', [(0, 0, 0, 0), (0, 0, 0, 1e-3), (9, 9, 9, 9), (math.nan, 0, 0, 1), (math.inf, 0, 0, 0)])
def test_the_position_0_without_an_orientation_means_no_data(types, turn):
    message = pose_stamped(types, (0.0, 0.0, 0.0))
    for turned in ({'w': 1.0}, *({'y': 0.6 * size, 'w': 0.8 * size} for size in (1.0, -1.0, 0.95))):
        message.pose = pose(types, (0.0, 0.0, 0.0), turned)
        assert decode_hand_sample(message, 'xy').height == 0.0
    message.pose = pose(types, (0.0, 0.0, 0.0), dict(zip('xyzw', turn, strict=True)))
    with pytest.raises(LostHandError, match='the tracker has lost the hand'):
        decode_hand_sample(message, 'xy')


@both_kinds
@pytest.mark.parametrize('axis', [0, 1, 2])
@pytest.mark.parametrize(
    ('value', 'words'),
    [
        (math.nan, r'expected a finite number \[m\], got nan'),
        (math.inf, r'expected a finite number \[m\], got inf'),
        (-math.inf, r'expected a finite number \[m\], got -inf'),
        (1.1e4, r'expected a coordinate within 10000 m of the origin, got 11000'),
    ],
)
def test_a_coordinate_that_is_not_finite_or_too_large_is_refused(types, axis, value, words):
    name, position = f'position.{"xyz"[axis]}', [0.0, 0.0, 0.0]
    position[axis] = value
    for decode in (decode_hand_sample, decode_goal):
        with pytest.raises(MessageError, match=f'pose.{name}: {words}') as caught:
            decode(pose_stamped(types, position), 'xy')
        assert caught.value.field == f'pose.{name}'
    with pytest.raises(MessageError, match=rf'poses\[1\].{name}: {words}'):
        decode_goals(pose_array(types, [(0, 0, 0), position]), 'xy')


@both_kinds
@pytest.mark.parametrize(
    ('sec', 'nanosec', 'words'),
    [
        (0, 0, r'header\.stamp: expected a time after 0, got 0 s'),
        (-1, 5, r'header\.stamp\.sec: expected at least 0, got -1'),
        (1, SECOND, r'header\.stamp\.nanosec: expected below 1000000000, got 1000000000'),
    ],
)
def test_a_wrong_stamp_is_refused(types, sec, nanosec, words):
    message = pose_stamped(types, (0, 0, 0))
    message.header.stamp.sec, message.header.stamp.nanosec = sec, nanosec
    with pytest.raises(MessageError, match=words):
        decode_hand_sample(message, 'xy')


@both_kinds
def test_goals_keep_their_order_and_need_no_stamp(types):
    goals, frame_id, heights = decode_goal(pose_stamped(types, (1.0, 2.0, 3.0), 0, 'base'), 'yz')
    assert (frame_id, goals.tolist(), heights.tolist()) == ('base', [[2.0, 3.0]], [1.0])
    goals, frame_id, heights = decode_goals(pose_array(types, [(1.0, 2.0, 3.0), (4.0, 5.0, 6.0)]), 'xy')
    assert (frame_id, goals.tolist(), heights.tolist()) == ('world', [[1.0, 2.0], [4.0, 5.0]], [3.0, 6.0])
    assert decode_goals(pose_array(types, []), 'xy')[0].shape == (0, 2)


def test_too_many_goals_are_refused():
    assert len(decode_goals(pose_array(BAGS, [(0, 0, 0)] * MAX_GOALS), 'xy')[0]) == MAX_GOALS
    with pytest.raises(MessageError, match=f'poses: expected at most {MAX_GOALS} goals, got {MAX_GOALS + 1}'):
        decode_goals(pose_array(BAGS, [(0, 0, 0)] * (MAX_GOALS + 1)), 'xy')


@given(st.tuples(*[st.floats()] * 3), st.integers(-(2**31), 2**31 - 1), st.integers(0, 2**32 - 1))
def test_any_pose_is_decoded_or_refused(position, sec, nanosec):
    message = pose_stamped(BAGS, position)
    message.header.stamp.sec, message.header.stamp.nanosec = sec, nanosec
    good = all(abs(value) <= 1e4 for value in position) and sec >= 0 and nanosec < SECOND and (sec, nanosec) != (0, 0)
    if good:
        assert decode_hand_sample(message, 'xy').stamp_ns == sec * SECOND + nanosec
    else:
        with pytest.raises(MessageError, match=r'expected .*, got '):
            decode_hand_sample(message, 'xy')


POSE, CLOUD, MARKERS, POSES = (
    'geometry_msgs/msg/PoseStamped',
    'sensor_msgs/msg/PointCloud2',
    'visualization_msgs/msg/MarkerArray',
    'geometry_msgs/msg/PoseArray',
)
PLAIN = {'/hand_pose': POSE, '/obstacles': CLOUD, '/goals': POSES}


@pytest.mark.parametrize(
    ('topics', 'expected'),
    [
        (PLAIN, {'hand_pose': '/hand_pose', 'obstacles': '/obstacles', 'goals': '/goals'}),
        (
            {'/PSM1/measured_cp': POSE, '/PSM1/setpoint_cp': POSE, '/a/obstacle_markers': MARKERS, '/goal_pose': POSE},
            {'hand_pose': '/PSM1/measured_cp', 'obstacle_markers': '/a/obstacle_markers', 'goal_pose': '/goal_pose'},
        ),
        (
            {'/tool': POSE, '/scene': CLOUD, '/targets': POSES, '/camera': 'sensor_msgs/msg/Image'},
            {'hand_pose': '/tool', 'obstacles': '/scene', 'goals': '/targets'},
        ),
        ({**PLAIN, '/left/measured_cp': POSE, '/right/measured_cp': POSE}, {'hand_pose': '/hand_pose'}),
        ({**PLAIN, '/obstacle_markers': MARKERS}, {'obstacles': '/obstacles', 'obstacle_markers': '/obstacle_markers'}),
        ({'/hand_pose': POSE, '/obstacles': MARKERS, '/goals': POSES}, {'obstacle_markers': '/obstacles'}),
        (
            {'/hand_pose': POSE, '/shapes': MARKERS, '/goals': POSES, '/foc/prediction': CLOUD, '/foc/markers': MARKERS},
            {'obstacle_markers': '/shapes'},
        ),
    ],
)
def test_topics_are_found(topics, expected):
    roles = assign_topics(topics)
    assert {role: roles[role] for role in expected} == expected
    assert len(set(roles.values())) == len(roles)


@pytest.mark.parametrize(
    ('topics', 'chosen', 'message'),
    [
        (
            {'/obstacles': CLOUD, '/goals': POSES},
            None,
            'no topic for hand_pose (geometry_msgs/msg/PoseStamped); the recording has /goals',
        ),
        ({'/hand_pose': POSE, '/goals': POSES}, None, 'no topic for obstacles (sensor_msgs/msg/PointCloud2) or obstacle_markers'),
        ({'/hand_pose': POSE, '/obstacles': CLOUD}, None, 'no topic for goals (geometry_msgs/msg/PoseArray) or goal_pose'),
        ({}, None, 'the recording has no topics'),
        (
            {'/r/measured_cp': POSE, '/l/measured_cp': POSE, '/obstacles': CLOUD, '/goals': POSES},
            None,
            'several topics could be hand_pose: /l/measured_cp, /r/measured_cp; choose with --remap hand_pose:=TOPIC',
        ),
        ({'/hand_pose': POSE, '/a': CLOUD, '/b': MARKERS, '/goals': POSES}, None, 'several topics could be obstacles: /a, /b'),
        (PLAIN, {'hand': '/hand_pose'}, "no input is named 'hand': expected one of hand_pose, obstacles"),
        (PLAIN, {'hand_pose': '/other'}, 'topic /other chosen for hand_pose is not in the recording, which has'),
        (PLAIN, {'goals': '/obstacles'}, f'topic /obstacles chosen for goals: expected type {POSES}, got {CLOUD}'),
    ],
)
def test_a_wrong_choice_of_topics_is_refused(topics, chosen, message):
    with pytest.raises(RecordingError, match=re.escape(message)):
        assign_topics(topics, chosen)
