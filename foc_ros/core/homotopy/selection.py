"""Which classes are worth solving: the shortest over all goals, with no goal forgotten and no way round repeated too soon."""

from __future__ import annotations

from bisect import insort
from collections.abc import Collection, Iterable
from heapq import merge
from itertools import islice

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
    firsts = sorted([found for stream in streams for found in islice(stream, 1)])[:count]
    room = count - len(firsts)
    owner = {found.course: found.goal for found in firsts}
    awaited = {*previous} - {found.label for found in firsts}
    others: list[tuple[float, str, Found]] = []
    for found in merge(*streams) if room else ():
        if len(others) >= room and (STAY if awaited else 1.0) * found.key > others[room - 1][0]:
            break
        factor = REPEAT if owner.setdefault(found.course, found.goal) != found.goal else 1.0
        insort(others, (found.key * factor * (STAY if found.label in awaited else 1.0), found.label, found))
        awaited.discard(found.label)
    return sorted([*firsts, *[found for _, _, found in others[:room]]])
