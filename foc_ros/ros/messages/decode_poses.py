# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Decoding of hand poses and goals. Numbers are checked here, once."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from typing import Any, NamedTuple

import numpy as np

from foc_ros.core.errors import LostHandError, MessageError
from foc_ros.core.types import NANOSECONDS, Array, HandSample, as_readonly

from .plane import NO_TRANSFORM, Transform, project

MAX_COORDINATE = 1e4
"""Largest coordinate of a hand, a goal or an obstacle [m]; a larger one has a wrong unit."""
MAX_GOALS = 256
FrameLookup = Callable[[Any], tuple[str, Transform]]
"""Function from a std_msgs/Header to the frame in which its message is used, and the transform to there."""


def keep_frame(header: Any) -> tuple[str, Transform]:
    """Return the frame of a header itself: its message is not transformed."""
    return decode_frame(header), NO_TRANSFORM


def decode_hand_sample(message: Any, plane: str, look_up: FrameLookup = keep_frame) -> HandSample:
    """Decode a geometry_msgs/PoseStamped as a hand sample; raises LostHandError or MessageError where its numbers are wrong."""
    check_hand_pose(message.pose)
    stamp_ns = decode_stamp(message.header)
    if stamp_ns == 0:
        raise MessageError('header.stamp', 'a time after 0', '0 s')
    frame_id, transform = look_up(message.header)
    position, height = project(decode_point(message.pose.position, 'pose.position', transform), plane)
    return HandSample(stamp_ns, as_readonly(position), float(height), frame_id)


def check_hand_pose(pose: Any) -> None:
    """Raise LostHandError for a pose that is not finite, or 0 with an orientation that is none: the tracker is blind."""
    place, turn = (pose.position.x, pose.position.y, pose.position.z), pose.orientation
    for axis, value in zip('xyz', place, strict=True):
        if not math.isfinite(value):
            raise LostHandError(f'pose.position.{axis}', 'a finite number [m]', value)
    norm = math.hypot(turn.x, turn.y, turn.z, turn.w)
    if not any(place) and not abs(norm - 1.0) < 0.1:
        found = f'0 and norm {norm:g}: the tracker has lost the hand'
        raise LostHandError('pose', 'a position, or an orientation of norm 1', found)


class DecodedGoals(NamedTuple):
    """Goals (g, 2) in the plane, their frame, and their heights over the plane (g,) [m]."""

    goals: Array
    frame_id: str
    heights: Array


def decode_goals(message: Any, plane: str, look_up: FrameLookup = keep_frame) -> DecodedGoals:
    """Decode a geometry_msgs/PoseArray; an array without poses gives no goals."""
    if len(message.poses) > MAX_GOALS:
        raise MessageError('poses', f'at most {MAX_GOALS} goals', len(message.poses))
    return _decode_goals(message.header, {f'poses[{i}]': pose for i, pose in enumerate(message.poses)}, plane, look_up)


def decode_goal(message: Any, plane: str, look_up: FrameLookup = keep_frame) -> DecodedGoals:
    """Decode a geometry_msgs/PoseStamped as one goal; the stamp serves only to find the transform."""
    return _decode_goals(message.header, {'pose': message.pose}, plane, look_up)


def _decode_goals(header: Any, poses: Mapping[str, Any], plane: str, look_up: FrameLookup) -> DecodedGoals:
    frame_id, transform = look_up(header)
    points = [decode_point(pose.position, f'{name}.position', transform) for name, pose in poses.items()]
    goals, heights = project(np.array(points, dtype=float).reshape(-1, 3), plane)
    return DecodedGoals(goals, frame_id, heights)


def decode_stamp(header: Any, field: str = 'header.stamp') -> int:
    """Decode the stamp of a std_msgs/Header [ns]; field: its name in errors."""
    seconds, nanoseconds = int(header.stamp.sec), int(header.stamp.nanosec)
    if seconds < 0:
        raise MessageError(f'{field}.sec', 'at least 0', seconds)
    if not 0 <= nanoseconds < NANOSECONDS:
        raise MessageError(f'{field}.nanosec', f'below {NANOSECONDS}', nanoseconds)
    return seconds * NANOSECONDS + nanoseconds


def decode_frame(header: Any) -> str:
    """Decode the frame of a std_msgs/Header; a slash before it, as in ROS 1, does not make it another frame."""
    return str(header.frame_id).lstrip('/')


def decode_point(point: Any, field: str, transform: Transform) -> Array:
    """Decode a geometry_msgs/Point, (3,) [m], within its bounds before and after a transform; field: its name in errors."""
    check_coordinates(field, (point.x, point.y, point.z))
    position = transform.apply([point.x, point.y, point.z])
    check_coordinates(field, position.tolist())
    return position


def check_coordinates(field: str, values: Iterable[float], unit: str = ' [m]') -> None:
    """Raise MessageError for the first of x, y, z, w that is not finite or beyond MAX_COORDINATE; an orientation has no unit."""
    for axis, value in zip('xyzw', values, strict=False):
        if not math.isfinite(value):
            raise MessageError(f'{field}.{axis}', f'a finite number{unit}', value)
        if abs(value) > MAX_COORDINATE:
            raise MessageError(f'{field}.{axis}', f'a number from -{MAX_COORDINATE:g} to {MAX_COORDINATE:g}{unit}', f'{value:g}')
