"""Messages on their way into the working frame: one whose transform arrives later than itself is held until then.

A transform is usually published after the measurement that needs it. A message is therefore held until the transform for its
stamp is known. After `frames.tolerance_s` the newest transform is taken instead, if it is not farther from the stamp than that.
Otherwise the message is passed on unchanged with the reason, and is refused because of its frame. The messages of an input keep
their order. Node and replay share this: times are those of the steady clock in the node, and those of the log in a replay.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator
from functools import partial
from typing import Any, NamedTuple, Protocol

from foc_ros.core.config import Config
from foc_ros.core.types import NANOSECONDS
from foc_ros.io.topics import HAND

from .messages.decode_poses import check_hand_pose, decode_frame, decode_stamp
from .messages.transform_messages import Transform, transform_message

MOST_HELD = 1000
"""Largest number of messages of one input that are held: 1 s of a hand at 1 kHz."""


class TransformUnavailableError(Exception):
    """No transform between two frames is known, or none for the stamp."""


class TransformSource(Protocol):
    """What knows transforms: tf2 in the node, a recording in a replay."""

    def look_up(self, target: str, source: str, stamp_ns: int) -> Transform:
        """Return the transform from one frame to another at a stamp [ns], the newest one for a stamp of 0.

        Raises TransformUnavailableError.
        """


class Arrival(NamedTuple):
    """A message that can be taken.

    message: in the working frame, or unchanged; received_s: when it arrived [s]; error: why it could not be transformed, empty if
    it could or did not have to be; is_inexact: whether the newest transform was taken instead of that for its stamp.
    """

    message: Any
    received_s: float
    error: str = ''
    is_inexact: bool = False


class Transforms:
    """Queues of messages, one for each input.

    source: None if there is none; is_skipped: whether a hand pose of a stamp [ns] will be skipped, so that it needs no transform.
    """

    def __init__(self, source: TransformSource | None, is_skipped: Callable[[int], bool] = lambda _: False) -> None:
        self._source, self._is_skipped = source, is_skipped
        self._held: dict[str, deque[tuple[Any, float]]] = {}

    @property
    def roles(self) -> list[str]:
        """The inputs of which messages are held."""
        return [role for role, queue in self._held.items() if queue]

    def holds(self, role: str) -> bool:
        """Return whether messages of an input are held."""
        return bool(self._held.get(role))

    def add(self, role: str, message: Any, now_s: float) -> None:
        """Append a message of an input that arrives at a time [s]."""
        self._held.setdefault(role, deque()).append((message, now_s))

    def release(self, role: str, frame_id: str | None, config: Config, now_s: float) -> Iterator[Arrival]:
        """Yield the messages of an input that need not be held any longer at a time [s], in the order of their arrival.

        Each has to be taken before the next one is asked for: it decides whether the next one is skipped. frame_id: the working
        frame; while it is unknown, None, messages are not transformed.
        """
        queue = self._held.get(role, ())
        while queue:
            message, received_s = queue[0]
            is_overdue = now_s - received_s >= config.frames.tolerance_s or len(queue) > MOST_HELD
            try:
                transformed, is_inexact = self._transform(role, message, frame_id, config, is_overdue)
                arrival = Arrival(transformed, received_s, is_inexact=is_inexact)
            except TransformUnavailableError as error:
                if not is_overdue:
                    break
                arrival = Arrival(message, received_s, f'no transform to {frame_id}: {error}')
            except Exception as error:  # the message is not checked yet
                arrival = Arrival(message, received_s, f'cannot be transformed to {frame_id}: {" ".join(str(error).split())}')
            queue.popleft()
            yield arrival

    def _transform(self, role: str, message: Any, frame_id: str | None, config: Config, is_overdue: bool) -> tuple[Any, bool]:
        """Return a message in the working frame, and whether the newest transform was taken for it."""
        is_unneeded = role == HAND and self._is_skipped(decode_stamp(message.header))
        if self._source is None or frame_id is None or is_unneeded:
            return message, False
        if role == HAND:
            check_hand_pose(message.pose)  # a transform would move the position 0
        try:
            return transform_message(role, message, frame_id, config.plane, partial(self._find, frame_id)), False
        except TransformUnavailableError:
            if not is_overdue:
                raise
        find = partial(self._find_newest, frame_id, config.frames.tolerance_s)
        return transform_message(role, message, frame_id, config.plane, find), True

    def _find(self, frame_id: str, header: Any) -> Transform:
        assert self._source is not None
        return self._source.look_up(frame_id, decode_frame(header), decode_stamp(header))

    def _find_newest(self, frame_id: str, tolerance_s: float, header: Any) -> Transform:
        """Return the transform for a header or else the newest one, if its stamp differs by the tolerance [s] at most."""
        try:
            return self._find(frame_id, header)
        except TransformUnavailableError as reason:
            assert self._source is not None
            newest = self._source.look_up(frame_id, decode_frame(header), 0)
            late_s = (decode_stamp(header) - newest.stamp_ns) / NANOSECONDS
            if abs(late_s) > tolerance_s:
                text = f'{reason}; the newest one is {abs(late_s):.3g} s {"older" if late_s > 0.0 else "newer"} than the message'
                raise TransformUnavailableError(f'{text} (frames.tolerance_s is {tolerance_s:g})') from None
            return newest
