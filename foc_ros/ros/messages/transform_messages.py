"""Messages in another frame: their positions, directions and boxes turned and moved into the working frame."""

from __future__ import annotations

from collections.abc import Callable
from copy import copy
from typing import Any, NamedTuple

import numpy as np

from foc_ros.core.errors import MessageError
from foc_ros.core.types import Array
from foc_ros.io.topics import CLOUD, DETECTIONS, GOALS, MARKERS

from .decode_objects import ADD
from .decode_point_cloud import read_table
from .decode_poses import decode_frame
from .plane import compute_rotation, lift, project

MOST_TILT = 1e-3
"""Sine of the largest angle between the task plane and the sizes of boxes after a transform."""


class Transform(NamedTuple):
    """A transform into the working frame.

    rotation: quaternion, translation: vector [m], both with attributes x, y, z (and w); stamp_ns: for which it holds [ns].
    """

    rotation: Any
    translation: Any
    stamp_ns: int


FindTransform = Callable[[Any], Transform]
"""Function from a std_msgs/Header to the transform from its frame."""


def transform_message(role: str, message: Any, frame_id: str, plane: str, find: FindTransform) -> Any:
    """Return a message in a frame; one that is in this frame already is not copied.

    Parameters
    ----------
    role
        Name of the input.
    message
        A message of this input, of rclpy or of rosbags; it is not changed.
    frame_id
        The frame of the result.
    plane
        The plane in which the sizes of the boxes of a cloud are.
    find
        Gives the transform for a header in another frame. Its errors are passed on.

    Raises
    ------
    MessageError
        For boxes that would not lie in the plane any more, or whose yaw has no field.
    """
    if role != MARKERS:
        return _transform(role, message, frame_id, plane, find)
    # markers that delete others have no position and often no frame
    parts = [_transform(role, each, frame_id, plane, find) if each.action == ADD else each for each in message.markers]
    if all(part is each for part, each in zip(parts, message.markers, strict=True)):
        return message
    transformed = copy(message)
    transformed.markers = parts
    return transformed


def _transform(role: str, message: Any, frame_id: str, plane: str, find: FindTransform) -> Any:
    if decode_frame(message.header) == frame_id:
        return message
    found = find(message.header)
    rotation, shift = compute_rotation(found.rotation), _read_xyz(found.translation)
    if role == CLOUD:
        transformed = _transform_cloud(message, rotation, shift, plane)
    else:
        transformed = copy(message)
        if role == DETECTIONS:
            transformed.detections = [_transform_detection(each, rotation, shift, found, frame_id) for each in message.detections]
        elif role == GOALS:
            transformed.poses = [_transform_pose(each, rotation, shift, found) for each in message.poses]
        else:
            transformed.pose = _transform_pose(message.pose, rotation, shift, found)
    transformed.header = _rename_frame(message.header, frame_id)
    return transformed


def _rename_frame(header: Any, frame_id: str) -> Any:
    renamed = copy(header)
    renamed.frame_id = frame_id
    return renamed


def _transform_pose(pose: Any, rotation: Array, shift: Array, found: Transform) -> Any:
    """Return a pose after a transform; only what changes is copied, because a deep copy takes longer than all the rest."""
    transformed = copy(pose)
    point, orientation = transformed.position, transformed.orientation = copy(pose.position), copy(pose.orientation)
    point.x, point.y, point.z = (rotation @ _read_xyz(point) + shift).tolist()
    _turn(orientation, found.rotation)
    return transformed


def _transform_detection(detection: Any, rotation: Array, shift: Array, found: Transform, frame_id: str) -> Any:
    transformed = copy(detection)
    transformed.header = _rename_frame(detection.header, frame_id)
    transformed.bbox = copy(detection.bbox)
    transformed.bbox.center = _transform_pose(detection.bbox.center, rotation, shift, found)
    return transformed


def _read_xyz(vector: Any) -> Array:
    return np.array([vector.x, vector.y, vector.z], dtype=float)


def _turn(orientation: Any, rotation: Any) -> None:
    """Rotate an orientation in place; one that was never set, all 0, is no rotation. Both are quaternions."""
    x, y, z, w = (float(getattr(orientation, axis)) for axis in 'xyzw')
    by_x, by_y, by_z, by_w = (float(getattr(rotation, axis)) for axis in 'xyzw')
    if not (x or y or z or w):
        w = 1.0
    orientation.x = by_w * x + w * by_x + by_y * z - by_z * y
    orientation.y = by_w * y + w * by_y + by_z * x - by_x * z
    orientation.z = by_w * z + w * by_z + by_x * y - by_y * x
    orientation.w = by_w * w - by_x * x - by_y * y - by_z * z


def _transform_cloud(message: Any, rotation: Array, shift: Array, plane: str) -> Any:
    """Return a cloud with x, y, z transformed, vx, vy, vz rotated and yaw turned.

    Raises MessageError for boxes that would not lie in the plane any more, or whose yaw has no field.
    """
    rows = read_table(message).copy()
    sizes = [name for name in ('size_x', 'size_y', 'size_z') if name in (rows.dtype.names or ())]
    if sizes:
        _check_tilt(rotation, plane, sizes[0])
    if {'size_x', 'size_y'} & set(sizes):
        with np.errstate(invalid='ignore'):
            rows['yaw'] = _turn_boxes(rows, rotation, plane)
    for names, offset in ((('x', 'y', 'z'), shift), (('vx', 'vy', 'vz'), np.zeros(3))):
        if not set(names) <= set(rows.dtype.names or ()):
            continue
        with np.errstate(invalid='ignore', over='ignore'):  # rows that are not finite are dropped when the cloud is decoded
            transformed = np.stack([rows[name].astype(float) for name in names], axis=-1) @ rotation.T + offset
            for name, column in zip(names, transformed.T, strict=True):
                rows[name] = column
    made = copy(message)
    made.height, made.width, made.data = 1, len(rows), rows.tobytes()
    return made


def _check_tilt(rotation: Array, plane: str, field: str) -> None:
    """Raise MessageError for a rotation that tilts the sizes of obstacles against the plane."""
    tilt = float(np.abs(project((rotation @ lift(np.eye(2), 0.0, plane).T).T, plane)[1]).max())
    if tilt > MOST_TILT:
        raise MessageError(f'fields[{field}]', 'boxes that the transform leaves in the task plane', f'a tilt of {tilt:.3g}')


def _turn_boxes(rows: Any, rotation: Array, plane: str) -> Array:
    """Return the yaw (n,) [rad] of boxes after a rotation that leaves them in the plane."""
    if 'yaw' not in rows.dtype.names:
        raise MessageError('fields', 'a field yaw, because the transform turns the boxes', ', '.join(rows.dtype.names))
    yaw = rows['yaw'].astype(float)
    first = project(lift(np.column_stack([np.cos(yaw), np.sin(yaw)]), 0.0, plane) @ rotation.T, plane)[0]
    turned: Array = np.arctan2(first[:, 1], first[:, 0])
    return turned
