"""Decoding of a visualization_msgs/MarkerArray: a table of markers, updated as RViz updates its own.

A marker is identified by (ns, id). ADD inserts or replaces it, DELETE removes it, DELETEALL removes the markers of its ns, or all
of them if ns is empty. A marker with a lifetime expires when that has passed since its stamp.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Any

import numpy as np

from foc_ros.core.errors import MessageError
from foc_ros.core.types import NANOSECONDS, UNKNOWN_HEIGHTS, Array, Obstacles, make_obstacles

from .decode_objects import encode_name
from .decode_point_cloud import MAX_ROWS
from .decode_poses import MAX_COORDINATE, check_coordinate, decode_frame, decode_stamp
from .plane import compute_rotation, make_heights, project, project_box

ADD, DELETE, DELETE_ALL = 0, 2, 3
CUBE, SPHERE, CYLINDER = 1, 2, 3
POINT = np.zeros((1, 2))
"""The polygon of a circle."""
Key = tuple[str, int]


@dataclass(frozen=True)
class MarkerObstacle:
    """A rounded polygon in the task plane [m], with its lowest and highest point, heights (2,), along the normal of the plane.

    expires_ns: the end of its lifetime, None if it does not expire.
    """

    centre: Array
    polygon: Array
    radius: float
    radius_stddev: float
    heights: Array
    expires_ns: int | None

    def exists(self, now_ns: int) -> bool:
        """Whether the marker has not expired at a time [ns]."""
        return self.expires_ns is None or now_ns < self.expires_ns


@dataclass(frozen=True)
class MarkerTable:
    """The present markers; immutable: an update returns a new table.

    frame_id: of all markers; stamp_ns: newest stamp of the last message, 0 if it had none; dropped: markers of the last message
    that are no obstacles, by reason (`not_finite`, `not_a_shape`).
    """

    markers: Mapping[Key, MarkerObstacle] = field(default_factory=dict)
    frame_id: str = ''
    stamp_ns: int = 0
    dropped: Mapping[str, int] = field(default_factory=dict)

    def with_message(self, message: Any, now_ns: int, plane: str, radius_stddev: float) -> MarkerTable:
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
            reason = _find_reason_to_drop(marker) if marker.action == ADD else None
            if reason is not None:
                dropped[reason] += 1
            if marker.action == DELETE_ALL:
                held = {other: kept for other, kept in held.items() if key[0] not in ('', other[0])}
            elif marker.action == DELETE or reason == 'not_a_shape':
                held.pop(key, None)
            elif reason is None:
                given = decode_frame(marker.header)
                if held and given != frame_id:
                    raise MessageError(f'{name}.header.frame_id', f"'{frame_id}', as the other markers", f"'{given}'")
                frame_id = given
                held[key] = _decode_marker(marker, name, stamp_ns or now_ns, plane, radius_stddev)
        if len(held) > MAX_ROWS:
            raise MessageError('markers', f'at most {MAX_ROWS} obstacles held at a time', len(held))
        return MarkerTable(MappingProxyType(held), frame_id, newest_ns, MappingProxyType(dropped))

    def obstacles(self, now_ns: int) -> Obstacles:
        """Return the obstacles that exist at a time [ns]; the id of an obstacle is ns/id."""
        held = self._find_existing(now_ns)
        return make_obstacles(
            [marker.centre for marker in held.values()],
            [marker.radius for marker in held.values()],
            [marker.radius_stddev for marker in held.values()] or 0.0,
            tuple(encode_name(key[0], str(key[1])) for key in held),
            polygons=[marker.polygon for marker in held.values()],
            heights=np.array([marker.heights for marker in held.values()]).reshape(-1, 2),
        )

    def find_unchanged_interval(self, now_ns: int) -> tuple[float, float]:
        """Return the interval [start, end) [ns] about a time within which no marker expires."""
        ends = [marker.expires_ns for marker in self.markers.values() if marker.expires_ns is not None]
        earlier, later = (end for end in ends if end <= now_ns), (end for end in ends if end > now_ns)
        return max(earlier, default=-math.inf), min(later, default=math.inf)

    def _find_existing(self, now_ns: int) -> dict[Key, MarkerObstacle]:
        return {key: marker for key, marker in self.markers.items() if marker.exists(now_ns)}


def _find_reason_to_drop(marker: Any) -> str | None:
    if marker.type not in (CUBE, SPHERE, CYLINDER):
        return 'not_a_shape'
    position, scale = marker.pose.position, marker.scale
    numbers = [position.x, position.y, position.z, scale.x, scale.y, scale.z]
    if marker.type == CUBE:
        turned = marker.pose.orientation
        numbers += [turned.x, turned.y, turned.z, turned.w]
    return None if all(math.isfinite(number) for number in numbers) else 'not_finite'


def _decode_marker(marker: Any, name: str, start_ns: int, plane: str, radius_stddev: float) -> MarkerObstacle:
    position, scale = marker.pose.position, marker.scale
    for axis in 'xyz':
        check_coordinate(f'{name}.pose.position.{axis}', getattr(position, axis))
        if not 0.0 <= getattr(scale, axis) <= MAX_COORDINATE:
            raise MessageError(f'{name}.scale.{axis}', f'a size in [0, {MAX_COORDINATE:g}] m', f'{getattr(scale, axis):g}')
    lifetime_ns = int(marker.lifetime.sec) * NANOSECONDS + int(marker.lifetime.nanosec)
    if lifetime_ns < 0:
        raise MessageError(f'{name}.lifetime', 'at least 0 s (0: no end)', f'{lifetime_ns / NANOSECONDS:g} s')
    expires_ns = start_ns + lifetime_ns if lifetime_ns and start_ns else None
    place, size = (position.x, position.y, position.z), (scale.x, scale.y, scale.z)
    if marker.type == CUBE:
        centre, polygon, heights = project_box(place, size, compute_rotation(marker.pose.orientation), plane)
        if len(polygon) == 1:
            raise MessageError(f'{name}.scale', 'a size > 0 m along an axis of the plane', '{:g} x {:g} x {:g} m'.format(*size))
        return MarkerObstacle(centre, polygon, 0.0, radius_stddev, heights, expires_ns)
    centre, height = project(place, plane)
    if marker.type == SPHERE:
        return MarkerObstacle(centre, POINT, float(max(size)) / 2.0, radius_stddev, UNKNOWN_HEIGHTS, expires_ns)
    heights = make_heights(height, scale.z)
    return MarkerObstacle(centre, POINT, float(max(size[:2])) / 2.0, radius_stddev, heights, expires_ns)
