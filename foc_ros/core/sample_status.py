"""What became of a message that was handed to the predictor."""

from __future__ import annotations

from enum import StrEnum


class SampleStatus(StrEnum):
    """One word for every message taken or refused.

    ACCEPTED: taken. RESTARTED_BACKWARD, RESTARTED_GAP: taken, and the movement starts anew from it. DISENGAGED: the hand was
    followed, but nothing is predicted from it. DUPLICATE, LATE, WRONG_FRAME: refused, and nothing was changed by it.
    """

    ACCEPTED = 'accepted'
    DUPLICATE = 'duplicate'
    LATE = 'late'
    RESTARTED_BACKWARD = 'restarted_backward'
    RESTARTED_GAP = 'restarted_gap'
    WRONG_FRAME = 'wrong_frame'
    DISENGAGED = 'disengaged'

    @property
    def taken(self) -> bool:
        """Whether the message changed what is known."""
        return self not in REFUSALS

    @property
    def restarted(self) -> bool:
        """Whether the movement starts anew from this message."""
        return self in (SampleStatus.RESTARTED_BACKWARD, SampleStatus.RESTARTED_GAP)


REFUSALS = frozenset({SampleStatus.DUPLICATE, SampleStatus.LATE, SampleStatus.WRONG_FRAME})
