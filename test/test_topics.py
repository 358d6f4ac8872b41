# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Assignment of topics to inputs, by names and types."""

from __future__ import annotations

import re

import pytest

from foc_ros.core.errors import RecordingError
from foc_ros.io.topics import assign_topics

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
def test_topics_are_found(topics: dict[str, str], expected: dict[str, str]) -> None:
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
def test_a_wrong_choice_of_topics_is_refused(topics: dict[str, str], chosen: dict[str, str] | None, message: str) -> None:
    with pytest.raises(RecordingError, match=re.escape(message)):
        assign_topics(topics, chosen)
