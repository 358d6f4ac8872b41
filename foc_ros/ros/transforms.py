"""Messages of other frames, moved into the working one: where tf2 is installed and knows the way.

Without tf2 nothing is moved, and a message in another frame is refused. The same happens where no transform is known at the
message's own stamp: an older one would put obstacles where they are not.
"""

from __future__ import annotations

from copy import copy, deepcopy
from typing import Any

import numpy as np
from rclpy.time import Time

from foc_ros.core.types import Array
from foc_ros.io.topics import CLOUD, GOALS, MARKERS

from .messages.marker_scene import ADD

_KINDS = {7: 'f4', 8: 'f8'}


class Frames:
    """Asks tf2, through a listener on the node. Attributes: last_error, why the last message could not be moved."""

    def __init__(self, node: Any) -> None:
        self.last_error = ''
        self._buffer: Any = None
        try:
            import tf2_ros
        except ImportError:
            return
        self._buffer = tf2_ros.Buffer()
        self._listener = tf2_ros.TransformListener(self._buffer, node)

    def moved(self, role: str, message: Any, frame_id: str | None) -> Any:
        """Return a message in the working frame; as it is where that is unknown, or tf2 does not know the way."""
        if self._buffer is None or frame_id is None:
            return message
        try:
            if role == MARKERS:
                # what takes markers out has no place, and often no frame
                parts = [self._part(each, frame_id) if each.action == ADD else each for each in message.markers]
                return message if parts == message.markers else type(message)(markers=parts)
            return self._part(message, frame_id, role)
        except Exception as error:  # tf2 has many, and the message is not checked yet
            self.last_error = f'no transform to {frame_id}: {" ".join(str(error).split())}'
            return message

    def _part(self, message: Any, frame_id: str, role: str = '') -> Any:
        if message.header.frame_id == frame_id:
            return message
        stamp = Time.from_msg(message.header.stamp)
        found = self._buffer.lookup_transform(frame_id, message.header.frame_id, stamp).transform
        rotation, origin = _rotation(found.rotation), found.translation
        shift = np.array([origin.x, origin.y, origin.z])
        if role == CLOUD:
            made = _moved_cloud(message, rotation, shift)
        else:
            made = deepcopy(message)
            for pose in made.poses if role == GOALS else [made.pose]:
                place = rotation @ np.array([pose.position.x, pose.position.y, pose.position.z]) + shift
                pose.position.x, pose.position.y, pose.position.z = place.tolist()
        made.header = deepcopy(message.header)
        made.header.frame_id = frame_id
        return made


def _rotation(quaternion: Any) -> Array:
    """Return the matrix (3, 3) of a quaternion, of whatever length."""
    x, y, z, w = np.array([quaternion.x, quaternion.y, quaternion.z, quaternion.w], dtype=float)
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    turned: Array = np.eye(3) + 2.0 * (w * cross + cross @ cross) / (x * x + y * y + z * z + w * w)
    return turned


def _moved_cloud(message: Any, rotation: Array, shift: Array) -> Any:
    """Return a cloud with x, y, z moved and vx, vy, vz turned; whatever else its rows hold stays."""
    order = '>' if message.is_bigendian else '<'
    fields = {field.name: (order + _KINDS[field.datatype], field.offset) for field in message.fields if field.datatype in _KINDS}
    formats, offsets = zip(*fields.values(), strict=True)
    layout = np.dtype({'names': list(fields), 'formats': formats, 'offsets': offsets, 'itemsize': message.point_step})
    rows = np.frombuffer(bytearray(bytes(message.data)), dtype=layout)
    for names, offset in ((('x', 'y', 'z'), shift), (('vx', 'vy', 'vz'), np.zeros(3))):
        if not all(name in fields for name in names):
            continue
        with np.errstate(invalid='ignore', over='ignore'):  # rows that are not finite are left out where the cloud is read
            moved = np.stack([rows[name].astype(float) for name in names], axis=-1) @ rotation.T + offset
            for name, column in zip(names, moved.T, strict=True):
                rows[name] = column
    made = copy(message)
    made.data = rows.tobytes()
    return made
