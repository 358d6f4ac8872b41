"""Circles to go round, and how they hold and overlap each other."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from foc_ros.core.kernels import Flags, FlagTable, Indices, Matrix, Points, Vector, compiled_exactly

GRAZE = 1e-9
"""A run may pass this much nearer to a circle than its radius [m]: neighbours in a row share tangents, up to rounding."""


class Circles(NamedTuple):
    """n circles and, after them, g goals and a place for the hand: circles of radius 0.

    centre (n + g + 1,), complex [m]; radius (n + g + 1,) [m]; bar (n,): square of the distance from each centre that bars a run
    [m^2]; held (n + g + 1, n): which centres each circle holds; outer (n + g + 1,): which ones lie in no other circle, of equal
    ones the first; blocker (n, n): direction of the outer circles that overlap with each [rad], NaN for others.
    """

    centre: Points
    radius: Vector
    bar: Vector
    held: FlagTable
    outer: Flags
    blocker: Matrix


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


@compiled_exactly
def together(centre: Points, radius: Vector, goals: Points) -> tuple[Points, Vector, Vector, FlagTable, Flags, Matrix, Indices]:
    """Take centre (n,) [m], radius (n,) > 0 [m] and goals (g,) [m] together: the fields of `Circles`, and clusters (n,)."""
    n, c, r = (
        len(centre),
        np.concatenate((centre, goals, np.zeros(1, np.complex128))),
        np.append(radius, np.zeros(len(goals) + 1)),
    )
    held, touching = np.zeros((len(c), n), np.bool_), np.zeros((n, n), np.bool_)
    outer, blocker = np.ones(len(c), np.bool_), np.full((n, n), np.nan)
    for j in range(n):
        for i in range(len(c)):
            distance = abs(c[j] - c[i])
            held[i, j] = distance < r[i]
            if i < n:
                touching[i, j] = distance < r[i] + r[j]
                hidden, hides = distance + r[i] <= r[j], distance + r[j] <= r[i]
                outer[i] &= i == j or not hidden or (hides and i < j)
    for i in range(n):
        for j in range(n):
            if touching[i, j] and outer[j] and i != j:
                apart = c[j] - c[i]
                blocker[i, j] = np.arctan2(apart.imag, apart.real)
    return c, r, np.maximum(radius - GRAZE, 0.0) ** 2, held, outer, blocker, clusters(touching)
