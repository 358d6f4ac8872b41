"""What the candidates of the tick before hold on to, so that noise moves neither names nor gaps to and fro."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

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
    names = sorted({identity for candidate in previous for identity, _ in candidate.sides}.intersection(ids))
    if len(names) < 2:
        return radius
    sides = np.array([[dict(candidate.sides).get(identity, 0) for identity in names] for candidate in previous])
    parted = (sides[:, :, None] * sides[:, None, :] < 0).any(axis=0)
    place = {identity: row for row, identity in enumerate(ids)}
    rows = [place[identity] for identity in names]
    missing = radius[rows, None] + radius[rows] - np.abs(centre[rows, None] - centre[rows])
    narrow = parted & (missing > -OPEN) & (missing < min(NARROWER, clearance))
    less = radius.copy()
    less[rows] -= np.where(narrow, missing / 2.0 + OPEN, 0.0).max(axis=1)
    return less
