"""Encoding of the predictor's inputs, as a tracker and a perception node publish them; positions (3,) in metres."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import lru_cache
from typing import Any

import numpy as np

from foc_ros.core.types import Array

from .types import MessageTypes, make_header

_NAMES = ('x', 'y', 'z', 'radius', 'radius_stddev', 'id')
_DATATYPES = {'<i4': 5, '<u4': 6, '<f4': 7}
CLOUD_ROW = np.dtype([(name, '<i4' if name == 'id' else '<f4') for name in _NAMES])
"""One obstacle of the `obstacles` table [m], and its id."""


def encode_pose(types: MessageTypes, position: Iterable[float]) -> Any:
    """Encode a geometry_msgs/Pose without rotation."""
    x, y, z = position
    return types.make(
        'geometry_msgs/msg/Pose',
        position=types.make('geometry_msgs/msg/Point', x=x, y=y, z=z),
        orientation=_no_rotation(types),
    )


@lru_cache(maxsize=8)
def _no_rotation(types: MessageTypes) -> Any:
    return types.make('geometry_msgs/msg/Quaternion', w=1.0)


def encode_hand_pose(types: MessageTypes, stamp_ns: int, frame_id: str, position: Iterable[float]) -> Any:
    """Encode a geometry_msgs/PoseStamped."""
    return types.make(
        'geometry_msgs/msg/PoseStamped', header=make_header(types, stamp_ns, frame_id), pose=encode_pose(types, position)
    )


def encode_goals(types: MessageTypes, stamp_ns: int, frame_id: str, positions: Array) -> Any:
    """Encode goals (g, 3) as a geometry_msgs/PoseArray."""
    poses = [encode_pose(types, position) for position in positions]
    return types.make('geometry_msgs/msg/PoseArray', header=make_header(types, stamp_ns, frame_id), poses=poses)


def encode_obstacles(types: MessageTypes, stamp_ns: int, frame_id: str, rows: Sequence[tuple[float, ...]]) -> Any:
    """Encode obstacles (x, y, z, radius, radius_stddev, id) as a sensor_msgs/PointCloud2."""
    return encode_table(types, make_header(types, stamp_ns, frame_id), np.array(rows, dtype=CLOUD_ROW))


def encode_table(types: MessageTypes, cloud_header: Any, table: np.ndarray[Any, np.dtype[np.void]]) -> Any:
    """Encode a structured array with columns of 4 bytes as a sensor_msgs/PointCloud2 of one row per point."""
    return types.make(
        'sensor_msgs/msg/PointCloud2',
        header=cloud_header,
        height=1,
        width=len(table),
        fields=_encode_columns(types, table.dtype),
        point_step=table.dtype.itemsize,
        row_step=table.nbytes,
        data=table.tobytes(),
        is_dense=True,
    )


@lru_cache(maxsize=8)
def _encode_columns(types: MessageTypes, columns: np.dtype[np.void]) -> list[Any]:
    """Return the PointFields of a table; cached, because all clouds of one kind share them."""
    return [
        types.make('sensor_msgs/msg/PointField', name=name, offset=offset, datatype=_DATATYPES[kind.str], count=1)
        for name, (kind, offset, *_) in (columns.fields or {}).items()
    ]
