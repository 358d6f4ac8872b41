# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The messages that the page sends, as declared fields, and their times. None of them names a file, a topic or a parameter."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, TypeAdapter, ValidationError

from foc_ros.core.errors import InputError
from foc_ros.core.types import NANOSECONDS
from foc_ros.io.fields import Fields, describe_errors

from .scene import PlayScene, Point, X, Y

LONGEST_MESSAGE = 65_536
"""Bytes of a message, at most."""
AHEAD_NS = NANOSECONDS
"""Time by which a message may be ahead of the clock of the page, as it is known from the messages before [ns]."""
Time = Annotated[float, Field(ge=0.0, le=1e10)]
"""Time of the page's clock, which begins when the page is opened [ms]."""
Seed = Annotated[int, Field(ge=0, le=2**31 - 1)]


class HandMessage(Fields):
    """The hand at a time; event: time of the input that moved it, None if it did not move."""

    type: Literal['hand']
    t: Time
    x: X
    y: Y
    event: Time | None

    @property
    def position(self) -> Point:
        """The position [m]."""
        return self.x, self.y


class SceneMessage(PlayScene):
    """A new scene."""

    type: Literal['scene']


class ShuffleMessage(Fields):
    """Random obstacles, by a seed."""

    type: Literal['shuffle']
    seed: Seed


class SwitchMessage(Fields):
    """Whether the hand is guided, or recorded without tasks."""

    type: Literal['guidance', 'record']
    on: bool


class TasksMessage(Fields):
    """Begin tasks.

    seed: of all random choices; assistance: trials with guidance, half of them in random order, all, or none; blinded: without
    predictions on the page; shuffled: with new obstacles in every trial.
    """

    type: Literal['tasks'] = 'tasks'
    trials: Annotated[int, Field(ge=1, le=200)]
    seed: Seed
    assistance: Literal['mixed', 'with', 'without']
    blinded: bool
    shuffled: bool


class NameMessage(Fields):
    """Predict with parameters."""

    type: Literal['parameters']
    name: Literal['standard', 'mine']


class JobMessage(Fields):
    """Begin what is done after a session."""

    type: Literal['job']
    name: Literal['report', 'fit', 'compare']


class PlainMessage(Fields):
    """End the tasks, or the job that runs."""

    type: Literal['stop', 'cancel']


Message = HandMessage | SceneMessage | ShuffleMessage | SwitchMessage | TasksMessage | NameMessage | JobMessage | PlainMessage
_ADAPTER: TypeAdapter[Message] = TypeAdapter(Annotated[Message, Field(discriminator='type')])


def parse_message(text: str | bytes) -> Message:
    """Return the message in a text of JSON; raises InputError, which names field, value and bound."""
    try:
        return _ADAPTER.validate_json(text)
    except ValidationError as invalid:
        field, expected, got = describe_errors(invalid)[0]
    raise InputError(field or 'message', expected, got)


class PageClock:
    """Gives times of the page's clock stamps of the clock of this computer.

    A message can only be late. So the difference of the two clocks is that of the message that took the shortest time, which is
    about that of the network: nothing on one computer, some milliseconds on a wireless network.
    """

    def __init__(self) -> None:
        self._offset_ns: int | None = None
        self._last_ms = -1.0
        self._last_ns = 0

    def stamp(self, t_ms: float, received_ns: int) -> int | None:
        """Return the stamp [ns] of a time [ms], which is not after received_ns; raises InputError for a time out of order.

        The first messages may have taken long. When a quicker one shows it, the stamps would step back: they are None until they
        have passed the last one again.
        """
        page_ns = round(1e6 * t_ms)
        if t_ms <= self._last_ms:
            raise InputError('hand.t', f'a time after the last one, {self._last_ms:.1f} ms', t_ms)
        if self._offset_ns is not None and page_ns + self._offset_ns - received_ns > AHEAD_NS:
            latest_ms = (received_ns - self._offset_ns + AHEAD_NS) / 1e6
            raise InputError('hand.t', f'a time before {latest_ms:.1f} ms', t_ms)
        offset_ns = received_ns - page_ns
        self._offset_ns = offset_ns if self._offset_ns is None else min(offset_ns, self._offset_ns)
        self._last_ms = t_ms
        stamp_ns = page_ns + self._offset_ns
        if stamp_ns <= self._last_ns:
            return None
        self._last_ns = stamp_ns
        return stamp_ns
