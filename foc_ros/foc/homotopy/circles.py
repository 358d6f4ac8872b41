"""Circles to go round, and how they hold and overlap each other."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from foc_ros.foc.compiled import Flags, FlagTable, Indices, compiled_exactly
from foc_ros.foc.records import Array

from .crossing import Complex

GRAZE = 1e-9
"""A run may pass this much nearer to a circle than its radius [m]: neighbours in a row share tangents, up to rounding."""


@dataclass(frozen=True, eq=False)
class Circles:
    """n circles and, after them, g goals: circles of radius 0.

    centre (n + g,), complex [m]; radius (n + g,) [m]; bar (n,): square of the distance from each centre that bars a run [m^2];
    held (n + g, n): which centres each circle holds; outer (n + g,): which ones lie in no other circle, of equal ones the
    first; blocker (n, n): direction of the outer circles that overlap with each [rad], NaN for others; cluster: number of the
    cluster of overlapping circles that each belongs to.
    """

    n: int
    centre: Complex
    radius: Array
    bar: Array
    held: FlagTable
    outer: Flags
    blocker: Array
    cluster: tuple[int, ...]

    @property
    def goals(self) -> int:
        """How many goals there are."""
        return len(self.centre) - self.n


@compiled_exactly
def clusters(touching: FlagTable) -> Indices:
    """Return the number of the cluster that each circle belongs to, (n,): all that can be reached from one another."""
    number = np.full(len(touching), -1)
    for first in range(len(touching)):
        if number[first] >= 0:
            continue
        number[first], reached = first, [first]
        while reached:
            circle = reached.pop()
            for other in range(len(touching)):
                if touching[circle, other] and number[other] < 0:
                    number[other] = first
                    reached.append(other)
    return number


def circles(centre: Complex, radius: Array, goals: Complex) -> Circles:
    """Take centre (n,), complex [m], radius (n,) > 0 [m] and goals (g,), complex [m], together."""
    n = len(centre)
    c, r = np.concatenate([centre, goals]), np.concatenate([radius, np.zeros(len(goals))])
    apart = centre - c[:, None]
    distance = np.abs(apart)
    within = (distance[:n] + radius[:, None] <= radius) & ~np.eye(n, dtype=bool)
    within &= ~(within.T & np.triu(np.ones((n, n), dtype=bool)))
    outer = np.append(~within.any(axis=1), np.ones(len(goals), dtype=bool))
    touching = distance[:n] < radius[:, None] + radius
    overlap = touching & outer[:n] & ~np.eye(n, dtype=bool)
    blocker = np.where(overlap, np.angle(apart[:n]), np.nan)
    bar = (radius - GRAZE).clip(0.0) ** 2
    return Circles(n, c, r, bar, distance < r[:, None], outer, blocker, tuple(clusters(touching).tolist()))
