"""Which classes are worth solving: the shortest over all goals, with no goal forgotten and no way round repeated too soon."""

from __future__ import annotations

from bisect import insort
from collections.abc import Collection, Iterable
from heapq import merge

from .classes import Found

REPEAT = 1.5
"""A way round that another goal already has ranks as if this times as long: it tells little that is new."""
STAY = 0.95
"""A class that was there the tick before ranks as if this times as long: noise does not swap classes of equal length."""


def select(classes: Iterable[Iterable[Found]], count: int, previous: Collection[str]) -> list[Found]:
    """Choose `count` classes from those to each goal, given in the order of their rank; previous: labels of the tick before.

    The best to each goal comes in first, the best of these where there is no room for all; then the rest by
    length, with the two factors.
    """
    streams = [iter(to_goal) for to_goal in classes]
    firsts = sorted((found for stream in streams if (found := next(stream, None)) is not None), key=_rank)[:count]
    room = count - len(firsts)
    owner = {found.sides: found.goal for found in firsts}
    awaited = {*previous} - {found.rank[1] for found in firsts}
    others: list[tuple[float, str, Found]] = []
    for found in merge(*streams, key=_rank) if room else ():
        key, label = found.rank
        if len(others) >= room and (STAY if awaited else 1.0) * key > others[room - 1][0]:
            break
        factor = REPEAT if owner.setdefault(found.sides, found.goal) != found.goal else 1.0
        insort(others, (key * factor * (STAY if label in awaited else 1.0), label, found))
        awaited.discard(label)
    return sorted([*firsts, *(found for _, _, found in others[:room])], key=_rank)


def _rank(found: Found) -> tuple[float, str]:
    return found.rank
