"""Shared by the learning of pace, choices and errors: samples of a movement, and posterior means of factors."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol, TypeVar

import numpy as np

from foc_ros.core.types import NANOSECONDS, Array

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


def compute_mean_factors(logs: Array, scores: Array, prior_stddev: float) -> tuple[float, float]:
    """Return the geometric posterior means of two factors, each on a grid of logarithms (f,).

    scores (f, f'): log-likelihood of each pair; prior_stddev: of the logarithms, about zero, before anything is known.
    """
    prior = -0.5 * (logs / prior_stddev) ** 2
    total = scores + prior[:, None] + prior
    weights = np.exp(total - total.max())
    weights /= weights.sum()
    return float(np.exp(weights.sum(axis=1) @ logs)), float(np.exp(weights.sum(axis=0) @ logs))
