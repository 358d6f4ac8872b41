"""Remembered ways: demonstrated paths that come back as candidates where the scene is the one they were shown in.

The search proposes short ways; a demonstrated one may be longer, and still be what this operator does (the paper stores the
initial guesses of each class for its scene).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from foc_ros.core.config import HomotopyConfig
from foc_ros.core.types import LEFT, Array, Candidate, HandState, Obstacles, Record

from . import named_obstacles, path_sides, timed

NEAR = 0.02
"""So far may each obstacle and the goal be from where they were in the demonstration [m]."""
ASIDE = 0.1
"""So far may the hand be from the demonstrated path [m]."""
POINTS = 65
"""Points of a remembered path."""
DIGITS = 6
"""A micrometre is exact enough, and keeps the file small."""
MOST = 2
"""Recalled ways are solved beside the `max_candidates` found ones, at most so many."""


@dataclass(frozen=True, eq=False)
class Demonstration(Record):
    """A demonstration: frame; ids, centre (n, 2) [m] of the obstacles that the path (m, 2) [m] passed, and on which sides."""

    frame_id: str
    ids: tuple[str, ...]
    sides: tuple[int, ...]
    centre: Array
    path: Array

    def matches(self, frame_id: str, obstacles: Obstacles) -> bool:
        """Tell whether all obstacles that it passed are there, by id, within NEAR of where they were."""
        rows = {identity: row for row, identity in enumerate(obstacles.ids)}
        if frame_id != self.frame_id or not rows.keys() >= set(self.ids):
            return False
        apart = obstacles.centre[[rows[identity] for identity in self.ids]] - self.centre if self.ids else np.zeros((0, 2))
        return bool((np.hypot(*apart.T) <= NEAR).all())


def record_demonstration(frame_id: str, path: Array, obstacles: Obstacles) -> Demonstration:
    """Remember a path (m, 2) [m], m >= 2, by POINTS points at equal distances, with the sides that it really took."""
    length = _lengths(path)
    at = np.linspace(0.0, length[-1], POINTS)
    evenly = np.column_stack([np.interp(at, length, axis) for axis in path.T]).round(DIGITS)
    sides = path_sides(evenly, obstacles)
    rows = sorted((row for row, identity in enumerate(obstacles.ids) if identity in sides), key=obstacles.ids.__getitem__)
    ids = tuple(obstacles.ids[row] for row in rows)
    return Demonstration(frame_id, ids, tuple(sides[identity] for identity in ids), obstacles.centre[rows].round(DIGITS), evenly)


def is_same_demonstration(one: Demonstration, other: Demonstration) -> bool:
    """Tell whether two demonstrations say the same: obstacles, sides and end."""
    if (one.frame_id, one.ids, one.sides) != (other.frame_id, other.ids, other.sides):
        return False
    ends = np.vstack([one.centre - other.centre, one.path[-1:] - other.path[-1:]])
    return bool((np.hypot(*ends.T) <= NEAR).all())


def recall_demonstrations(
    library: Sequence[Demonstration],
    hand: HandState,
    goals: Array,
    obstacles: Obstacles,
    config: HomotopyConfig,
    durations_s: Sequence[float],
    steps: int,
    found: Sequence[Candidate],
    previous: Sequence[Candidate],
) -> tuple[Candidate, ...]:
    """Return the found candidates and, among them in the order of their length, at most MOST recalled ones of other classes.

    goals (g, 2) [m]; durations_s: to each goal [s]; steps: N; previous: the candidates of the tick before. A recalled path
    is deformed to the present hand and goal; it is kept only if it still passes every obstacle as it was shown, and runs
    through none.
    """
    if not library:
        return tuple(found)
    names = named_obstacles(hand.mean[:2], goals, obstacles, config.clearance, previous)
    labels, recalled = {one.label for one in found}, []
    for way in library:
        if not way.matches(hand.frame_id, obstacles):
            continue
        for goal in np.flatnonzero(np.hypot(*(goals - way.path[-1]).T) <= NEAR).tolist():
            for one in _deformed(way, hand, goals, goal, obstacles, sorted(names[goal]), durations_s[goal], steps):
                if one.label not in labels:
                    labels.add(one.label)
                    recalled.append(one)
    recalled.sort(key=_rank)
    return tuple(sorted([*found, *recalled[:MOST]], key=_rank)) if recalled else tuple(found)


def _deformed(
    way: Demonstration,
    hand: HandState,
    goals: Array,
    goal: int,
    obstacles: Obstacles,
    names: Sequence[str],
    duration_s: float,
    steps: int,
) -> Iterator[Candidate]:
    """Yield the rest of a way, from where it is nearest to the hand, moved to hand and goal; names: who is named."""
    apart = np.hypot(*(way.path - hand.mean[:2]).T)
    nearest = int(apart.argmin())
    if apart[nearest] > ASIDE or nearest == len(way.path) - 1:
        return
    rest = way.path[nearest:]
    share = np.linspace(0.0, 1.0, len(rest))[:, None]
    rest = rest + (1.0 - share) * (hand.mean[:2] - rest[0]) + share * (goals[goal] - rest[-1])
    length = float(_lengths(rest)[-1])
    guess = timed(rest, hand.mean[2:4], duration_s, steps)
    sides, shown = path_sides(guess, obstacles), dict(zip(way.ids, way.sides, strict=True))
    if any(name not in sides for name in names) or any(shown.get(name, side) != side for name, side in sides.items()):
        return
    if not _clear(rest, obstacles):
        return
    label = f'goal{goal}:' + ''.join(('+' if sides[name] == LEFT else '-') + name for name in names)
    yield Candidate(label, goal, tuple((name, sides[name]) for name in names), guess, length)


def _clear(path: Array, obstacles: Obstacles) -> bool:
    """Tell whether no piece of a path runs through an obstacle that does not hold its first point."""
    step = np.diff(path, axis=0)[:, None]
    start = obstacles.centre - path[:-1, None]
    squared = np.maximum((step**2).sum(2), np.finfo(float).tiny)
    share = np.clip((start * step).sum(2) / squared, 0.0, 1.0)
    distance = np.hypot(*(start - share[..., None] * step).transpose(2, 0, 1))
    outside = np.hypot(*(obstacles.centre - path[0]).T) > obstacles.radius
    return not bool(((distance < obstacles.radius) & outside).any())


def _lengths(path: Array) -> Array:
    lengths: Array = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(path, axis=0).T))])
    return lengths


def _rank(one: Candidate) -> tuple[float, str]:
    return round(one.length, 9), one.label
