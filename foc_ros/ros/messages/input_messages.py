"""The predictor's inputs as messages, as a tracker and a perception node would publish them."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from foc_ros.core.types import Array

from .types import MessageTypes, header

_FLOAT32, _INT32 = 7, 5
_COLUMNS = (*((name, _FLOAT32) for name in ('x', 'y', 'z', 'radius', 'radius_stddev')), ('id', _INT32))
CLOUD_ROW = np.dtype([(name, '<f4' if kind == _FLOAT32 else '<i4') for name, kind in _COLUMNS])
"""One obstacle of the `obstacles` table: metres, and the identity."""


def pose(types: MessageTypes, position: Iterable[float]) -> Any:
    """Return a geometry_msgs/Pose at a position (3,) [m], not turned."""
    x, y, z = position
    return types.make(
        'geometry_msgs/msg/Pose',
        position=types.make('geometry_msgs/msg/Point', x=x, y=y, z=z),
        orientation=types.make('geometry_msgs/msg/Quaternion', w=1.0),
    )


def hand_pose(types: MessageTypes, stamp_ns: int, frame_id: str, position: Iterable[float]) -> Any:
    """Return the hand's geometry_msgs/PoseStamped at a position (3,) [m]."""
    return types.make('geometry_msgs/msg/PoseStamped', header=header(types, stamp_ns, frame_id), pose=pose(types, position))


def goal_poses(types: MessageTypes, stamp_ns: int, frame_id: str, positions: Array) -> Any:
    """Return the goals' geometry_msgs/PoseArray from positions (g, 3) [m]."""
    made_header = header(types, stamp_ns, frame_id)
    return types.make('geometry_msgs/msg/PoseArray', header=made_header, poses=[pose(types, each) for each in positions])


def obstacle_cloud(types: MessageTypes, stamp_ns: int, frame_id: str, rows: Sequence[tuple[float, ...]]) -> Any:
    """Return the scene's sensor_msgs/PointCloud2 from rows (x, y, z, radius, radius_stddev, id) as in :data:`CLOUD_ROW`."""
    table = np.array(rows, dtype=CLOUD_ROW)
    return types.make(
        'sensor_msgs/msg/PointCloud2',
        header=header(types, stamp_ns, frame_id),
        height=1,
        width=len(table),
        fields=[
            types.make('sensor_msgs/msg/PointField', name=name, offset=4 * place, datatype=kind, count=1)
            for place, (name, kind) in enumerate(_COLUMNS)
        ],
        point_step=CLOUD_ROW.itemsize,
        row_step=table.nbytes,
        data=table.tobytes(),
        is_dense=True,
    )
