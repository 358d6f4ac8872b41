# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Messages of packages that need not be installed, made from their definitions: collision objects and detections."""

from collections.abc import Sequence
from typing import Any

from message_helpers import SECOND, pose
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from foc_ros.ros.messages.types import RosbagsTypes, make_header

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
STORE = get_typestore(Stores.ROS2_JAZZY)
for _name, _text in DEFINITIONS.items():
    STORE.register(get_types_from_msg(_text, _name))
OBJECT_TYPES = RosbagsTypes(STORE)
Primitive = tuple[int, Sequence[float], Sequence[float]]
"""Kind, dimensions and position of a primitive of a collision object."""


def collision_object(
    *primitives: Primitive,
    name: str = 'table',
    place: Sequence[float] = (0, 0, 0),
    turned: dict[str, float] | None = None,
    operation: int = 0,
    stamp_ns: int = SECOND,
    frame_id: str = 'world',
    **changes: Any,
) -> Any:
    """Return a CollisionObject; changes: fields with other values."""
    make = OBJECT_TYPES.make
    values = {
        'header': make_header(OBJECT_TYPES, stamp_ns, frame_id),
        'pose': pose(OBJECT_TYPES, place, turned or {'w': 1.0}),
        'id': name,
        'primitives': [make('shape_msgs/msg/SolidPrimitive', type=kind, dimensions=size) for kind, size, _ in primitives],
        'primitive_poses': [pose(OBJECT_TYPES, position) for _, _, position in primitives],
        'operation': operation,
    }
    return make('moveit_msgs/msg/CollisionObject', **values | changes)


def detection(
    place: Sequence[float], size: Sequence[float], name: str = '', turned: dict[str, float] | None = None, frame_id: str = ''
) -> Any:
    make = OBJECT_TYPES.make
    length = OBJECT_TYPES.fill('geometry_msgs/msg/Vector3', size)
    box = make('vision_msgs/msg/BoundingBox3D', center=pose(OBJECT_TYPES, place, turned or {'w': 1.0}), size=length)
    return make('vision_msgs/msg/Detection3D', header=make_header(OBJECT_TYPES, 0, frame_id), bbox=box, id=name)


def detections(*each: Any, stamp_ns: int = SECOND, frame_id: str = 'world') -> Any:
    header = make_header(OBJECT_TYPES, stamp_ns, frame_id)
    return OBJECT_TYPES.make('vision_msgs/msg/Detection3DArray', header=header, detections=list(each))
