"""Serialized hand poses: the stamp is read before all else, because most poses of a fast hand are skipped by it.

A pose is decoded here, in place of `rclpy`, which takes ten times as long to make its Python objects. In CDR, four bytes describe
the encoding. A number is aligned to its own size, counted from there, and a text has its length before and a zero at its end.
"""

from __future__ import annotations

import struct
from types import SimpleNamespace
from typing import Any

from geometry_msgs.msg import PoseStamped
from rclpy.serialization import deserialize_message

from foc_ros.core.errors import MessageError
from foc_ros.core.types import NANOSECONDS

BEGIN = 4
"""Number of bytes that describe the encoding."""
PLAIN = {b'\0\1': '<', b'\0\0': '>'}
"""Order of the bytes by the description of the encoding; other encodings are left to rclpy."""
_HEADERS = {order: struct.Struct(f'{order}iII') for order in '<>'}
_POSES = {order: struct.Struct(f'{order}7d') for order in '<>'}


def read_stamp(serialized: bytes) -> int:
    """Return the stamp [ns] of a message in CDR that begins with a std_msgs/Header; 0 if it cannot be read or is wrong."""
    order = PLAIN.get(serialized[:2])
    if order is None or len(serialized) < BEGIN + _HEADERS[order].size:
        return 0
    seconds, nanoseconds, _ = _HEADERS[order].unpack_from(serialized, BEGIN)
    return int(seconds * NANOSECONDS + nanoseconds) if seconds >= 0 and nanoseconds < NANOSECONDS else 0


def deserialize_pose(serialized: bytes) -> Any:
    """Return an object with the attributes of a geometry_msgs/PoseStamped; raise MessageError for bytes that are none."""
    order = PLAIN.get(serialized[:2])
    try:
        if order is None:
            return deserialize_message(serialized, PoseStamped)
        sec, nanosec, length = _HEADERS[order].unpack_from(serialized, BEGIN)
        end = BEGIN + _HEADERS[order].size + length
        frame_id = serialized[end - length : end - 1].decode()
        x, y, z, *quaternion = _POSES[order].unpack_from(serialized, end + (BEGIN - end) % 8)
    except (RuntimeError, UnicodeDecodeError, struct.error) as error:
        raise MessageError('message', 'a serialized geometry_msgs/PoseStamped', f'{len(serialized)} other bytes') from error
    header = SimpleNamespace(stamp=SimpleNamespace(sec=sec, nanosec=nanosec), frame_id=frame_id)
    orientation = SimpleNamespace(**dict(zip('xyzw', quaternion, strict=True)))
    return SimpleNamespace(header=header, pose=SimpleNamespace(position=SimpleNamespace(x=x, y=y, z=z), orientation=orientation))
