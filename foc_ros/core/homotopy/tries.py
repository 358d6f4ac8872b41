"""Which straight runs are worth a try, from node to node: node 2 k + 1 is circle k passed anticlockwise, 2 k clockwise."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from foc_ros.core.kernels import Table, compiled_exactly
from foc_ros.core.types import Array

from .crossing import Complex


@compiled_exactly
def pairs(n: int, goals: int) -> Table:
    """Return tails and heads (m, 2) between n circles, in one direction each, and from circles to goals, circles after them."""
    tries, count = np.empty((2 * n * (n - 1) + 2 * n * goals, 2), np.intp), 0
    for i in range(n):
        for j in range(i + 1, n):
            for senses in range(4):
                tries[count, 0], tries[count, 1] = 2 * i + (senses >> 1), 2 * j + (senses & 1)
                count += 1
    for k in range(n):
        for goal in range(goals):
            for sense in range(2):
                tries[count, 0], tries[count, 1] = 2 * k + sense, 2 * (n + goal) + 1
                count += 1
    return tries


@compiled_exactly
def spokes(n: int, goal: int, hand: int) -> Table:
    """Return tails and heads (m, 2) from a hand to n circles and a goal, both of which are circles too."""
    tries = np.full((2 * n + 1, 2), 2 * hand + 1)
    tries[: 2 * n, 1] = np.arange(2 * n)
    tries[2 * n, 1] = 2 * goal + 1
    return tries


class Ellipse(NamedTuple):
    """Points from which the way over them from the hand to some goal is shorter than its reach (g,) [m]; complex, goals (g,)."""

    hand: complex
    goals: Complex
    reach: Array


EVERYWHERE = Ellipse(0.0j, np.zeros(1, dtype=complex), np.array([np.inf]))
