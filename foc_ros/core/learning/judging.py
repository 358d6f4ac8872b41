"""Samples of a movement, by which its choices are judged: states of the hand, and predictions."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol, TypeVar

import numpy as np

from foc_ros.core.types import NANOSECONDS

SAMPLE_S = 0.05
"""Interval at which states and choices of a movement are kept [s]."""
MOST_KEPT, MOST_JUDGED = 1000, 10
"""Numbers of states or choices of a movement that are kept and, spread evenly over it, judged at most."""

T = TypeVar('T')
S = TypeVar('S', bound='Stamped')


class Stamped(Protocol):
    """What belongs to a stamp [ns]."""

    @property
    def stamp_ns(self) -> int:
        """The stamp [ns]."""


def sample_movement(kept: tuple[S, ...], following: S) -> tuple[S, ...]:
    """Return what is kept of a movement after what follows in it, at most `MOST_KEPT` that are `SAMPLE_S` apart."""
    if len(kept) >= MOST_KEPT or (kept and following.stamp_ns - kept[-1].stamp_ns < SAMPLE_S * NANOSECONDS):
        return kept
    return (*kept, following)


def choose_judged(kept: Sequence[T]) -> list[T]:
    """Return at most `MOST_JUDGED` of what was kept of a movement, spread evenly over it."""
    return [kept[row] for row in np.unique(np.linspace(0, len(kept) - 1, min(MOST_JUDGED, len(kept))).astype(int))]
