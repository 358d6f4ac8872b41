"""Transformation of messages into the working frame, if tf2 is installed and knows the transform at the message's stamp.

Otherwise the message is not changed, and is refused later because of its frame. An older transform is not used, because it
would put obstacles in the wrong place.
"""

from __future__ import annotations

from copy import copy, deepcopy
from typing import Any

import numpy as np
from rclpy.time import Time

from foc_ros.core.types import Array
from foc_ros.io.topics import CLOUD, GOALS, MARKERS

from .messages.decode_markers import ADD
from .messages.decode_point_cloud import read_table


class Transforms:
    """Transforms from a listener of tf2 on the node. Attributes: last_error: why the last message was not transformed."""

    def __init__(self, node: Any) -> None:
        self.last_error = ''
        self._buffer: Any = None
        try:
            import tf2_ros
        except ImportError:
            return
        self._buffer = tf2_ros.Buffer()
        self._listener = tf2_ros.TransformListener(self._buffer, node)

    def transform(self, role: str, message: Any, frame_id: str | None) -> Any:
        """Return a message in the working frame; unchanged if that frame or the transform is unknown."""
        if self._buffer is None or frame_id is None:
            return message
        try:
            if role == MARKERS:
                # markers that delete others have no position and often no frame
                parts = [self._transform(each, frame_id) if each.action == ADD else each for each in message.markers]
                return message if parts == message.markers else type(message)(markers=parts)
            return self._transform(message, frame_id, role)
        except Exception as error:  # tf2 has many kinds of errors, and the message is not checked yet
            self.last_error = f'no transform to {frame_id}: {" ".join(str(error).split())}'
            return message

    def _transform(self, message: Any, frame_id: str, role: str = '') -> Any:
        if message.header.frame_id == frame_id:
            return message
        stamp = Time.from_msg(message.header.stamp)
        found = self._buffer.lookup_transform(frame_id, message.header.frame_id, stamp).transform
        rotation, shift = _compute_rotation(found.rotation), _read_xyz(found.translation)
        if role == CLOUD:
            transformed = _transform_cloud(message, rotation, shift)
        else:
            transformed = deepcopy(message)
            for pose in transformed.poses if role == GOALS else [transformed.pose]:
                point = pose.position
                point.x, point.y, point.z = (rotation @ _read_xyz(point) + shift).tolist()
        transformed.header = deepcopy(message.header)
        transformed.header.frame_id = frame_id
        return transformed


def _read_xyz(vector: Any) -> Array:
    return np.array([vector.x, vector.y, vector.z], dtype=float)


def _compute_rotation(quaternion: Any) -> Array:
    """Return the matrix (3, 3) of a quaternion of any length."""
    x, y, z, w = np.array([quaternion.x, quaternion.y, quaternion.z, quaternion.w], dtype=float)
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    rotation: Array = np.eye(3) + 2.0 * (w * cross + cross @ cross) / (x * x + y * y + z * z + w * w)
    return rotation


def _transform_cloud(message: Any, rotation: Array, shift: Array) -> Any:
    """Return a cloud with x, y, z transformed and vx, vy, vz rotated."""
    rows = read_table(message).copy()
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
