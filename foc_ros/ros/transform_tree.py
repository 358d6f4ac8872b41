"""Transforms of a recording, looked up as tf2 does, without ROS.

A frame has one parent. A transform between the stamps of two messages is interpolated: the translation linearly, the rotation
along the shortest arc.
"""

from __future__ import annotations

from bisect import bisect_right, insort
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation, Slerp

from foc_ros.core.errors import MessageError
from foc_ros.core.types import NANOSECONDS, Array

from .messages.decode_poses import decode_stamp
from .messages.transform_messages import Transform
from .transforms import TransformUnavailableError

KEPT_NS = 10 * NANOSECONDS
"""Time for which transforms are kept, that of tf2 [ns]; one that is older than that means that the recording starts again."""


class _Pose(NamedTuple):
    """The pose of a frame in its parent: stamp [ns], position (3,) [m], quaternion (4,), x, y, z, w."""

    stamp_ns: int
    position: Array
    quaternion: Array


class _Vector(NamedTuple):
    x: float
    y: float
    z: float


class _Quaternion(NamedTuple):
    x: float
    y: float
    z: float
    w: float


@dataclass
class _Frame:
    """A frame with its parent and its poses by stamp; a static one has one pose."""

    parent: str
    is_static: bool
    poses: list[_Pose] = field(default_factory=list)

    def add(self, pose: _Pose) -> None:
        """Keep a pose, and forget those that are too old."""
        if self.is_static or (self.poses and pose.stamp_ns < self.poses[-1].stamp_ns - KEPT_NS):
            self.poses.clear()
        insort(self.poses, pose, key=_read_stamp)
        del self.poses[: bisect_right(self.poses, self.poses[-1].stamp_ns - KEPT_NS, key=_read_stamp)]

    def find(self, name: str, stamp_ns: int) -> tuple[Rotation, Array]:
        """Return the pose in the parent at a stamp; raise TransformUnavailableError outside the known stamps."""
        place = bisect_right(self.poses, stamp_ns, key=_read_stamp)
        before, after = self.poses[max(place - 1, 0)], self.poses[min(place, len(self.poses) - 1)]
        if self.is_static or before.stamp_ns == stamp_ns:
            return Rotation.from_quat(before.quaternion), before.position
        if before is after:
            relation = 'before the oldest' if stamp_ns < after.stamp_ns else 'after the newest'
            distance = f'{abs(stamp_ns - after.stamp_ns) / NANOSECONDS:.3g} s'
            raise TransformUnavailableError(f'the stamp is {distance} {relation} transform from {name} to {self.parent}')
        share = (stamp_ns - before.stamp_ns) / (after.stamp_ns - before.stamp_ns)
        turn = Slerp([0.0, 1.0], Rotation.from_quat([before.quaternion, after.quaternion]))
        return turn(share), (1.0 - share) * before.position + share * after.position


def _read_stamp(pose: _Pose) -> int:
    return pose.stamp_ns


class TransformTree:
    """The frames of a recording; a `TransformSource`."""

    def __init__(self) -> None:
        self._frames: dict[str, _Frame] = {}

    def add(self, message: Any, *, is_static: bool) -> int:
        """Add the transforms of a tf2_msgs/TFMessage, and return how many are left out.

        These have a wrong stamp, a number that is not finite, no rotation, or one frame as both parent and child.
        """
        left_out = 0
        for each in message.transforms:
            position = np.array([getattr(each.transform.translation, axis) for axis in 'xyz'], dtype=float)
            quaternion = np.array([getattr(each.transform.rotation, axis) for axis in 'xyzw'], dtype=float)
            child, parent = str(each.child_frame_id).lstrip('/'), str(each.header.frame_id).lstrip('/')
            try:
                stamp_ns = decode_stamp(each.header)
            except MessageError:
                stamp_ns = -1
            if stamp_ns < 0 or not (np.isfinite([*position, *quaternion]).all() and quaternion.any()) or child == parent:
                left_out += 1
                continue
            frame = self._frames.get(child)
            if frame is None or (frame.parent, frame.is_static) != (parent, is_static):
                frame = self._frames[child] = _Frame(parent, is_static)
            frame.add(_Pose(stamp_ns, position, quaternion))
        return left_out

    def look_up(self, target: str, source: str, stamp_ns: int) -> Transform:
        """Return the transform from one frame to another at a stamp [ns], the newest one for a stamp of 0.

        Raises TransformUnavailableError.
        """
        up, down = self._list_ancestors(source), self._list_ancestors(target)
        common = next((name for name in up if name in down), None)
        if common is None:
            known = ', '.join(sorted({*self._frames, *(each.parent for each in self._frames.values())})) or 'none'
            raise TransformUnavailableError(f'{source} and {target} are not connected; known frames: {known}')
        chain, back = up[: up.index(common)], down[: down.index(common)]
        if not stamp_ns:
            moving = [
                frame.poses[-1].stamp_ns for frame in map(self._frames.get, (*chain, *back)) if frame and not frame.is_static
            ]
            stamp_ns = min(moving, default=0)
        rotation, position = self._compose(chain, stamp_ns)
        inverse, offset = self._compose(back, stamp_ns)
        inverse = inverse.inv()
        return Transform(
            _Quaternion(*(inverse * rotation).as_quat().tolist()),
            _Vector(*inverse.apply(position - offset).tolist()),
            stamp_ns,
        )

    def _list_ancestors(self, name: str) -> list[str]:
        """Return a frame and the frames above it, its parent first."""
        names = [name]
        while (frame := self._frames.get(names[-1])) is not None and frame.parent not in names:
            names.append(frame.parent)
        return names

    def _compose(self, chain: list[str], stamp_ns: int) -> tuple[Rotation, Array]:
        """Return the pose of the first frame of a chain in the parent of the last one."""
        rotation, position = Rotation.identity(), np.zeros(3)
        for name in chain:
            turn, shift = self._frames[name].find(name, stamp_ns)
            rotation, position = turn * rotation, turn.apply(position) + shift
        return rotation, position
