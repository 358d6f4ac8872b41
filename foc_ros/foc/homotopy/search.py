"""The K best classes over all goals, named, each with a timed guess inside it."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from heapq import merge
from itertools import islice

import numpy as np

from foc_ros.foc.config import HomotopyConfig
from foc_ros.foc.errors import SceneError
from foc_ros.foc.records import LEFT, RIGHT, Array, Candidate, Obstacles
from .roadmap import TURN, Complex, Index, Roadmap, roadmap
from .scene import SMALLEST, excess, matters, shrunk
from .sides import swept_angles
from .taut import TautPath, progress, taut_path
from .ways import ways

COAST_S = 0.2
"""A path that leaves at an angle p to the present velocity v ranks as if it were |v| (1 - cos p) times this longer: the hand coasts."""
NEAREST = 8
"""Circles in the first roadmap; it doubles until no other circle can change the answer."""
MOST = 64
"""Circles in the last roadmap; beyond it classes that only the rest would tell apart may be missed, never invented."""
STATES = 20_000
"""States that the search for one goal may look at."""
TIE = 1e-9
"""Lengths that differ by less [m] are equal, and the label decides."""


@dataclass(frozen=True)
class Search:
    """candidates: shortest first; notes: what was decided on the way, as counts by name.

    hand_inside: obstacles whose margin holds the hand; goal_near: likewise goals; goal_inside: goals inside an obstacle, which get no
    candidates; no_way: other goals without any; left_out: classes dropped because circles beyond the last roadmap are in their way;
    search_cut: goals whose search ended at its bound.
    """

    candidates: tuple[Candidate, ...]
    notes: dict[str, int] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class _Found:
    """One class to one goal: rank (key [m], label), sides by id, path, speed of the hand along its beginning [m/s]."""

    rank: tuple[float, str]
    goal: int
    sides: tuple[tuple[str, int], ...]
    path: TautPath
    speed: float


def search(
    hand_mean: Array, goals: Array, obstacles: Obstacles, config: HomotopyConfig, duration_s: Sequence[float], steps: int
) -> Search:
    """Find the K = config.max_candidates best classes between the hand and the goals.

    hand_mean (6,): state mean, SI units; goals (g, 2) [m]; duration_s: time to go to each goal [s]; steps: N of the guesses.
    Obstacles are circles of radius + config.clearance; the spread of the radius is left to the chance constraint. Each goal's best class
    comes in first, while K allows, then the shortest of all. Raises SceneError where the arguments do not fit each other.
    """
    if hand_mean.shape != (6,) or goals.ndim != 2 or goals.shape[1:] != (2,):
        raise SceneError('hand_mean, goals', 'shapes (6,), (g, 2)', f'{hand_mean.shape}, {goals.shape}')
    if len(duration_s) != len(goals):
        raise SceneError('duration_s', f'one for each of the {len(goals)} goals', len(duration_s))
    hand, velocity = complex(*hand_mean[:2]), complex(*hand_mean[2:4])
    notes: Counter[str] = Counter()
    streams = _streams(hand, velocity, goals[:, 0] + 1j * goals[:, 1], obstacles, config.clearance, notes)
    chosen = _best(streams, config.max_candidates)
    candidates = (_candidate(found, duration_s[found.goal], steps) for found in chosen)
    return Search(tuple(candidates), {name: count for name, count in notes.items() if count})


def _best(streams: list[Iterator[_Found]], count: int) -> list[_Found]:
    """Merge sorted streams: the first of each, while there is room, and the best of the rest."""
    firsts = sorted((found for stream in streams if (found := next(stream, None)) is not None), key=_rank)[:count]
    rest = islice(merge(*streams, key=_rank), count - len(firsts))
    return sorted([*firsts, *rest], key=_rank)


def _rank(found: _Found) -> tuple[float, str]:
    return found.rank


def _streams(
    hand: complex, velocity: complex, goals: Complex, obstacles: Obstacles, clearance: float, notes: Counter[str]
) -> list[Iterator[_Found]]:
    """One stream of classes for each goal that can be reached, shortest first."""
    centre = obstacles.centre[:, 0] + 1j * obstacles.centre[:, 1]
    radius, held = shrunk(hand, centre, np.maximum(obstacles.radius + clearance, SMALLEST))
    notes['hand_inside'] = int(held.sum())
    fields: dict[bytes, _Field] = {}
    streams = []
    for i, goal in enumerate(goals.tolist()):
        if (np.abs(centre - goal) < obstacles.radius).any():
            notes['goal_inside'] += 1
            continue
        reachable, near = shrunk(goal, centre, radius)
        notes['goal_near'] += int(near.any())
        key = reachable.tobytes()
        if key not in fields:
            fields[key] = _Field(hand, goals, centre, reachable)
        streams.append(_classes(fields[key], i, velocity, obstacles.ids, notes))
    return streams


class _Field:
    """Hand, goals and circles, nearest to the ways first, with the roadmaps among the first so many of them."""

    def __init__(self, hand: complex, goals: Complex, centre: Complex, radius: Array) -> None:
        ratio = excess(hand, goals, centre, radius)
        self.hand, self.goals, self.centre, self.radius = hand, goals, centre, radius
        self.order: Index = np.argsort(ratio, kind='stable')
        self.ratio = np.append(ratio[self.order], np.inf)
        self.points = np.stack([centre.real, centre.imag], axis=1)
        self._plans: dict[int, Roadmap] = {}

    def plan(self, size: int) -> Roadmap:
        """Return the roadmap among the first `size` circles."""
        if size not in self._plans:
            rows = self.order[:size]
            self._plans[size] = roadmap(self.hand, self.goals, self.centre[rows], self.radius[rows])
        return self._plans[size]


def _classes(ground: _Field, goal: int, velocity: complex, ids: tuple[str, ...], notes: Counter[str]) -> Iterator[_Found]:
    """Yield the classes to one goal, shortest first and by label where equal; growing the roadmap until no other circle counts."""
    equal: list[_Found] = []
    for found in _unsorted(ground, goal, velocity, ids, notes):
        if equal and found.rank[0] != equal[0].rank[0]:
            yield from sorted(equal, key=_rank)
            equal = []
        equal.append(found)
    notes['no_way'] += not equal
    yield from sorted(equal, key=_rank)


def _unsorted(ground: _Field, goal: int, velocity: complex, ids: tuple[str, ...], notes: Counter[str]) -> Iterator[_Found]:
    hand, target = ground.hand, complex(ground.goals[goal])
    named = np.flatnonzero(matters(hand, target, ground.centre, ground.radius))
    named = named[np.argsort([ids[i] for i in named], kind='stable')] if len(named) else named
    turned = _angle(target - ground.centre[named]) - _angle(hand - ground.centre[named])
    emitted: set[str] = set()
    size = NEAREST
    while True:
        plan, rows = ground.plan(size), ground.order[:size]
        certain = ground.ratio[min(size, len(ground.order))] * abs(target - hand)
        place = {int(row): k for k, row in enumerate(rows)}
        told = [k for k in range(len(named)) if int(named[k]) in place]
        leaving = plan.heading * velocity.conjugate()
        penalty = COAST_S * (abs(velocity) - leaving.real)
        node = 2 * (len(rows) + 1 + goal) + 1
        for way in ways(plan, node, np.abs(plan.end - target), [place[int(named[k])] for k in told], penalty, STATES):
            swept = turned[told] + TURN * np.array(way.crossings)
            if (np.abs(swept) >= TURN).any():
                continue
            if way.key >= certain:
                break
            path = taut_path(plan, way)
            if len(told) < len(named):
                line = path.polyline()
                all_swept = swept_angles(np.stack([line.real, line.imag], 1), ground.points[named])
                all_swept[told] = swept
                swept = all_swept
            sides = tuple(
                (ids[row], LEFT if angle < 0.0 else RIGHT) for row, angle in zip(named.tolist(), swept.tolist(), strict=True)
            )
            label = f'goal{goal}:' + ''.join(('+' if side == LEFT else '-') + name for name, side in sides)
            if label in emitted:
                continue
            emitted.add(label)
            speed = (velocity * complex(plan.heading[way.runs[0]]).conjugate()).real
            yield _Found((round(way.key, 9), label), goal, sides, path, speed)
        else:
            if size >= len(ground.order):
                return
        size *= 2


def _angle(seen: Complex) -> Array:
    """Angle in (-pi, pi]; a negative zero counts as zero, as it does where rays are crossed."""
    angle: Array = np.angle(seen + 0.0j)
    return angle


def _candidate(found: _Found, duration_s: float, steps: int) -> Candidate:
    points = found.path.point(progress(found.path.length, found.speed, duration_s, steps))
    guess = np.stack([points.real, points.imag], axis=1)
    return Candidate(found.rank[1], found.goal, found.sides, guess, found.path.length)
