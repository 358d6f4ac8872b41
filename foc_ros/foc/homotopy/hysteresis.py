"""What the candidates of the tick before hold on to, so that noise moves neither names nor gaps to and fro."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from foc_ros.foc.compiled import Indices, Points, Table, Vector, compiled_exactly
from foc_ros.foc.records import Array, Candidate

from .crossing import Complex

ENTER = 0.005
"""An obstacle that was in no name to a goal enters one only this much within the bounds [m]."""
NARROWER = 0.004
"""A gap that some candidate went through stays open until it is this much, or the clearance, too narrow [m]."""
OPEN = 1e-6
"""A gap is kept open by this much [m]."""


def strangers(ids: tuple[str, ...], goals: int, previous: Sequence[Candidate]) -> Array:
    """ENTER for the obstacles that were not in the names to a goal that had some, else 0 (g, n) [m]."""
    known: dict[int, set[str]] = {}
    for candidate in previous:
        known.setdefault(candidate.goal, set()).update(identity for identity, _ in candidate.sides)
    slack = np.zeros((goals, len(ids)))
    for goal, names in known.items():
        if goal < goals:
            slack[goal] = [0.0 if identity in names else ENTER for identity in ids]
    return slack


def kept_open(ids: tuple[str, ...], centre: Complex, radius: Array, clearance: float, previous: Sequence[Candidate]) -> Array:
    """Return the radii (n,) [m], less by half of what is missing from gaps that candidates went through."""
    names = {identity for candidate in previous for identity, _ in candidate.sides}
    rows = [row for row, identity in enumerate(ids) if identity in names]
    sides = [[held.get(ids[row], 0) for row in rows] for held in (dict(candidate.sides) for candidate in previous)]
    table = np.array(sides, dtype=np.intp).reshape(len(previous), len(rows))
    return lessened(centre, radius, np.array(rows, dtype=np.intp), table, min(NARROWER, clearance))


@compiled_exactly
def lessened(centre: Points, radius: Vector, rows: Indices, sides: Table, most: float) -> Vector:
    """Return radii (n,) less by half of what is missing, but no more than `most`, from gaps between circles of the given rows.

    sides (candidates, rows): a gap is one where some candidate passes its two circles on different sides.
    """
    less = radius.copy()
    for j in range(len(rows)):
        for i in range(j):
            a, b = rows[i], rows[j]
            missing = radius[a] + radius[b] - abs(centre[a] - centre[b])
            if -OPEN < missing < most and (sides[:, i] * sides[:, j] < 0).any():
                less[a] = min(less[a], radius[a] - (missing / 2.0 + OPEN))
                less[b] = min(less[b], radius[b] - (missing / 2.0 + OPEN))
    return less
