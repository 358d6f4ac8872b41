"""Rows of obstacles across the way to the goals, and which of them a path still has to pass.

Obstacles whose extents along the way overlap stand in one row, to be passed through one of its gaps; one by itself is a row
with two gaps. In a row of m obstacles a path that does not turn back takes one of m + 1 gaps, so with rows of m_1, m_2, ... ahead
there are (m_1 + 1)(m_2 + 1)... ways.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from foc_ros.core.types import Array


def axis(start: Array, goals: Array) -> Array:
    """Return the unit vector (2,) from a start (2,) [m] to the middle of the goals (g, 2) [m]; x where they coincide."""
    way: Array = goals.mean(axis=0) - start
    length = float(np.hypot(*way))
    return way / length if length > 0.0 else np.array([1.0, 0.0])


def rows(centre: Array, radius: Array, along: Array) -> NDArray[np.int64]:
    """Return the row (n,) of each obstacle, counted along the way; centre (n, 2), radius (n,) [m]; along (2,): unit vector."""
    place = centre @ along
    row = np.zeros(len(place), dtype=np.int64)
    number, reach = -1, -np.inf
    for each in np.argsort(place - radius, kind='stable'):
        if place[each] - radius[each] > reach:
            number += 1
        reach = max(reach, place[each] + radius[each])
        row[each] = number
    return row


def lines(place: Array, row: NDArray[np.int64]) -> Array:
    """Return where along the way each row stands (r,) [m]: the mean of its obstacles; place (n,) [m], row (n,)."""
    return np.array([place[row == each].mean() for each in range(int(row.max(initial=-1)) + 1)])


def to_pass(line: Array, place: Array) -> NDArray[np.bool_]:
    """Tell which rows (r,) at line (r,) [m] the rest of a path, (m,) [m] along the way, has still to pass."""
    before = place[:, None] < line
    return np.asarray((before[:-1] & ~before[1:]).any(axis=0))
