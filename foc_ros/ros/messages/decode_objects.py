"""Decoding of the objects of a planning scene (moveit_msgs/CollisionObject) and of a detector (vision_msgs/Detection3DArray).

Neither package is needed here: a message is read by the names of its fields.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import Any

import numpy as np

from foc_ros.core.errors import MessageError
from foc_ros.core.obstacles.shapes import make_hull_polygon
from foc_ros.core.types import UNKNOWN_HEIGHTS, Array, Obstacles, make_obstacles

from .decode_point_cloud import MAX_ROWS, DecodedCloud
from .decode_poses import MAX_COORDINATE, check_coordinate, decode_frame, decode_stamp
from .plane import compute_rotation, make_heights, project, project_box

ADD, REMOVE, APPEND, MOVE = range(4)
BOX, SPHERE, CYLINDER = 1, 2, 3
DIMENSIONS = {BOX: 3, SPHERE: 1, CYLINDER: 2}
"""Number of dimensions of each shape_msgs/SolidPrimitive that becomes an obstacle."""
Outline = tuple[Array, Array, float, Array]
"""Centre (2,), polygon (v, 2) and radius of an obstacle in the task plane, and its lowest and highest point (2,) [m]."""


@dataclass(frozen=True)
class Pose:
    """A place (3,) [m] and a rotation (3, 3)."""

    place: Array
    rotation: Array

    def apply(self, inner: Pose) -> Pose:
        """Return a pose that is given relative to this one."""
        return Pose(self.place + self.rotation @ inner.place, self.rotation @ inner.rotation)


@dataclass(frozen=True)
class CollisionObject:
    """The primitives of an object: kind, dimensions [m] and pose of each relative to the pose of the object."""

    pose: Pose
    primitives: tuple[tuple[int, tuple[float, ...], Pose], ...]


@dataclass(frozen=True)
class CollisionTable:
    """The present collision objects by id; immutable: an update returns a new table.

    frame_id: of all objects; stamp_ns: of the last message; dropped: parts of it that are no obstacles (`not_a_shape`).
    """

    objects: Mapping[str, CollisionObject] = field(default_factory=dict)
    frame_id: str = ''
    stamp_ns: int = 0
    dropped: Mapping[str, int] = field(default_factory=dict)

    def with_message(self, message: Any) -> CollisionTable:
        """Return the table after a CollisionObject.

        ADD replaces an object, APPEND adds primitives to it, MOVE changes its pose, REMOVE removes it, or all if the id is empty.
        Boxes, spheres and cylinders are obstacles; other primitives, meshes and planes are counted. Raises MessageError, and then
        nothing is changed, for a wrong operation, number of dimensions or poses, size or coordinate, or another frame.
        """
        stamp_ns, frame_id, name = decode_stamp(message.header), decode_frame(message.header), str(message.id)
        operation = message.operation[0] if isinstance(message.operation, bytes) else int(message.operation)
        held = dict(self.objects)
        if operation == REMOVE:
            held = {other: kept for other, kept in held.items() if name not in ('', other)}
            return CollisionTable(MappingProxyType(held), self.frame_id if held else frame_id, stamp_ns)
        if operation not in (ADD, APPEND, MOVE):
            raise MessageError('operation', 'ADD (0), REMOVE (1), APPEND (2) or MOVE (3)', operation)
        if held and frame_id != self.frame_id:
            raise MessageError('header.frame_id', f"'{self.frame_id}', as the other objects", f"'{frame_id}'")
        pose, dropped = _read_pose('pose', message.pose), Counter[str]()
        if operation == MOVE:
            if name not in held:
                raise MessageError('id', 'an object that was added before it is moved', repr(name))
            held[name] = replace(held[name], pose=pose)
        else:
            found = _read_primitives(message, dropped)
            before = held[name].primitives if operation == APPEND and name in held else ()
            held[name] = CollisionObject(pose, before + found)
        if sum(len(each.primitives) for each in held.values()) > MAX_ROWS:
            raise MessageError('primitives', f'at most {MAX_ROWS} obstacles held at a time', 'more')
        return CollisionTable(MappingProxyType(held), frame_id, stamp_ns, MappingProxyType(+dropped))

    def obstacles(self, plane: str, radius_stddev: float) -> Obstacles:
        """Return the primitives as obstacles; the name of one is the id of its object and its number in it."""
        outlines = {
            encode_name(name, str(number)): _outline(kind, size, each.pose.apply(pose), plane)
            for name, each in self.objects.items()
            for number, (kind, size, pose) in enumerate(each.primitives)
        }
        return _collect(outlines, radius_stddev)


def decode_detections(message: Any, plane: str, radius_stddev: float) -> DecodedCloud:
    """Decode the boxes of a Detection3DArray, the whole scene; the name of one is its id, or its row if it has none.

    A detection with a number that is not finite is dropped and counted; of several with one id the last is used. Raises
    MessageError for a negative size, a box without an extent in the plane, a coordinate beyond MAX_COORDINATE, another frame than
    that of the array, or too many detections.
    """
    stamp_ns, frame_id = decode_stamp(message.header), decode_frame(message.header)
    if len(message.detections) > MAX_ROWS:
        raise MessageError('detections', f'at most {MAX_ROWS} obstacles', len(message.detections))
    outlines: dict[str, Outline] = {}
    dropped = Counter[str]()
    for row, each in enumerate(message.detections):
        label, own_frame = f'detections[{row}]', decode_frame(each.header)
        if own_frame not in ('', frame_id):
            raise MessageError(f'{label}.header.frame_id', f"'{frame_id}', as the array", f"'{own_frame}'")
        centre, size = each.bbox.center, (each.bbox.size.x, each.bbox.size.y, each.bbox.size.z)
        place, turned = centre.position, centre.orientation
        if not all(map(math.isfinite, (place.x, place.y, place.z, turned.x, turned.y, turned.z, turned.w, *size))):
            dropped['not_finite'] += 1
            continue
        for axis, length in zip('xyz', size, strict=True):
            _check_size(f'{label}.bbox.size.{axis}', length)
        name = encode_name(str(each.id) or str(row))
        dropped['duplicate_id'] += outlines.pop(name, None) is not None
        outlines[name] = _outline(BOX, size, _read_pose(f'{label}.bbox.center', centre), plane, f'{label}.bbox.size')
    return DecodedCloud(_collect(outlines, radius_stddev), stamp_ns, frame_id, dict(+dropped))


def encode_name(*parts: str) -> str:
    """Return the parts of a name joined by '/', without ';', which separates the labels of candidates."""
    return '/'.join(part.replace('%', '%25').replace(';', '%3B') for part in parts)


def _read_primitives(message: Any, dropped: Counter[str]) -> tuple[tuple[int, tuple[float, ...], Pose], ...]:
    if len(message.primitive_poses) != len(message.primitives):
        raise MessageError('primitive_poses', f'{len(message.primitives)}, one for each primitive', len(message.primitive_poses))
    dropped['not_a_shape'] += len(message.meshes) + len(message.planes)
    found = []
    for number, (primitive, pose) in enumerate(zip(message.primitives, message.primitive_poses, strict=True)):
        kind, field_name = int(primitive.type), f'primitives[{number}].dimensions'
        if kind not in DIMENSIONS:
            dropped['not_a_shape'] += 1
            continue
        size = tuple(float(length) for length in primitive.dimensions)
        if len(size) != DIMENSIONS[kind]:
            raise MessageError(field_name, f'{DIMENSIONS[kind]} numbers for a primitive of type {kind}', len(size))
        for place, length in enumerate(size):
            _check_size(f'{field_name}[{place}]', length)
        if not any(size):
            raise MessageError(field_name, 'a size > 0 m', '0')
        found.append((kind, size, _read_pose(f'primitive_poses[{number}]', pose)))
    return tuple(found)


def _read_pose(name: str, pose: Any) -> Pose:
    place, turned = pose.position, pose.orientation
    for axis in 'xyz':
        check_coordinate(f'{name}.position.{axis}', getattr(place, axis))
    for axis in 'xyzw':
        check_coordinate(f'{name}.orientation.{axis}', getattr(turned, axis))
    return Pose(np.array([place.x, place.y, place.z], dtype=float), compute_rotation(turned))


def _check_size(name: str, length: float) -> None:
    if not 0.0 <= length <= MAX_COORDINATE:
        raise MessageError(name, f'a size in [0, {MAX_COORDINATE:g}] m', f'{length:g}')


def _outline(kind: int, size: tuple[float, ...], pose: Pose, plane: str, name: str = 'primitives') -> Outline:
    """Return a primitive in the plane: a sphere is a circle of unknown height, a cylinder all within its radius of its axis."""
    if kind == SPHERE:
        return project(pose.place, plane)[0], np.zeros((1, 2)), size[0], UNKNOWN_HEIGHTS
    if kind == CYLINDER:
        upright = float(project(pose.rotation[:, 2], plane)[1])
        ends = pose.place + np.outer([0.5, -0.5], size[0] * pose.rotation[:, 2])
        extent = size[0] * abs(upright) + 2.0 * size[1] * math.sqrt(max(1.0 - upright**2, 0.0))
        heights = make_heights(project(pose.place, plane)[1], extent)
        return (*make_hull_polygon(project(ends, plane)[0]), size[1], heights)
    centre, polygon, heights = project_box(pose.place, size, pose.rotation, plane)
    if len(polygon) == 1:
        raise MessageError(name, 'a size > 0 m along an axis of the plane', ' x '.join(f'{length:g}' for length in size))
    return centre, polygon, 0.0, heights


def _collect(outlines: Mapping[str, Outline], radius_stddev: float) -> Obstacles:
    if not outlines:
        return make_obstacles()
    centres, polygons, radii, heights = zip(*outlines.values(), strict=True)
    return make_obstacles(centres, radii, radius_stddev, tuple(outlines), polygons=polygons, heights=heights)
