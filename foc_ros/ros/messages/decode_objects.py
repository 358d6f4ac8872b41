# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Decoding of markers (visualization_msgs/MarkerArray), of a planning scene (moveit_msgs/CollisionObject) and of detections.

Each is a set of solids: boxes, spheres and cylinders, which become rounded polygons in the task plane, with their heights. A
message is read by the names of its fields, so the packages of collision objects and of vision_msgs need not be installed.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from itertools import product
from typing import Any, NamedTuple

import numpy as np

from foc_ros.core.errors import MessageError
from foc_ros.core.obstacle_table import UNKNOWN_HEIGHTS, Obstacles, make_obstacles
from foc_ros.core.obstacles.polygons import FLAT, make_hull_polygon
from foc_ros.core.types import NANOSECONDS, Array

from .decode_point_cloud import MAX_ROWS
from .decode_poses import MAX_COORDINATE, FrameLookup, check_coordinates, decode_frame, decode_point, decode_stamp, keep_frame
from .plane import NO_TRANSFORM, Transform, compute_rotation, lift, make_heights, project

ADD, DELETE, DELETE_ALL = 0, 2, 3
REMOVE, APPEND, MOVE = 1, 2, 3
"""Operations on a collision object besides ADD."""
BOX, SPHERE, CYLINDER = 1, 2, 3
"""Types that become obstacles, of markers and of primitives alike."""
DIMENSIONS = {BOX: 3, SPHERE: 1, CYLINDER: 2}
POINT = np.zeros((1, 2))
CORNERS = np.array([*product((-0.5, 0.5), repeat=3)])
NORMALS = {plane: lift(np.zeros(2), 1.0, plane) for plane in ('xy', 'xz', 'yz')}
UPRIGHT = {plane: np.outer(normal, [0.0, 0.0, 1.0]) for plane, normal in NORMALS.items()}
"""Matrices whose last column, the axis of a cylinder, is the normal of each plane."""
Solid = tuple[int, tuple[float, ...], Transform]
"""Type, size (lengths of a box, radius of a sphere, height and radius of a cylinder [m]) and pose."""


class Outline(NamedTuple):
    """An obstacle: centre (2,), polygon (v, 2) and radius in the task plane, and its lowest and highest point (2,) [m]."""

    centre: Array
    polygon: Array
    radius: float
    heights: Array


def outline(solid: Solid, plane: str, field: str) -> Outline:
    """Return a solid in the plane: the hull of a box, the circle of a sphere, all within the radius of a cylinder of its axis.

    Raises MessageError, with the name of a field, for a box without an extent in the plane.
    """
    kind, size, pose = solid
    centre, height = project(pose.translation, plane)
    if kind == SPHERE:
        return Outline(centre, POINT, size[0], UNKNOWN_HEIGHTS)
    if kind == CYLINDER:
        (length, radius), axis = size, pose.rotation[:, 2]
        upright = float(axis @ NORMALS[plane])
        slope = math.sqrt(max(1.0 - upright**2, 0.0))
        polygon = np.outer([0.5, -0.5], length * project(axis, plane)[0]) if length * slope >= FLAT else POINT
        return Outline(centre, polygon, radius, make_heights(height, length * abs(upright) + 2.0 * radius * slope))
    places, heights = project(pose.translation + CORNERS * size @ pose.rotation.T, plane)
    middle, polygon = make_hull_polygon(places)
    if len(polygon) == 1:
        given = ' x '.join(f'{length:g}' for length in size)
        raise MessageError(field, 'a size > 0 m along an axis of the plane', f'{given} m')
    return Outline(middle, polygon, 0.0, make_heights((heights.min() + heights.max()) / 2.0, np.ptp(heights)))


class Present(NamedTuple):
    """A marker or a collision object: its obstacles by name, the end of its lifetime, and its solids relative to its pose."""

    outlines: dict[str, Outline]
    end_ns: float = math.inf
    solids: tuple[Solid, ...] = ()


