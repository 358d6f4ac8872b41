"""Which straight runs are worth a try."""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from foc_ros.foc.records import Array

from .crossing import Complex, Flags

Index = NDArray[np.int64]


class Tries(NamedTuple):
    """Runs to try: from circle i in sense s_i to circle j in sense s_j; others (runs, n): the circles that may be in the way."""

    i: Index
    s_i: Index
    j: Index
    s_j: Index
    others: Flags


@lru_cache(maxsize=32)
def pairs(n: int, goals: int) -> Tries:
    """Return the runs between n circles, in one direction each, and from circles to goals, which are the circles after them."""
    i, j = np.triu_indices(n, 1)
    k, goal = np.divmod(np.arange(n * goals), max(goals, 1))
    return _tries(
        n,
        np.concatenate([np.repeat(i, 4), np.repeat(k, 2)]),
        np.concatenate([np.tile([-1, -1, 1, 1], len(i)), np.tile([-1, 1], len(k))]),
        np.concatenate([np.repeat(j, 4), np.repeat(n + goal, 2)]),
        np.concatenate([np.tile([-1, 1, -1, 1], len(i)), np.ones(2 * len(k), dtype=np.int64)]),
    )


@lru_cache(maxsize=32)
def spokes(n: int, goals: int) -> Tries:
    """Return the runs from the hand, the circle after the last goal, to circles and goals."""
    j = np.concatenate([np.repeat(np.arange(n), 2), np.arange(n, n + goals)])
    s_j = np.concatenate([np.tile([-1, 1], n), np.ones(goals, dtype=np.int64)])
    return _tries(n, np.full(len(j), n + goals), np.ones(len(j), dtype=np.int64), j, s_j)


def _tries(n: int, i: Index, s_i: Index, j: Index, s_j: Index) -> Tries:
    circle = np.arange(n)
    return Tries(i, s_i, j, s_j, (circle != i[:, None]) & (circle != j[:, None]))


class Ellipse(NamedTuple):
    """Points from which the way over them from the hand to some goal is shorter than its reach (g,) [m]; complex, goals (g,)."""

    hand: complex
    goals: Complex
    reach: Array

    def holds(self, start: Complex, end: Complex, length: Array) -> Flags:
        """Tell which runs lie on ways that short."""
        onward = (np.abs(end[:, None] - self.goals) - self.reach).min(axis=1, initial=np.inf)
        return np.asarray(np.abs(start - self.hand) + length + onward < 0.0)
