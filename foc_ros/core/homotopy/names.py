"""The names of circles, and what is looked up by them."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from foc_ros.core.kernels import Indices, Table
from foc_ros.core.types import Candidate


class Names(NamedTuple):
    """ids (n,); row: by id; order (n,): rows in the order of their ids; signed (n,): by side, part of a label."""

    ids: tuple[str, ...]
    row: dict[str, int]
    order: list[int]
    signed: tuple[tuple[str, str, str], ...]


@lru_cache(maxsize=8)
def names_of(ids: tuple[str, ...]) -> Names:
    """Return the names of circles by their ids. The last few are kept: circles that move keep theirs."""
    order = sorted(range(len(ids)), key=ids.__getitem__)
    signed = tuple([('', '+' + identity, '-' + identity) for identity in ids])
    return Names(ids, {identity: row for row, identity in enumerate(ids)}, order, signed)


def passed_before(names: Names, previous: Sequence[Candidate]) -> tuple[Indices, Table]:
    """Return goals (p,) and sides (p, n) of earlier candidates, 0 where their names do not hold a circle."""
    n, row = len(names.ids), names.row
    table = np.zeros((len(previous), n), dtype=np.intp)
    cells = table.reshape(-1).data  # numpy itself takes twice as long to set single numbers
    for one, candidate in enumerate(previous):
        for identity, side in candidate.sides:
            if identity in row:
                cells[one * n + row[identity]] = side
    return np.array([candidate.goal for candidate in previous], dtype=np.intp), table
