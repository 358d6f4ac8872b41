"""Which straight runs are worth a try, from node to node: node 2 k + 1 is circle k passed anticlockwise, 2 k clockwise."""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from foc_ros.foc.compiled import Indices
from foc_ros.foc.records import Array

from .crossing import Complex


@lru_cache(maxsize=32)
def pairs(n: int, goals: int) -> tuple[Indices, Indices]:
    """Return tails and heads between n circles, in one direction each, and from circles to goals, the circles after them."""
    i, j = np.triu_indices(n, 1)
    k, goal = np.divmod(np.arange(n * goals), max(goals, 1))
    tail = np.concatenate([np.repeat(2 * i, 4) + np.tile([0, 0, 1, 1], len(i)), np.repeat(2 * k, 2) + np.tile([0, 1], len(k))])
    head = np.concatenate([np.repeat(2 * j, 4) + np.tile([0, 1, 0, 1], len(i)), np.repeat(2 * (n + goal) + 1, 2)])
    return tail, head


@lru_cache(maxsize=32)
def spokes(n: int, goals: int) -> tuple[Indices, Indices]:
    """Return tails and heads from the hand, the circle after the last goal, to circles and goals."""
    head = np.concatenate([np.arange(2 * n), 2 * np.arange(n, n + goals) + 1])
    return np.full(len(head), 2 * (n + goals) + 1), head


class Ellipse(NamedTuple):
    """Points from which the way over them from the hand to some goal is shorter than its reach (g,) [m]; complex, goals (g,)."""

    hand: complex
    goals: Complex
    reach: Array


EVERYWHERE = Ellipse(0.0j, np.zeros(1, dtype=complex), np.array([np.inf]))
