# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Encoding of the predictor's inputs, as a tracker and a perception node publish them; positions (3,) in metres."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from functools import lru_cache
from typing import Any

import numpy as np

from foc_ros.core.types import Array

from .types import MessageTypes, make_header

_DATATYPES = {'<i4': 5, '<u4': 6, '<f4': 7}
CLOUD_ROW = np.dtype([*((name, '<f4') for name in ('x', 'y', 'z', 'radius', 'radius_stddev')), ('id', '<i4')])
"""One circle of the `obstacles` table [m], and its id."""
BOX_ROW = np.dtype([*CLOUD_ROW.descr, *((name, '<f4') for name in ('size_x', 'size_y', 'yaw'))])
"""One obstacle of a table with boxes: circles have the sizes 0."""


NO_ROTATION = (0.0, 0.0, 0.0, 1.0)
"""Quaternion (x, y, z, w) of a pose without rotation."""


def encode_hand_pose(types: MessageTypes, stamp_ns: int, frame_id: str, position: Iterable[float]) -> Any:
    """Encode a geometry_msgs/PoseStamped."""
    header = make_header(types, stamp_ns, frame_id)
    return types.fill('geometry_msgs/msg/PoseStamped', (header, (tuple(position), NO_ROTATION)))


def encode_goals(types: MessageTypes, stamp_ns: int, frame_id: str, positions: Array) -> Any:
    """Encode goals (g, 3) as a geometry_msgs/PoseArray."""
    poses = [(position, NO_ROTATION) for position in positions]
    return types.fill('geometry_msgs/msg/PoseArray', (make_header(types, stamp_ns, frame_id), poses))


def encode_obstacles(types: MessageTypes, stamp_ns: int, frame_id: str, rows: Sequence[tuple[float, ...]]) -> Any:
    """Encode obstacles x, y, z, radius, radius_stddev, id and, unless they are circles, size_x, size_y, yaw as a PointCloud2."""
    columns, count = (BOX_ROW, 9) if any(any(row[6:8]) for row in rows) else (CLOUD_ROW, 6)
    table = np.array([(*row, 0.0, 0.0, 0.0)[:count] for row in rows], dtype=columns)
    return encode_table(types, make_header(types, stamp_ns, frame_id), table)


def encode_boxes(types: MessageTypes, stamp_ns: int, frame_id: str, boxes: Mapping[str, Sequence[float]]) -> Any:
    """Encode boxes by name, x, y, z of the centre and full lengths along these axes [m], as a MarkerArray of cubes."""
    shared = {'type': 1, 'header': make_header(types, stamp_ns, frame_id), 'color': (0.45, 0.45, 0.5, 0.9)}
    markers = [
        {'ns': name, 'pose': (tuple(box[:3]), NO_ROTATION), 'scale': tuple(box[3:]), **shared} for name, box in boxes.items()
    ]
    return types.make('visualization_msgs/msg/MarkerArray', markers=markers)


def encode_array(types: MessageTypes, array: Array, dimensions: Sequence[tuple[str, int, int]]) -> Any:
    """Encode an array as a std_msgs/Float64MultiArray; dimensions: label, size and stride of each."""
    return types.fill('std_msgs/msg/Float64MultiArray', ((dimensions, 0), array.ravel()))


def encode_table(types: MessageTypes, cloud_header: Any, table: np.ndarray[Any, np.dtype[np.void]]) -> Any:
    """Encode a structured array with columns of 4 bytes as a sensor_msgs/PointCloud2 of one row per point."""
    return types.make(
        'sensor_msgs/msg/PointCloud2',
        header=cloud_header,
        height=1,
        width=len(table),
        fields=_encode_columns(types, table.dtype),  # all clouds of one kind share them
        point_step=table.dtype.itemsize,
        row_step=table.nbytes,
        data=table.tobytes(),
        is_dense=True,
    )


@lru_cache(maxsize=8)
def _encode_columns(types: MessageTypes, columns: np.dtype[np.void]) -> list[Any]:
    fields = (columns.fields or {}).items()
    return [types.fill('sensor_msgs/msg/PointField', (name, at, _DATATYPES[kind.str], 1)) for name, (kind, at, *_) in fields]
