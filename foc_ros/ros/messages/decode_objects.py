# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Decoding of markers (visualization_msgs/MarkerArray), of a planning scene (moveit_msgs/CollisionObject) and of detections.

Each becomes obstacles: rounded polygons in the task plane with their heights. A message is read by the names of its fields, so
the packages of collision objects and of vision_msgs/Detection3DArray need not be installed. A table of markers or objects is
immutable: an update returns a new one.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np

from foc_ros.core.errors import MessageError
from foc_ros.core.obstacle_table import UNKNOWN_HEIGHTS, Obstacles, make_obstacles
from foc_ros.core.obstacles.polygons import make_hull_polygon
from foc_ros.core.types import NANOSECONDS, Array

from .decode_point_cloud import MAX_ROWS, DecodedCloud
from .decode_poses import MAX_COORDINATE, Place, check_coordinates, decode_frame, decode_stamp, stay
from .plane import Transform, compute_rotation, make_heights, project, project_box

ADD, DELETE, DELETE_ALL = 0, 2, 3
"""Actions of a marker."""
REMOVE, APPEND, MOVE = 1, 2, 3
"""Operations on a collision object besides ADD."""
BOX, SPHERE, CYLINDER = 1, 2, 3
"""Types that become obstacles, of markers and of primitives alike."""
DIMENSIONS = {BOX: 3, SPHERE: 1, CYLINDER: 2}
"""Number of dimensions of each shape_msgs/SolidPrimitive that becomes an obstacle."""
POINT = np.zeros((1, 2))
"""The polygon of a circle."""
Key = tuple[str, int]


class Outline(NamedTuple):
    """An obstacle: centre (2,), polygon (v, 2) and radius in the task plane, and its lowest and highest point (2,) [m]."""

    centre: Array
    polygon: Array
    radius: float
    heights: Array