@dataclass(frozen=True)
class ObjectTable:
    """The present markers, updated as RViz updates its own, or the present collision objects; an update returns a new table.

    held: markers by (ns, id), or objects by id; stamp_ns: newest of the last message; dropped: its parts that are no obstacles.
    """

    held: Mapping[Any, Present] = field(default_factory=dict)
    frame_id: str = ''
    stamp_ns: int = 0
    dropped: Mapping[str, int] = field(default_factory=dict)

    def with_markers(self, message: Any, now_ns: int, plane: str, look_up: FrameLookup = keep_frame) -> ObjectTable:
        """Return the table after a MarkerArray; now_ns: start of the lifetime of an unstamped marker, 0 if unknown.

        ADD inserts or replaces a marker, DELETE removes it, DELETEALL removes those of its ns, or all of them if ns is empty. The
        radius of a sphere is half its largest scale, that of a cylinder, which stands on the plane, half the larger of scale.x
        and scale.y; the height of a sphere, and of any marker without an extent along the normal, is not known. A cube is the
        convex hull of its corners. A marker with a number that is not finite is dropped, and the marker that it would replace
        stays. A marker of another type replaces an obstacle, but is none; both are counted. Raises MessageError, and then nothing
        is changed, for an unknown action, a negative scale or lifetime, a cube without an extent in the plane, a coordinate
        beyond MAX_COORDINATE, two frames, or more markers than MAX_ROWS.
        """
        held = self._find_existing(now_ns)
        frame_id, newest_ns, dropped = self.frame_id, 0, Counter[str]()
        for i, marker in enumerate(message.markers):
            name, key = f'markers[{i}]', (str(marker.ns), int(marker.id))
            stamp_ns = decode_stamp(marker.header, f'{name}.header.stamp')
            newest_ns = max(newest_ns, stamp_ns)
            if marker.action == DELETE_ALL:
                held = {other: kept for other, kept in held.items() if key[0] not in ('', other[0])}
            elif marker.action == DELETE:
                held.pop(key, None)
            elif marker.action != ADD:
                raise MessageError(f'{name}.action', 'ADD (0), DELETE (2) or DELETEALL (3)', marker.action)
            elif marker.type not in DIMENSIONS:
                held.pop(key, None)
                dropped['not_a_shape'] += 1
            elif not _is_finite(marker.pose, marker.scale, is_turned=marker.type == BOX):
                dropped['not_finite'] += 1
            else:
                given, transform = look_up(marker.header)
                if held and given != frame_id:
                    raise MessageError(f'{name}.header.frame_id', f"'{frame_id}', as the other markers", f"'{given}'")
                frame_id = given
                found = outline(_read_marker(marker, name, plane, transform), plane, f'{name}.scale')
                start_ns, lifetime_ns = stamp_ns or now_ns, int(marker.lifetime.sec) * NANOSECONDS + int(marker.lifetime.nanosec)
                if lifetime_ns < 0:
                    raise MessageError(f'{name}.lifetime', 'at least 0 s (0: no end)', f'{lifetime_ns / NANOSECONDS:g} s')
                end_ns = start_ns + lifetime_ns if lifetime_ns and start_ns else math.inf
                held[key] = Present({encode_name(*key): found}, end_ns)
        if len(held) > MAX_ROWS:
            raise MessageError('markers', f'at most {MAX_ROWS} obstacles held at a time', len(held))
        return ObjectTable(held, frame_id, newest_ns, dropped)

    def with_collision_object(self, message: Any, plane: str, look_up: FrameLookup = keep_frame) -> ObjectTable:
        """Return the table after a CollisionObject; the name of an obstacle is the id of its object and its number in it.

        ADD replaces an object, APPEND adds primitives to it, MOVE changes its pose, REMOVE removes it, or all if the id is empty.
        Boxes, spheres and cylinders are obstacles; other parts are counted. Raises MessageError, and then nothing is changed, for
        a wrong operation, number of dimensions or poses, size or coordinate, or another frame.
        """
        stamp_ns, name = decode_stamp(message.header), str(message.id)
        frame_id, transform = look_up(message.header)
        operation = message.operation[0] if isinstance(message.operation, bytes) else int(message.operation)
        held, dropped = dict(self.held), Counter[str]()
        if operation == REMOVE:
            held = {other: kept for other, kept in held.items() if name not in ('', other)}
            return ObjectTable(held, self.frame_id if held else frame_id, stamp_ns)
        if operation not in (ADD, APPEND, MOVE):
            raise MessageError('operation', 'ADD (0), REMOVE (1), APPEND (2) or MOVE (3)', operation)
        if held and frame_id != self.frame_id:
            raise MessageError('header.frame_id', f"'{self.frame_id}', as the other objects", f"'{frame_id}'")
        if operation == MOVE and name not in held:
            raise MessageError('id', 'an object that was added before it is moved', repr(name))
        pose = _read_pose('pose', message.pose, transform)
        solids = held[name].solids if operation != ADD and name in held else ()
        if operation != MOVE:
            solids = (*solids, *_read_primitives(message, dropped))
        parts = {encode_name(name, i): (kind, size, pose.compose(own)) for i, (kind, size, own) in enumerate(solids)}
        held[name] = Present({part: outline(solid, plane, 'primitives') for part, solid in parts.items()}, solids=solids)
        if (count := sum(len(each.solids) for each in held.values())) > MAX_ROWS:
            raise MessageError('primitives', f'at most {MAX_ROWS} obstacles held at a time', count)
        return ObjectTable(held, frame_id, stamp_ns, +dropped)

    def obstacles(self, now_ns: int, radius_stddev: float) -> Obstacles:
        """Return the obstacles that exist at a time [ns]."""
        outlines: dict[str, Outline] = {}
        for each in self._find_existing(now_ns).values():
            outlines |= each.outlines
        if not outlines:
            return make_obstacles()
        centres, polygons, radii, heights = zip(*outlines.values(), strict=True)
        return make_obstacles(centres, radii, radius_stddev, tuple(outlines), polygons=polygons, heights=heights)

    def count_expired(self, now_ns: int) -> int:
        """Return how many of the markers do not exist any more at a time [ns]."""
        return bisect_right(self._ends, now_ns)

    @cached_property
    def _ends(self) -> list[float]:
        return sorted(each.end_ns for each in self.held.values())

    def _find_existing(self, now_ns: int) -> dict[Any, Present]:
        return {key: each for key, each in self.held.items() if now_ns < each.end_ns}


