# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Input messages for tests, of rclpy and of rosbags."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
import pytest
import ros_helpers
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from foc_ros.ros.messages.types import MessageTypes, RclpyTypes, RosbagsTypes, make_header

DEFINITIONS = {
    'object_recognition_msgs/msg/ObjectType': 'string key\nstring db\n',
    'moveit_msgs/msg/CollisionObject': (
        'std_msgs/Header header\ngeometry_msgs/Pose pose\nstring id\nobject_recognition_msgs/ObjectType type\n'
        'shape_msgs/SolidPrimitive[] primitives\ngeometry_msgs/Pose[] primitive_poses\n'
        'shape_msgs/Mesh[] meshes\ngeometry_msgs/Pose[] mesh_poses\nshape_msgs/Plane[] planes\ngeometry_msgs/Pose[] plane_poses\n'
        'string[] subframe_names\ngeometry_msgs/Pose[] subframe_poses\n'
        'byte ADD=0\nbyte REMOVE=1\nbyte APPEND=2\nbyte MOVE=3\nbyte operation\n'
    ),
    'vision_msgs/msg/ObjectHypothesis': 'string class_id\nfloat64 score\n',
    'vision_msgs/msg/ObjectHypothesisWithPose': 'ObjectHypothesis hypothesis\ngeometry_msgs/PoseWithCovariance pose\n',
    'vision_msgs/msg/BoundingBox3D': 'geometry_msgs/Pose center\ngeometry_msgs/Vector3 size\n',
    'vision_msgs/msg/Detection3D': 'std_msgs/Header header\nObjectHypothesisWithPose[] results\nBoundingBox3D bbox\nstring id\n',
    'vision_msgs/msg/Detection3DArray': 'std_msgs/Header header\nDetection3D[] detections\n',
}
"""Messages of packages that need not be installed: collision objects and detections."""
STORE = get_typestore(Stores.ROS2_JAZZY)
for _name, _text in DEFINITIONS.items():
    STORE.register(get_types_from_msg(_text, _name))
BAGS = RosbagsTypes(STORE)
DATATYPES = {'i1': 1, 'u1': 2, 'i2': 3, 'u2': 4, 'i4': 5, 'u4': 6, 'f4': 7, 'f8': 8}
SECOND = 1_000_000_000


def message_types(kind: str) -> MessageTypes:
    """Return the message classes of 'rosbags' or of 'rclpy'; skip the test if rclpy is missing."""
    if kind == 'rosbags':
        return BAGS
    ros_helpers.require_ros()
    return RclpyTypes()


both_kinds = pytest.mark.parametrize('types', ['rclpy', 'rosbags'], indirect=True)
"""Runs a test with the fixture `types` of conftest once for each library."""


def pose(types: MessageTypes, position: Sequence[float], turned: Mapping[str, float] = {'w': 1.0}) -> Any:
    """Return a pose; turned: its quaternion by axis."""
    return types.make(
        'geometry_msgs/msg/Pose',
        position=types.fill('geometry_msgs/msg/Point', position),
        orientation=types.make('geometry_msgs/msg/Quaternion', **{'w': 0.0} | dict(turned)),
    )


def pose_stamped(
    types: MessageTypes, position: Sequence[float], stamp_ns: int = SECOND, frame_id: str = 'world', **turned: float
) -> Any:
    """Return a pose; turned: its quaternion by axis."""
    header, placed = make_header(types, stamp_ns, frame_id), pose(types, position, turned or {'w': 1.0})
    return types.make('geometry_msgs/msg/PoseStamped', header=header, pose=placed)


def pose_array(types: MessageTypes, positions: Iterable[Sequence[float]], frame_id: str = 'world') -> Any:
    poses = [pose(types, position) for position in positions]
    return types.make('geometry_msgs/msg/PoseArray', header=make_header(types, SECOND, frame_id), poses=poses)


def cloud(types: MessageTypes, table: np.ndarray, stamp_ns: int = SECOND, frame_id: str = 'world', **changes: Any) -> Any:
    """Return the PointCloud2 of a structured array; changes: fields with other values."""
    fields = [
        types.make('sensor_msgs/msg/PointField', name=name, offset=offset, datatype=DATATYPES[kind.str[1:]], count=1)
        for name, (kind, offset, *_) in (table.dtype.fields or {}).items()
    ]
    values: dict[str, Any] = {
        'header': make_header(types, stamp_ns, frame_id),
        'height': 1,
        'width': len(table),
        'fields': fields,
        'is_bigendian': any(kind.str[0] == '>' for kind, *_ in (table.dtype.fields or {}).values()),
        'point_step': table.dtype.itemsize,
        'row_step': table.nbytes,
        'data': table.tobytes(),
        'is_dense': True,
    }
    return types.make('sensor_msgs/msg/PointCloud2', **values | changes)


