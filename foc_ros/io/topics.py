# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The topic of a recording for every input of the predictor: by choice, by name, or by type if only one topic fits."""

from __future__ import annotations

from collections.abc import Mapping

from foc_ros.core.errors import RecordingError

HAND, CLOUD, MARKERS, GOALS, GOAL = 'hand_pose', 'obstacles', 'obstacle_markers', 'goals', 'goal_pose'
COLLISION, DETECTIONS = 'collision_objects', 'detections'
COMMAND = 'command_twist'
"""The operator's velocity command, an input of guidance alone."""
TYPES = {
    HAND: 'geometry_msgs/msg/PoseStamped',
    CLOUD: 'sensor_msgs/msg/PointCloud2',
    MARKERS: 'visualization_msgs/msg/MarkerArray',
    COLLISION: 'moveit_msgs/msg/CollisionObject',
    DETECTIONS: 'vision_msgs/msg/Detection3DArray',
    GOALS: 'geometry_msgs/msg/PoseArray',
    GOAL: 'geometry_msgs/msg/PoseStamped',
}
"""Message type of every input, by the name of the node's subscription, which is called its role."""

OPTIONAL = (COLLISION, DETECTIONS)
"""Inputs whose message packages may be missing: the node then does without them."""

NAMES = {role: (role,) for role in TYPES} | {HAND: ('hand_pose', 'measured_cp')}
"""Last parts of the topic names of a role, the preferred one first (`measured_cp`: CRTK's measured Cartesian pose)."""

REQUIRED = ((HAND,), (CLOUD, MARKERS, COLLISION, DETECTIONS), (GOALS, GOAL))
"""Roles that a recording must contain for a prediction: one of each row."""

TRANSFORMS, STATIC_TRANSFORMS = 'tf', 'tf_static'
"""Last parts of the topics of transforms, which are no input of the predictor but move its inputs into the working frame."""


def assign_topics(topics: Mapping[str, str], chosen: Mapping[str, str] | None = None) -> dict[str, str]:
    """Return the topic of every role that the recording contains; topics: message type by topic; chosen: topic by role."""
    roles = dict(chosen or {})
    for role, topic in roles.items():
        if role not in TYPES:
            raise RecordingError(f'no input is named {role!r}: expected one of {", ".join(TYPES)}')
        if topic not in topics:
            raise RecordingError(f'topic {topic} chosen for {role} is not in the recording, which has {_list_topics(topics)}')
        if topics[topic] != TYPES[role]:
            raise RecordingError(f'topic {topic} chosen for {role}: expected type {TYPES[role]}, got {topics[topic]}')
    for role in (role for role in TYPES if role not in roles):
        for name in NAMES[role]:
            fitting = [topic for topic, kind in topics.items() if kind == TYPES[role] and topic.rpartition('/')[2] == name]
            if fitting:
                _check_is_unique(role, fitting)
                if fitting[0] not in roles.values():
                    roles[role] = fitting[0]
                break
    for alternatives in REQUIRED:
        if not any(role in roles for role in alternatives):
            role, topic = _find_by_type(topics, alternatives, roles)
            roles[role] = topic
    return roles


def find_transforms(topics: Mapping[str, str]) -> dict[str, str]:
    """Return which topics have transforms, by topic: `TRANSFORMS` or `STATIC_TRANSFORMS`. topics: message type by topic."""
    names = {topic: topic.rpartition('/')[2] for topic, kind in topics.items() if kind == 'tf2_msgs/msg/TFMessage'}
    return {topic: name for topic, name in names.items() if name in (TRANSFORMS, STATIC_TRANSFORMS)}


def _find_by_type(topics: Mapping[str, str], alternatives: tuple[str, ...], roles: Mapping[str, str]) -> tuple[str, str]:
    """Return the role and topic of a requirement that no name meets; never a single goal, whose type is the hand's too."""
    outputs = ('prediction', 'likelihoods', 'path', 'markers', 'reference')  # of the node, of the same types as its inputs
    unused = [topic for topic in topics if topic not in roles.values() and topic.rpartition('/')[2] not in outputs]
    fitting = [(role, topic) for role in alternatives if role != GOAL for topic in unused if topics[topic] == TYPES[role]]
    if not fitting:
        wanted = ' or '.join(f'{role} ({TYPES[role]})' for role in alternatives)
        raise RecordingError(f'no topic for {wanted}; the recording has {_list_topics(topics)}')
    _check_is_unique(fitting[0][0], [topic for _, topic in fitting])
    return fitting[0]


def _check_is_unique(role: str, fitting: list[str]) -> None:
    if len(fitting) > 1:
        raise RecordingError(f'several topics could be {role}: {", ".join(sorted(fitting))}; choose with --remap {role}:=TOPIC')


def _list_topics(topics: Mapping[str, str]) -> str:
    return ', '.join(f'{topic} ({kind})' for topic, kind in sorted(topics.items())) or 'no topics'
