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
    rows = np.array([row for row, identity in enumerate(ids) if identity in names], dtype=np.intp)
    gaps, missing = narrow_gaps(centre, radius, rows, min(NARROWER, clearance))
    less, sides = radius.copy(), [dict(candidate.sides) for candidate in previous] if len(gaps) else []
    for (a, b), short in zip(gaps.tolist(), missing.tolist(), strict=True):
        if any(held.get(ids[a], 0) * held.get(ids[b], 0) < 0 for held in sides):
            for row in (a, b):
                less[row] = min(less[row], radius[row] - (short / 2.0 + OPEN))
    return less


@compiled_exactly
def narrow_gaps(centre: Points, radius: Vector, rows: Indices, most: float) -> tuple[Table, Vector]:
    """Return the gaps (m, 2) between circles of some rows that are too narrow, by less than `most`, and by how much (m,) [m]."""
    gaps, missing, count = np.empty((len(rows) ** 2, 2), np.intp), np.empty(len(rows) ** 2), 0
    for j in range(len(rows)):
        for i in range(j):
            a, b = rows[i], rows[j]
            short = radius[a] + radius[b] - abs(centre[a] - centre[b])
            if -OPEN < short < most:
                gaps[count, 0], gaps[count, 1], missing[count] = a, b, short
                count += 1
    return gaps[:count].copy(), missing[:count].copy()