@dataclass(frozen=True)
class MarkerTable:
    """The present markers, updated as RViz updates its own.

    A marker is identified by (ns, id). ADD inserts or replaces it, DELETE removes it, DELETEALL removes the markers of its ns, or
    all of them if ns is empty. A marker with a lifetime expires when that has passed since its stamp.

    markers: outline, standard deviation of the radius [m] and end of the lifetime [ns], infinite if it does not expire, of each;
    frame_id: of all markers; stamp_ns: newest stamp of the last message, 0 if it had none; dropped: markers of the last message
    that are no obstacles, by reason (`not_finite`, `not_a_shape`).
    """

    markers: Mapping[Key, tuple[Outline, float, float]] = field(default_factory=dict)
    frame_id: str = ''
    stamp_ns: int = 0
    dropped: Mapping[str, int] = field(default_factory=dict)

    def with_message(self, message: Any, now_ns: int, plane: str, radius_stddev: float, place: Place = stay) -> MarkerTable:
        """Return the table after a MarkerArray.

        now_ns: start of the lifetime of an unstamped marker; 0 if unknown, and the marker does not expire. radius_stddev: [m].

        The radius of a sphere is half its largest scale, that of a cylinder half the larger of scale.x and scale.y; their
        orientation is not used. A cylinder stands on the plane, with the height scale.z; the height of a sphere, and of any
        marker without an extent along the normal, is not known. A cube is the convex hull of its corners, with the radius 0. A
        marker with a number that is not finite is dropped, and the marker that it would replace stays. A marker of another type
        replaces an obstacle, but is none; both are counted. Raises MessageError, and then nothing is changed, for an unknown
        action, a negative scale or lifetime, a cube without an extent in the plane, a coordinate beyond MAX_COORDINATE, two
        frames, or more markers than MAX_ROWS.
        """
        held = self._find_existing(now_ns)
        frame_id, newest_ns, dropped = self.frame_id, 0, Counter[str]()
        for i, marker in enumerate(message.markers):
            name, key = f'markers[{i}]', (str(marker.ns), int(marker.id))
            stamp_ns = decode_stamp(marker.header, f'{name}.header.stamp')
            newest_ns = max(newest_ns, stamp_ns)
            if marker.action not in (ADD, DELETE, DELETE_ALL):
                raise MessageError(f'{name}.action', 'ADD (0), DELETE (2) or DELETEALL (3)', marker.action)
            reason = ''
            if marker.action == ADD and marker.type not in (BOX, SPHERE, CYLINDER):
                reason = 'not_a_shape'
            elif marker.action == ADD and not _is_finite(marker.pose, marker.scale, is_turned=marker.type == BOX):
                reason = 'not_finite'
            if reason:
                dropped[reason] += 1
            if marker.action == DELETE_ALL:
                held = {other: kept for other, kept in held.items() if key[0] not in ('', other[0])}
            elif marker.action == DELETE or reason == 'not_a_shape':
                held.pop(key, None)
            elif not reason:
                given, transform = place(marker.header)
                if held and given != frame_id:
                    raise MessageError(f'{name}.header.frame_id', f"'{frame_id}', as the other markers", f"'{given}'")
                frame_id = given
                outline = _outline_marker(marker, name, plane, transform)
                start_ns, lifetime_ns = stamp_ns or now_ns, int(marker.lifetime.sec) * NANOSECONDS + int(marker.lifetime.nanosec)
                if lifetime_ns < 0:
                    raise MessageError(f'{name}.lifetime', 'at least 0 s (0: no end)', f'{lifetime_ns / NANOSECONDS:g} s')
                held[key] = outline, radius_stddev, start_ns + lifetime_ns if lifetime_ns and start_ns else math.inf
        if len(held) > MAX_ROWS:
            raise MessageError('markers', f'at most {MAX_ROWS} obstacles held at a time', len(held))
        return MarkerTable(MappingProxyType(held), frame_id, newest_ns, MappingProxyType(dropped))

    def obstacles(self, now_ns: int) -> Obstacles:
        """Return the obstacles that exist at a time [ns]; the id of an obstacle is ns/id."""
        held = self._find_existing(now_ns)
        names = [encode_name(key[0], str(key[1])) for key in held]
        return _collect(names, [outline for outline, _, _ in held.values()], [stddev for _, stddev, _ in held.values()])

    def find_unchanged_interval(self, now_ns: int) -> tuple[float, float]:
        """Return the interval [start, end) [ns] about a time within which no marker expires."""
        ends = [expiry_ns for _, _, expiry_ns in self.markers.values()]
        earlier, later = (end for end in ends if end <= now_ns), (end for end in ends if end > now_ns)
        return max(earlier, default=-math.inf), min(later, default=math.inf)

    def _find_existing(self, now_ns: int) -> dict[Key, tuple[Outline, float, float]]:
        return {key: marker for key, marker in self.markers.items() if now_ns < marker[2]}


def _outline_marker(marker: Any, name: str, plane: str, transform: Transform) -> Outline:
    position, size = transform.apply(_read(marker.pose.position)), _read(marker.scale)
    check_coordinates(f'{name}.pose.position', position.tolist())
    _check_sizes(f'{name}.scale', size)
    if marker.type == BOX:
        rotation = transform.rotation @ compute_rotation(marker.pose.orientation)
        return _outline_box(Transform(rotation, position), size, plane, f'{name}.scale')
    centre, height = project(position, plane)
    if marker.type == SPHERE:
        return Outline(centre, POINT, float(max(size)) / 2.0, UNKNOWN_HEIGHTS)
    return Outline(centre, POINT, float(max(size[:2])) / 2.0, make_heights(height, size[2]))


@dataclass(frozen=True)
class CollisionObject:
    """The primitives of an object: kind, dimensions [m] and pose of each relative to the pose of the object."""

    pose: Transform
    primitives: tuple[tuple[int, tuple[float, ...], Transform], ...]