def obstacle_table(rows: Sequence[tuple[float, ...]], dtype: Any = None) -> np.ndarray:
    """Return rows (x, y, z, radius) as a structured array, or with other columns."""
    return np.array(rows, dtype=dtype or [(name, '<f4') for name in ('x', 'y', 'z', 'radius')])


def marker(
    types: MessageTypes, position: Sequence[float] = (0, 0, 0), scale: Sequence[float] = (0.1, 0.1, 0.1), **changes: Any
) -> Any:
    """Return a sphere that is added; changes: ns, id, type, action, lifetime [s], stamp_ns, frame_id, turned."""
    head = make_header(types, changes.pop('stamp_ns', SECOND), changes.pop('frame_id', 'world'))
    seconds, nanoseconds = divmod(round(changes.pop('lifetime', 0) * SECOND), SECOND)
    turned = changes.pop('turned', {'w': 1.0})
    values = {'ns': 'a', 'id': 0, 'type': 2, 'action': 0} | changes
    return types.make(
        'visualization_msgs/msg/Marker',
        header=head,
        pose=pose(types, position, turned),
        scale=types.fill('geometry_msgs/msg/Vector3', scale),
        lifetime=types.make('builtin_interfaces/msg/Duration', sec=seconds, nanosec=nanoseconds),
        **values,
    )


def marker_array(types: MessageTypes, *markers: Any) -> Any:
    return types.make('visualization_msgs/msg/MarkerArray', markers=list(markers))


def transform(
    types: MessageTypes,
    child: str,
    translation: Sequence[float],
    rotation: Sequence[float] = (0.0, 0.0, 0.0, 1.0),
    stamp_ns: int = 0,
    parent: str = 'world',
) -> Any:
    """Return a geometry_msgs/TransformStamped; rotation: a quaternion (x, y, z, w)."""
    shift, turn = types.fill('geometry_msgs/msg/Vector3', translation), types.fill('geometry_msgs/msg/Quaternion', rotation)
    moved = types.fill('geometry_msgs/msg/Transform', (shift, turn))
    return types.fill('geometry_msgs/msg/TransformStamped', (make_header(types, stamp_ns, parent), child, moved))


def read_columns(cloud: Any) -> dict[str, np.ndarray]:
    """Read a cloud by its own field descriptions."""
    raw = np.frombuffer(bytes(cloud.data), np.uint8).reshape(cloud.height * cloud.width, cloud.point_step)
    dtypes = {7: '<f4', 6: '<u4', 5: '<i4'}
    return {
        field.name: raw[:, field.offset : field.offset + 4].copy().view(dtypes[field.datatype])[:, 0] for field in cloud.fields
    }


def collision_object(
    *primitives: tuple[int, Sequence[float], Sequence[float]],
    name: str = 'table',
    place: Sequence[float] = (0, 0, 0),
    turned: dict[str, float] | None = None,
    operation: int = 0,
    stamp_ns: int = SECOND,
    frame_id: str = 'world',
    **changes: Any,
) -> Any:
    """Return a CollisionObject of primitives (kind, dimensions, position); changes: fields with other values."""
    make = BAGS.make
    values = {
        'header': make_header(BAGS, stamp_ns, frame_id),
        'pose': pose(BAGS, place, turned or {'w': 1.0}),
        'id': name,
        'primitives': [make('shape_msgs/msg/SolidPrimitive', type=kind, dimensions=size) for kind, size, _ in primitives],
        'primitive_poses': [pose(BAGS, position) for _, _, position in primitives],
        'operation': operation,
    }
    return make('moveit_msgs/msg/CollisionObject', **values | changes)


def detection(
    place: Sequence[float], size: Sequence[float], name: str = '', turned: dict[str, float] | None = None, frame_id: str = ''
) -> Any:
    make = BAGS.make
    length = BAGS.fill('geometry_msgs/msg/Vector3', size)
    box = make('vision_msgs/msg/BoundingBox3D', center=pose(BAGS, place, turned or {'w': 1.0}), size=length)
    return make('vision_msgs/msg/Detection3D', header=make_header(BAGS, 0, frame_id), bbox=box, id=name)


def detections(*each: Any, stamp_ns: int = SECOND, frame_id: str = 'world') -> Any:
    header = make_header(BAGS, stamp_ns, frame_id)
    return BAGS.make('vision_msgs/msg/Detection3DArray', header=header, detections=list(each))
