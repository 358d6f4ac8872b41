"""What the candidates of the tick before hold on to, so that noise moves neither names nor gaps to and fro.

They come as goals (p,) and sides (p, n), 0 where their names do not hold a circle.
"""

from __future__ import annotations

import numpy as np

from foc_ros.core.kernels import Indices, Matrix, Points, Table, Vector, compiled_exactly

ENTER = 0.005
"""An obstacle that was in no name to a goal enters one only this much within the bounds [m]."""
NARROWER = 0.004
"""A gap that some candidate went through stays open until it is this much, or the clearance, too narrow [m]."""
OPEN = 1e-6
"""A gap is kept open by this much [m]."""


@compiled_exactly
def strangers(goals: int, before: Indices, sides: Table) -> Matrix:
    """Return ENTER for the obstacles that were not in the names to a goal that had some, else 0 (g, n) [m]."""
    slack = np.zeros((goals, sides.shape[1]))
    for one in range(len(before)):
        if before[one] < goals:
            slack[before[one]] = ENTER
    for one in range(len(before)):
        for k in range(sides.shape[1]):
            if before[one] < goals and sides[one, k]:
                slack[before[one], k] = 0.0
    return slack


@compiled_exactly
def kept_open(centre: Points, radius: Vector, clearance: float, sides: Table) -> Vector:
    """Return the radii (n,) [m], less by half of what is missing from gaps that candidates went through."""
    less, most, in_names = radius.copy(), min(NARROWER, clearance), np.zeros(len(radius), np.bool_)
    for one in range(len(sides)):
        in_names |= sides[one] != 0
    rows = np.flatnonzero(in_names)
    for j in range(len(rows)):
        for i in range(j):
            a, b = rows[i], rows[j]
            short = radius[a] + radius[b] - abs(centre[a] - centre[b])
            if -OPEN < short < most and (sides[:, a] * sides[:, b]).min() < 0:
                less[a] = min(less[a], radius[a] - (short / 2.0 + OPEN))
                less[b] = min(less[b], radius[b] - (short / 2.0 + OPEN))
    return less