@dataclass(frozen=True)
class CollisionTable:
    """The present collision objects by id.

    frame_id: of all objects; stamp_ns: of the last message; dropped: parts of it that are no obstacles (`not_a_shape`).
    """

    objects: Mapping[str, CollisionObject] = field(default_factory=dict)
    frame_id: str = ''
    stamp_ns: int = 0
    dropped: Mapping[str, int] = field(default_factory=dict)

    def with_message(self, message: Any, place: Place = stay) -> CollisionTable:
        """Return the table after a CollisionObject.

        ADD replaces an object, APPEND adds primitives to it, MOVE changes its pose, REMOVE removes it, or all if the id is empty.
        Boxes, spheres and cylinders are obstacles; other primitives, meshes and planes are counted. Raises MessageError, and then
        nothing is changed, for a wrong operation, number of dimensions or poses, size or coordinate, or another frame.
        """
        stamp_ns, name = decode_stamp(message.header), str(message.id)
        frame_id, transform = place(message.header)
        operation = message.operation[0] if isinstance(message.operation, bytes) else int(message.operation)
        held = dict(self.objects)
        if operation == REMOVE:
            held = {other: kept for other, kept in held.items() if name not in ('', other)}
            return CollisionTable(MappingProxyType(held), self.frame_id if held else frame_id, stamp_ns)
        if operation not in (ADD, APPEND, MOVE):
            raise MessageError('operation', 'ADD (0), REMOVE (1), APPEND (2) or MOVE (3)', operation)
        if held and frame_id != self.frame_id:
            raise MessageError('header.frame_id', f"'{self.frame_id}', as the other objects", f"'{frame_id}'")
        pose, dropped = transform.compose(_read_pose('pose', message.pose)), Counter[str]()
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
            encode_name(name, str(number)): _outline_primitive(kind, size, each.pose.compose(pose), plane)
            for name, each in self.objects.items()
            for number, (kind, size, pose) in enumerate(each.primitives)
        }
        return _collect(outlines, outlines.values(), radius_stddev)


def _read_primitives(message: Any, dropped: Counter[str]) -> tuple[tuple[int, tuple[float, ...], Transform], ...]:
    if len(message.primitive_poses) != len(message.primitives):
        raise MessageError('primitive_poses', f'{len(message.primitives)}, one for each primitive', len(message.primitive_poses))
    dropped['not_a_shape'] += len(message.meshes) + len(message.planes)
    found = []
    for number, (primitive, pose) in enumerate(zip(message.primitives, message.primitive_poses, strict=True)):
        kind, name = int(primitive.type), f'primitives[{number}].dimensions'
        if kind not in DIMENSIONS:
            dropped['not_a_shape'] += 1
            continue
        size = tuple(float(length) for length in primitive.dimensions)
        if len(size) != DIMENSIONS[kind]:
            raise MessageError(name, f'{DIMENSIONS[kind]} numbers for a primitive of type {kind}', len(size))
        _check_sizes(name, size, ('[0]', '[1]', '[2]'))
        if not any(size):
            raise MessageError(name, 'a size > 0 m', '0')
        found.append((kind, size, _read_pose(f'primitive_poses[{number}]', pose)))
    return tuple(found)


def _outline_primitive(kind: int, size: tuple[float, ...], pose: Transform, plane: str) -> Outline:
    """Return a primitive in the plane: a sphere is a circle of unknown height, a cylinder all within its radius of its axis."""
    if kind == SPHERE:
        return Outline(project(pose.translation, plane)[0], POINT, size[0], UNKNOWN_HEIGHTS)
    if kind == CYLINDER:
        upright = float(project(pose.rotation[:, 2], plane)[1])
        ends = pose.translation + np.outer([0.5, -0.5], size[0] * pose.rotation[:, 2])
        extent = size[0] * abs(upright) + 2.0 * size[1] * math.sqrt(max(1.0 - upright**2, 0.0))
        heights = make_heights(project(pose.translation, plane)[1], extent)
        return Outline(*make_hull_polygon(project(ends, plane)[0]), size[1], heights)
    return _outline_box(pose, size, plane, 'primitives')


