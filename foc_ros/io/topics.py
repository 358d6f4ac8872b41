"""Which topic of a recording plays which part: by name, by explicit choice, else by type where only one fits."""

from __future__ import annotations

from collections.abc import Mapping

from foc_ros.core.errors import RecordingError

HAND, CLOUD, MARKERS, GOALS, GOAL = 'hand_pose', 'obstacles', 'obstacle_markers', 'goals', 'goal_pose'
TYPES = {
    HAND: 'geometry_msgs/msg/PoseStamped',
    CLOUD: 'sensor_msgs/msg/PointCloud2',
    MARKERS: 'visualization_msgs/msg/MarkerArray',
    GOALS: 'geometry_msgs/msg/PoseArray',
    GOAL: 'geometry_msgs/msg/PoseStamped',
}
"""Message type of every input, by the name of the node's subscription."""

NAMES = {role: (role,) for role in TYPES} | {HAND: ('hand_pose', 'measured_cp')}
"""Last parts of a topic's name that speak for a role, the better first (`measured_cp`: CRTK's measured Cartesian pose)."""

NEEDS = ((HAND,), (CLOUD, MARKERS), (GOALS, GOAL))
"""What a recording must hold to be predicted from: one of each row."""

OUTPUTS = ('prediction', 'likelihoods', 'path', 'markers')
"""Last parts of the node's own outputs, never taken for an input by their type."""


def assign(topics: Mapping[str, str], chosen: Mapping[str, str] | None = None) -> dict[str, str]:
    """Return the topic of every role that the recording has.

    topics: message type by topic name; chosen: topic by role, which overrules names and types. Raises RecordingError where a
    choice cannot be met, where several topics fit alike, or where a recording lacks the hand, obstacles or goals.
    """
    roles = {role: _checked(topics, role, topic) for role, topic in (chosen or {}).items()}
    for role in TYPES:
        if role not in roles:
            found = _by_name(topics, role)
            roles.update({role: found} if found and found not in roles.values() else {})
    for need in NEEDS:
        if not any(role in roles for role in need):
            role, topic = _by_type(topics, need, roles)
            roles[role] = topic
    return roles


def _checked(topics: Mapping[str, str], role: str, topic: str) -> str:
    if role not in TYPES:
        raise RecordingError(f'no input is named {role!r}: expected one of {", ".join(TYPES)}')
    if topic not in topics:
        raise RecordingError(f'topic {topic} chosen for {role} is not in it; it has {_listed(topics)}')
    if topics[topic] != TYPES[role]:
        raise RecordingError(f'topic {topic} chosen for {role}: expected type {TYPES[role]}, got {topics[topic]}')
    return topic


def _by_name(topics: Mapping[str, str], role: str) -> str | None:
    for name in NAMES[role]:
        fitting = [topic for topic, kind in topics.items() if kind == TYPES[role] and topic.rpartition('/')[2] == name]
        if fitting:
            return _only(role, fitting)
    return None


def _by_type(topics: Mapping[str, str], need: tuple[str, ...], roles: Mapping[str, str]) -> tuple[str, str]:
    """Return the role and topic for a need that no name meets. A goal is never guessed: its type is the hand's too."""
    open_topics = [topic for topic in topics if topic not in roles.values() and topic.rpartition('/')[2] not in OUTPUTS]
    fitting = [(role, topic) for role in need if role != GOAL for topic in open_topics if topics[topic] == TYPES[role]]
    if not fitting:
        wanted = ' or '.join(f'{role} ({TYPES[role]})' for role in need)
        raise RecordingError(f'no topic for {wanted}; it has {_listed(topics)}')
    _only(fitting[0][0], [topic for _, topic in fitting])
    return fitting[0]


def _only(role: str, fitting: list[str]) -> str:
    if len(fitting) > 1:
        raise RecordingError(f'several topics could be {role}: {", ".join(sorted(fitting))}; choose with --remap {role}:=TOPIC')
    return fitting[0]


def _listed(topics: Mapping[str, str]) -> str:
    return ', '.join(f'{topic} ({kind})' for topic, kind in sorted(topics.items())) or 'no topics'
