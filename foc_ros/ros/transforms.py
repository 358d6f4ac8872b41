# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Messages on their way into the working frame: one whose transform arrives later than itself is held until then.

A message is held until the transform for its stamp is known. After `frames.tolerance_s` the newest transform is taken instead, if
it is not farther from the stamp than that. Otherwise the message is passed on unchanged with the reason, and is refused because
of its frame. The messages of an input keep their order. Times are those of the steady clock in the node, and of the log in a
replay.
"""

from __future__ import annotations

from bisect import bisect_right, insort
from collections import defaultdict, deque
from collections.abc import Iterator
from dataclasses import dataclass, field
from operator import attrgetter
from typing import Any, Protocol

import numpy as np
from scipy.spatial.transform import Rotation, Slerp

from foc_ros.core.errors import MessageError
from foc_ros.core.types import NANOSECONDS
from foc_ros.io.topics import HAND, MARKERS

from .intake import Arrival, Intake
from .messages.decode_objects import ADD
from .messages.decode_poses import FrameLookup, check_hand_pose, decode_frame, decode_stamp, keep_frame
from .messages.plane import NO_TRANSFORM, Transform, compute_rotation

KEPT_NS = 10 * NANOSECONDS
"""Time for which transforms are kept, that of tf2 [ns]; one that is older than that means that the recording starts again."""


class TransformUnavailableError(Exception):
    """No transform between two frames is known, or none for the stamp."""


class TransformSource(Protocol):
    """What knows transforms: tf2 in the node, a recording in a replay."""

    def look_up(self, target: str, source: str, stamp_ns: int) -> Transform:
        """Return a transform at a stamp [ns], the newest one for a stamp of 0. Raises TransformUnavailableError."""


class Transforms:
    """Queues of messages, one for each input, until their transforms are known by a source; intake: that takes the messages."""

    def __init__(self, source: TransformSource | None, intake: Intake) -> None:
        self._source, self._intake = source, intake
        self._held: defaultdict[str, deque[Arrival]] = defaultdict(deque)

    @property
    def roles(self) -> list[str]:
        """The inputs of which messages are held, the hand last: it is predicted from the scene that waits with it."""
        return sorted((role for role, queue in self._held.items() if queue), key=lambda role: role == HAND)

    def add(self, role: str, arrival: Arrival) -> None:
        """Append a message of an input."""
        self._held[role].append(arrival)

    def release(self, role: str, now_s: float) -> Iterator[Arrival]:
        """Yield the messages of an input that need not be held any longer; each is to be taken before the next is asked for."""
        queue, pipeline = self._held[role], self._intake.pipeline
        while queue:
            arrival = queue[0]
            # at most 1,000 are held: 1 s of a hand at 1 kHz
            is_overdue = now_s - arrival.received_s >= pipeline.config.frames.tolerance_s or len(queue) > 1000
            try:
                look_up, is_inexact = self._find_lookup(role, arrival.message, is_overdue)
                arrival = arrival._replace(look_up=look_up, is_inexact=is_inexact)
            except TransformUnavailableError as error:
                if not is_overdue:
                    break
                arrival = arrival._replace(error=f'no transform to {pipeline.frame_id}: {error}')
            except Exception:  # noqa: S110  the message is not checked yet, and will be refused
                pass
            queue.popleft()
            yield arrival

    def _find_lookup(self, role: str, message: Any, is_overdue: bool) -> tuple[FrameLookup, bool]:
        """Return the transforms for the headers of a message, and whether the newest one was taken for one of them."""
        frame_id, tolerance_s = self._intake.pipeline.frame_id, self._intake.pipeline.config.frames.tolerance_s
        is_unneeded = role == HAND and self._intake.is_skipped(decode_stamp(message.header))
        if self._source is None or frame_id is None or is_unneeded:
            return keep_frame, False
        if role == HAND:
            check_hand_pose(message.pose)  # one without data does not wait for a transform
        # markers that delete others have no position and often no frame
        headers = [each.header for each in message.markers if each.action == ADD] if role == MARKERS else [message.header]
        found: dict[tuple[str, int], Transform] = {}
        is_inexact = False
        for given in dict.fromkeys(map(_identify, headers)):
            if given[0] == frame_id:
                continue
            try:
                found[given] = self._source.look_up(frame_id, *given)
            except TransformUnavailableError as reason:
                if not is_overdue:
                    raise
                found[given], is_inexact = self._source.look_up(frame_id, given[0], 0), True
                late_s = (given[1] - found[given].stamp_ns) / NANOSECONDS
                if abs(late_s) > tolerance_s:
                    far = f'the newest one is {abs(late_s):.3g} s {"older" if late_s > 0.0 else "newer"} than the message'
                    raise TransformUnavailableError(f'{reason}; {far} (frames.tolerance_s is {tolerance_s:g})') from None

        def look_up(header: Any) -> tuple[str, Transform]:
            transform = found.get(_identify(header))
            return keep_frame(header) if transform is None else (frame_id, transform)

        return look_up, is_inexact


def _identify(header: Any) -> tuple[str, int]:
    return decode_frame(header), decode_stamp(header)


_STAMP = attrgetter('stamp_ns')


@dataclass
class _Frame:
    """A frame with its parent and its poses in it, by their stamps; a static one has one pose."""

    parent: str
    is_static: bool
    poses: list[Transform] = field(default_factory=list)

    def add(self, pose: Transform) -> None:
        """Keep a pose, and forget those that are too old."""
        if self.is_static or (self.poses and pose.stamp_ns < self.poses[-1].stamp_ns - KEPT_NS):
            self.poses = []
        insort(self.poses, pose, key=_STAMP)
        del self.poses[: bisect_right(self.poses, self.poses[-1].stamp_ns - KEPT_NS, key=_STAMP)]

    def find(self, name: str, stamp_ns: int) -> Transform:
        """Return the pose at a stamp; raise TransformUnavailableError outside the known stamps."""
        after = bisect_right(self.poses, stamp_ns, key=_STAMP)
        if self.is_static or (after and self.poses[after - 1].stamp_ns == stamp_ns):
            return self.poses[after - 1]
        if not 0 < after < len(self.poses):
            nearest_ns = self.poses[min(after, len(self.poses) - 1)].stamp_ns
            relation = 'after the newest' if after else 'before the oldest'
            distance = f'{abs(stamp_ns - nearest_ns) / NANOSECONDS:.3g} s'
            raise TransformUnavailableError(f'the stamp is {distance} {relation} transform from {name} to {self.parent}')
        start, end = self.poses[after - 1 : after + 1]
        share = (stamp_ns - start.stamp_ns) / (end.stamp_ns - start.stamp_ns)
        turn = Slerp([0.0, 1.0], Rotation.from_matrix([start.rotation, end.rotation]))(share)
        return Transform(turn.as_matrix(), (1.0 - share) * start.translation + share * end.translation)


class TransformTree:
    """The frames of a recording, each with one parent, looked up as tf2 does, without ROS; a `TransformSource`."""

    def __init__(self) -> None:
        self._frames: dict[str, _Frame] = {}

    def add(self, message: Any, *, is_static: bool) -> int:
        """Add the transforms of a tf2_msgs/TFMessage, and return how many are left out, because they cannot be used."""
        left_out = 0
        for each in message.transforms:
            shift, turn = each.transform.translation, each.transform.rotation
            position, quaternion = np.array([shift.x, shift.y, shift.z], dtype=float), (turn.x, turn.y, turn.z, turn.w)
            child, parent = str(each.child_frame_id).lstrip('/'), decode_frame(each.header)
            try:
                stamp_ns = decode_stamp(each.header)
            except MessageError:
                stamp_ns = -1
            if stamp_ns < 0 or not np.isfinite([*position, *quaternion]).all() or not any(quaternion) or child == parent:
                left_out += 1
                continue
            frame = self._frames.get(child)
            if frame is None or (frame.parent, frame.is_static) != (parent, is_static):
                frame = self._frames[child] = _Frame(parent, is_static)
            frame.add(Transform(compute_rotation(turn), position, stamp_ns))
        return left_out

    def look_up(self, target: str, source: str, stamp_ns: int) -> Transform:
        """Return a transform as `TransformSource.look_up` says."""
        up, down = self._list_ancestors(source), self._list_ancestors(target)
        if (common := next((name for name in up if name in down), None)) is None:
            known = ', '.join(sorted({*self._frames, *(each.parent for each in self._frames.values())})) or 'none'
            raise TransformUnavailableError(f'{source} and {target} are not connected; known frames: {known}')
        chain, back = up[: up.index(common)], down[: down.index(common)]
        if not stamp_ns:
            frames = [self._frames[name] for name in (*chain, *back)]
            stamp_ns = min((frame.poses[-1].stamp_ns for frame in frames if not frame.is_static), default=0)
        pose = self._compose(back, stamp_ns).inverse().compose(self._compose(chain, stamp_ns))
        return pose._replace(stamp_ns=stamp_ns)

    def _list_ancestors(self, name: str) -> list[str]:
        names = [name]
        while (frame := self._frames.get(names[-1])) is not None and frame.parent not in names:
            names.append(frame.parent)
        return names

    def _compose(self, chain: list[str], stamp_ns: int) -> Transform:
        pose = NO_TRANSFORM
        for name in chain:
            pose = self._frames[name].find(name, stamp_ns).compose(pose)
        return pose