def decode_detections(message: Any, plane: str, radius_stddev: float, place: Place = stay) -> DecodedCloud:
    """Decode the boxes of a Detection3DArray, the whole scene; the name of one is its id, or its row if it has none.

    A detection with a number that is not finite is dropped and counted; of several with one id the last is used. Raises
    MessageError for a negative size, a box without an extent in the plane, a coordinate beyond MAX_COORDINATE, another frame than
    that of the array, or too many detections.
    """
    stamp_ns, given = decode_stamp(message.header), decode_frame(message.header)
    frame_id, transform = place(message.header)
    if len(message.detections) > MAX_ROWS:
        raise MessageError('detections', f'at most {MAX_ROWS} obstacles', len(message.detections))
    outlines: dict[str, Outline] = {}
    dropped = Counter[str]()
    for row, each in enumerate(message.detections):
        label, own_frame = f'detections[{row}]', decode_frame(each.header)
        if own_frame not in ('', given):
            raise MessageError(f'{label}.header.frame_id', f"'{given}', as the array", f"'{own_frame}'")
        centre, size = each.bbox.center, _read(each.bbox.size)
        if not _is_finite(centre, each.bbox.size, is_turned=True):
            dropped['not_finite'] += 1
            continue
        _check_sizes(f'{label}.bbox.size', size)
        name, pose = encode_name(str(each.id) or str(row)), transform.compose(_read_pose(f'{label}.bbox.center', centre))
        dropped['duplicate_id'] += outlines.pop(name, None) is not None
        outlines[name] = _outline_box(pose, size, plane, f'{label}.bbox.size')
    obstacles = _collect(outlines, outlines.values(), radius_stddev)
    return DecodedCloud(obstacles, stamp_ns, frame_id, dict(+dropped))


def encode_name(*parts: str) -> str:
    """Return the parts of a name joined by '/', without ';', which separates the labels of candidates."""
    return '/'.join(part.replace('%', '%25').replace(';', '%3B') for part in parts)


def _read(vector: Any, axes: str = 'xyz') -> list[float]:
    return [getattr(vector, axis) for axis in axes]


def _is_finite(pose: Any, size: Any, *, is_turned: bool) -> bool:
    numbers = [*_read(pose.position), *_read(size), *(_read(pose.orientation, 'xyzw') if is_turned else ())]
    return all(map(math.isfinite, numbers))


def _read_pose(name: str, pose: Any) -> Transform:
    check_coordinates(f'{name}.position', _read(pose.position))
    check_coordinates(f'{name}.orientation', _read(pose.orientation, 'xyzw'))
    return Transform(compute_rotation(pose.orientation), np.array(_read(pose.position), dtype=float))


def _check_sizes(name: str, lengths: Iterable[float], parts: Iterable[str] = ('.x', '.y', '.z')) -> None:
    for part, length in zip(parts, lengths, strict=False):
        if not 0.0 <= length <= MAX_COORDINATE:
            raise MessageError(f'{name}{part}', f'a size in [0, {MAX_COORDINATE:g}] m', f'{length:g}')


def _outline_box(pose: Transform, size: Iterable[float], plane: str, name: str) -> Outline:
    centre, polygon, heights = project_box(pose.translation, [*size], pose.rotation, plane)
    if len(polygon) == 1:
        given = ' x '.join(f'{length:g}' for length in size)
        raise MessageError(name, 'a size > 0 m along an axis of the plane', f'{given} m')
    return Outline(centre, polygon, 0.0, heights)


def _collect(names: Iterable[str], outlines: Iterable[Outline], radius_stddev: list[float] | float) -> Obstacles:
    rows = [*outlines]
    if not rows:
        return make_obstacles()
    centres, polygons, radii, heights = zip(*rows, strict=True)
    return make_obstacles(centres, radii, radius_stddev, tuple(names), polygons=polygons, heights=heights)
