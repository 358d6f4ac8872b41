# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The base of the records that pass between the parts of the package, and those of the hand.

Records are frozen, with read-only arrays, in SI units and in the task plane. They pass in this order:
message -> HandSample -> HandState -> Candidates and Solutions (`solution`) -> Prediction (`prediction`) -> message.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import StrEnum
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
NANOSECONDS = 1_000_000_000


def as_readonly(array: Array) -> Array:
    """Make a new array read-only, so that a record takes it without a copy; no other code may hold a reference to it."""
    array.setflags(write=False)
    return array


class Record:
    """Base of the records: after construction every array field is read-only and C-contiguous."""

    def __post_init__(self) -> None:
        values = vars(self)
        for name, value in values.items():
            if isinstance(value, np.ndarray) and ((flags := value.flags).writeable or not flags.c_contiguous):
                values[name] = as_readonly(value.copy())

    def __setstate__(self, state: dict[str, Any]) -> None:
        """Restore a record from another process, where its arrays have become writeable."""
        vars(self).update(state)
        Record.__post_init__(self)


@dataclass(frozen=True, eq=False)
class HandSample(Record):
    """One measured hand position.

    stamp_ns: message stamp [ns]; position (2,): in the task plane [m]; height: along the plane's normal [m];
    frame_id: frame of the measurement.
    """

    stamp_ns: int
    position: Array
    height: float = 0.0
    frame_id: str = ''


class Unassigned(NamedTuple):
    """Shares of the likelihood that no candidate has: of classes that are unknown, and of a goal that nobody announced."""

    unknown: float = 0.0
    other: float = 0.0


class SampleStatus(StrEnum):
    """What became of a message that was given to the predictor.

    ACCEPTED: used. RESTARTED_BACKWARD, RESTARTED_GAP, RESTARTED_JUMP: used, and the movement restarts from it. DISENGAGED: the
    hand was followed, but nothing is predicted from it. JUMPED: refused, and kept until the next one decides whether it is an
    outlier. SKIPPED: not used, because it is too near to the last one. DUPLICATE, LATE, WRONG_FRAME: refused. The last four
    change nothing.
    """

    ACCEPTED = 'accepted'
    DUPLICATE = 'duplicate'
    LATE = 'late'
    RESTARTED_BACKWARD = 'restarted_backward'
    RESTARTED_GAP = 'restarted_gap'
    RESTARTED_JUMP = 'restarted_jump'
    JUMPED = 'jumped'
    WRONG_FRAME = 'wrong_frame'
    SKIPPED = 'skipped'
    DISENGAGED = 'disengaged'

    @property
    def is_refused(self) -> bool:
        """Whether the message was rejected."""
        return self in (SampleStatus.JUMPED, SampleStatus.DUPLICATE, SampleStatus.LATE, SampleStatus.WRONG_FRAME)

    @property
    def is_taken(self) -> bool:
        """Whether the message was used."""
        return not self.is_refused and self is not SampleStatus.SKIPPED

    @property
    def is_restart(self) -> bool:
        """Whether the movement restarts from this message."""
        return self in (SampleStatus.RESTARTED_BACKWARD, SampleStatus.RESTARTED_GAP, SampleStatus.RESTARTED_JUMP)


@dataclass(frozen=True, eq=False)
class HandState(Record):
    """The estimated state of the hand at a stamp.

    mean (6,): x, y, vx, vy, ax, ay [m, m/s, m/s^2]; covariance (6, 6) in the same order;
    height: as measured, along the plane's normal [m]; onset_ns: stamp at which the present movement began, None at rest;
    onset_position (2,): where it began [m]; height_mean (3,): height, its velocity and its acceleration, with the covariance that
    x, vx and ax have.
    """

    stamp_ns: int
    mean: Array
    covariance: Array
    height: float = 0.0
    frame_id: str = ''
    onset_ns: int | None = None
    onset_position: Array | None = None
    height_mean: Array = field(default_factory=lambda: np.zeros(3))
