"""Obstacles from visualization_msgs/MarkerArray: a table of markers, kept as RViz keeps it.

A marker is identified by (ns, id). ADD puts it in or replaces it, DELETE takes it out, DELETEALL takes out those of its ns, or
all where ns is empty; one with a lifetime is gone when that is over, counted from its stamp.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Any

from foc_ros.core.errors import MessageError
from foc_ros.core.types import NANOSECONDS, Obstacles, make_obstacles

from .inputs import MAX_COORDINATE, check_coordinate, stamp_of
from .obstacle_cloud import MAX_ROWS
from .plane import project

ADD, DELETE, DELETE_ALL = 0, 2, 3
SPHERE, CYLINDER = 2, 3
Key = tuple[str, int]


@dataclass(frozen=True)
class HeldMarker:
    """A circle in the task plane [m]; expires_ns: when its lifetime ends, None where it never does."""

    centre: tuple[float, float]
    radius: float
    radius_stddev: float
    expires_ns: int | None


@dataclass(frozen=True)
class MarkerScene:
    """The markers held now; a value: an update returns another one.

    frame_id: of all of them; stamp_ns: the newest stamp of the last message, 0 where it had none; dropped: what the last message
    had that is no obstacle, by reason (`not_finite`, `not_a_circle`).
    """

    markers: Mapping[Key, HeldMarker] = field(default_factory=lambda: MappingProxyType({}))
    frame_id: str = ''
    stamp_ns: int = 0
    dropped: Mapping[str, int] = field(default_factory=lambda: MappingProxyType({}))

    def updated(self, message: Any, now_ns: int, plane: str, radius_stddev: float) -> MarkerScene:
        """Return the table after a MarkerArray.

        now_ns: when the life of an unstamped marker begins, 0 where unknown: then it does not end. radius_stddev: of radii [m].

        A sphere's radius is half its largest scale, a cylinder's half the larger of scale.x and scale.y; the orientation is not
        used. A marker with a number that is not finite is left out, and one it would replace stays; a marker of another type
        replaces an obstacle, but is none. Both are counted. Raises MessageError, and then nothing is changed, for an unknown
        action, a negative scale or lifetime, a coordinate beyond MAX_COORDINATE, two frames, or more markers than MAX_ROWS.
        """
        held = {key: marker for key, marker in self.markers.items() if _alive(marker, now_ns)}
        frame_id, stamps, dropped = self.frame_id, [0], Counter[str]()
        for i, marker in enumerate(message.markers):
            name, key = f'markers[{i}]', (str(marker.ns), int(marker.id))
            stamps.append(stamp_of(marker.header, f'{name}.header.stamp'))
            reason = _reason_to_leave_out(marker) if _action(marker, name) == ADD else None
            if reason is not None:
                dropped[reason] += 1
            if marker.action == DELETE_ALL:
                held = {other: kept for other, kept in held.items() if key[0] not in ('', other[0])}
            elif marker.action == DELETE or reason == 'not_a_circle':
                held.pop(key, None)
            elif reason is None:
                frame_id = _same_frame(marker, name, frame_id if held else None)
                held[key] = _circle(marker, name, stamps[-1] or now_ns, plane, radius_stddev)
        if len(held) > MAX_ROWS:
            raise MessageError('markers', f'at most {MAX_ROWS} obstacles held at a time', len(held))
        return MarkerScene(MappingProxyType(held), frame_id, max(stamps), MappingProxyType(dict(dropped)))

    def obstacles(self, now_ns: int) -> Obstacles:
        """Return those that live at a time [ns]; an obstacle's id is ns/id."""
        held = {key: marker for key, marker in self.markers.items() if _alive(marker, now_ns)}
        return make_obstacles(
            [marker.centre for marker in held.values()],
            [marker.radius for marker in held.values()],
            [marker.radius_stddev for marker in held.values()] or 0.0,
            tuple(_identity(key) for key in held),
        )

    def unchanged(self, now_ns: int) -> tuple[float, float]:
        """Return from when on and until when [ns] the markers that live at a time are those that live."""
        ends = [marker.expires_ns for marker in self.markers.values() if marker.expires_ns is not None]
        earlier, later = (end for end in ends if end <= now_ns), (end for end in ends if end > now_ns)
        return max(earlier, default=-math.inf), min(later, default=math.inf)


def _alive(marker: HeldMarker, now_ns: int) -> bool:
    return marker.expires_ns is None or now_ns < marker.expires_ns


def _identity(key: Key) -> str:
    """Labels of candidates are joined by ';', so no identity may hold one."""
    return f'{key[0].replace("%", "%25").replace(";", "%3B")}/{key[1]}'


def _action(marker: Any, name: str) -> int:
    if marker.action not in (ADD, DELETE, DELETE_ALL):
        raise MessageError(f'{name}.action', 'ADD (0), DELETE (2) or DELETEALL (3)', marker.action)
    return int(marker.action)


def _reason_to_leave_out(marker: Any) -> str | None:
    if marker.type not in (SPHERE, CYLINDER):
        return 'not_a_circle'
    position, scale = marker.pose.position, marker.scale
    numbers = (position.x, position.y, position.z, scale.x, scale.y, scale.z)
    return None if all(math.isfinite(number) for number in numbers) else 'not_finite'


def _same_frame(marker: Any, name: str, frame_id: str | None) -> str:
    given = str(marker.header.frame_id)
    if frame_id is not None and given != frame_id:
        raise MessageError(f'{name}.header.frame_id', f"'{frame_id}', as the other markers", f"'{given}'")
    return given


def _circle(marker: Any, name: str, born_ns: int, plane: str, radius_stddev: float) -> HeldMarker:
    position, scale = marker.pose.position, marker.scale
    for axis in 'xyz':
        check_coordinate(f'{name}.pose.position.{axis}', getattr(position, axis))
        if not 0.0 <= getattr(scale, axis) <= MAX_COORDINATE:
            raise MessageError(f'{name}.scale.{axis}', f'a size in [0, {MAX_COORDINATE:g}] m', f'{getattr(scale, axis):g}')
    lifetime_ns = int(marker.lifetime.sec) * NANOSECONDS + int(marker.lifetime.nanosec)
    if lifetime_ns < 0:
        raise MessageError(f'{name}.lifetime', 'at least 0 s (0: for ever)', f'{lifetime_ns / NANOSECONDS:g} s')
    centre, _ = project((position.x, position.y, position.z), plane)
    diameter = max(scale.x, scale.y, scale.z) if marker.type == SPHERE else max(scale.x, scale.y)
    expires_ns = born_ns + lifetime_ns if lifetime_ns and born_ns else None
    return HeldMarker((float(centre[0]), float(centre[1])), float(diameter) / 2.0, radius_stddev, expires_ns)