def _read_marker(marker: Any, name: str, plane: str, transform: Transform) -> Solid:
    x, y, z = size = _read_sizes(f'{name}.scale', _read(marker.scale))
    if marker.type == BOX:
        return BOX, size, _read_pose(f'{name}.pose', marker.pose, transform)
    position = decode_point(marker.pose.position, f'{name}.pose.position', transform)
    size = (max(size) / 2.0,) if marker.type == SPHERE else (z, max(x, y) / 2.0)
    return marker.type, size, Transform(UPRIGHT[plane], position)


def _read_primitives(message: Any, dropped: Counter[str]) -> list[Solid]:
    """Return the primitives that become obstacles, and count the parts that do not."""
    if len(message.primitive_poses) != len(message.primitives):
        raise MessageError('primitive_poses', f'{len(message.primitives)}, one for each primitive', len(message.primitive_poses))
    dropped['not_a_shape'] += len(message.meshes) + len(message.planes)
    found = []
    for number, (primitive, pose) in enumerate(zip(message.primitives, message.primitive_poses, strict=True)):
        kind, name = int(primitive.type), f'primitives[{number}].dimensions'
        if kind not in DIMENSIONS:
            dropped['not_a_shape'] += 1
            continue
        if len(primitive.dimensions) != DIMENSIONS[kind]:
            wanted = f'{DIMENSIONS[kind]} numbers for a primitive of type {kind}'
            raise MessageError(name, wanted, len(primitive.dimensions))
        size = _read_sizes(name, primitive.dimensions, ('[0]', '[1]', '[2]'))
        if not any(size):
            raise MessageError(name, 'a size > 0 m', '0')
        found.append((kind, size, _read_pose(f'primitive_poses[{number}]', pose)))
    return found


def decode_detections(message: Any, plane: str, look_up: FrameLookup = keep_frame) -> ObjectTable:
    """Decode the boxes of a Detection3DArray, the whole scene, as one object; a box is named by its id, or its row without one.

    A detection with a number that is not finite is dropped and counted; of several with one id the last is used. Raises
    MessageError for a negative size, a box without an extent in the plane, a coordinate beyond MAX_COORDINATE, another frame than
    that of the array, or too many detections.
    """
    stamp_ns, given = decode_stamp(message.header), decode_frame(message.header)
    frame_id, transform = look_up(message.header)
    if len(message.detections) > MAX_ROWS:
        raise MessageError('detections', f'at most {MAX_ROWS} obstacles', len(message.detections))
    outlines: dict[str, Outline] = {}
    dropped = Counter[str]()
    for row, each in enumerate(message.detections):
        label, own_frame = f'detections[{row}]', decode_frame(each.header)
        if own_frame not in ('', given):
            raise MessageError(f'{label}.header.frame_id', f"'{given}', as the array", f"'{own_frame}'")
        if not _is_finite(each.bbox.center, each.bbox.size, is_turned=True):
            dropped['not_finite'] += 1
            continue
        size = _read_sizes(f'{label}.bbox.size', _read(each.bbox.size))
        box = BOX, size, _read_pose(f'{label}.bbox.center', each.bbox.center, transform)
        name = encode_name(each.id or row)
        dropped['duplicate_id'] += outlines.pop(name, None) is not None
        outlines[name] = outline(box, plane, f'{label}.bbox.size')
    return ObjectTable({'': Present(outlines)}, frame_id, stamp_ns, +dropped)


def encode_name(*parts: object) -> str:
    """Return the parts of a name joined by '/', without ';', which separates the labels of candidates."""
    return '/'.join(str(part).replace('%', '%25').replace(';', '%3B') for part in parts)


def _read(vector: Any) -> list[float]:
    return [vector.x, vector.y, vector.z]


def _is_finite(pose: Any, size: Any, *, is_turned: bool) -> bool:
    numbers = _read(pose.position) + _read(size)
    if is_turned:
        numbers += [*_read(pose.orientation), pose.orientation.w]
    return all(map(math.isfinite, numbers))


def _read_pose(name: str, pose: Any, transform: Transform = NO_TRANSFORM) -> Transform:
    check_coordinates(f'{name}.orientation', [*_read(pose.orientation), pose.orientation.w], unit='')
    position = decode_point(pose.position, f'{name}.position', transform)
    return Transform(transform.rotation @ compute_rotation(pose.orientation), position)


def _read_sizes(name: str, lengths: Iterable[float], parts: Iterable[str] = ('.x', '.y', '.z')) -> tuple[float, ...]:
    sizes = tuple(map(float, lengths))
    for part, length in zip(parts, sizes, strict=False):
        if not 0.0 <= length <= MAX_COORDINATE:
            raise MessageError(f'{name}{part}', f'a size in [0, {MAX_COORDINATE:g}] m', f'{length:g}')
    return sizes
