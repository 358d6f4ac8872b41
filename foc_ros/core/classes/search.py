# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The search for homotopy classes: hand, goals and obstacles in; named candidates, each with a timed initial guess, out."""

from __future__ import annotations

import time
from bisect import insort
from collections import defaultdict
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from heapq import merge
from itertools import chain
from typing import NamedTuple

from foc_ros.core.config import MOST_CANDIDATES, HomotopyConfig
from foc_ros.core.deadline import NEVER, Deadline
from foc_ros.core.errors import SceneError
from foc_ros.core.obstacle_table import Obstacles
from foc_ros.core.solution import Candidate, Signature, agrees
from foc_ros.core.types import Array

from .scene import PathClass, SearchScene

REPEAT = 1.5
"""A class that passes the obstacles as a class to another goal does ranks as if it were this times as long: it adds little."""
MOST_UNFOLLOWED = 8
"""Number of classes besides the candidates that are looked for, to know what is not followed."""
LEAST = 4
"""Number of classes besides the best ones that are found even if time is short. Each takes a tenth of the time of the first."""
STAY = 0.95
"""A class of the previous prediction ranks as if it were this times as long: noise does not swap classes of equal length."""


class SearchOrder(NamedTuple):
    """How long a search may take, and the goal (row) at which it begins: another one each time if time is short.

    objects: for each goal the id of the obstacle that it is, whether it holds the goal or not; None, or no entry, if it is none.
    """

    deadline: Deadline = NEVER
    first_goal: int = 0
    objects: Sequence[str | None] = ()


ALL = SearchOrder()


@dataclass(frozen=True)
class Search:
    """What a search has found.

    Attributes
    ----------
    candidates : tuple[Candidate, ...]
        The candidates, shortest first.
    notes : dict[str, int]
        Counts by name, none of them 0. hand_inside: obstacles whose margin holds the hand. goal_near: goals in the margin of an
        obstacle. goal_inside: goals inside an obstacle, which does not block the paths to them. no_way: goals without candidates.
        left_out: classes whose path meets obstacles that the graph does not contain. search_cut: goals whose search ended at the
        largest number of states. search_late: searches that the deadline ended or prevented.
    next_goal : int
        Row of the first goal that the deadline left out, at which the next search should begin; 0 if there was time for all.
    unfollowed : tuple[Candidate, ...]
        Classes that were seen and are no candidates, with taut guesses. One that passes its obstacles as a candidate to another
        goal does is left out where its own goal has a candidate: its way and its goal are followed.
    named : tuple[tuple[str, ...], ...]
        For each goal the ids of the obstacles that the names of its classes contain, in alphabetical order.
    """

    candidates: tuple[Candidate, ...]
    notes: dict[str, int] = field(default_factory=dict)
    next_goal: int = 0
    unfollowed: tuple[Candidate, ...] = ()
    named: tuple[tuple[str, ...], ...] = ()


def search(
    hand_mean: Array,
    goals: Array,
    obstacles: Obstacles,
    config: HomotopyConfig,
    duration_s: Sequence[float],
    steps: int,
    previous: Sequence[Candidate] = (),
    order: SearchOrder = ALL,
) -> Search:
    """Find the best `config.max_candidates` homotopy classes between the hand and the goals.

    Those are left out that are more than `config.max_detour` times as long as the shortest one to their goal. If there are more
    goals than candidates, the search finds one class to each goal, up to `MOST_CANDIDATES`. Obstacles are grown by
    `config.clearance`. The uncertainty of the radius is left to the chance constraint, which weighs it by eta.

    Parameters
    ----------
    hand_mean : Array
        State mean (6,), SI units.
    goals : Array
        Positions (g, 2) [m].
    obstacles : Obstacles
        The obstacles, where they are now. The search takes moving ones where they are when the hand passes them.
    config : HomotopyConfig
        Number of candidates, largest detour and clearance.
    duration_s : Sequence[float]
        Time to go to each goal [s].
    steps : int
        Number N of time steps of the guesses.
    previous : Sequence[Candidate], optional
        Candidates of the previous prediction. They stay unless others are clearly better. Where the deadline leaves no time to
        search, they are returned as they are.
    order : SearchOrder, optional
        The deadline, and the goal at which the search begins. The first class to this goal, and to each goal without a previous
        candidate, is searched whatever the time, and `LEAST` more. Its objects do not block the ways to their goals.

    Returns
    -------
    Search
        Candidates and notes.

    Raises
    ------
    SceneError
        If the arguments do not fit each other.
    """
    if hand_mean.shape != (6,) or goals.ndim != 2 or goals.shape[1] != 2:
        raise SceneError('hand_mean, goals', 'arrays (6,) and (g, 2)', f'{hand_mean.shape} and {goals.shape}')
    if len(duration_s) != len(goals):
        raise SceneError('duration_s', f'one for each of the {len(goals)} goals', len(duration_s))
    if not len(goals):
        return Search(())
    scene = SearchScene(hand_mean, goals, obstacles, config, duration_s, steps, previous, order.objects)
    ranking = _Ranking(scene, previous, config.max_detour, order.deadline)
    next_goal = ranking.find_bests(sorted(range(len(goals)), key=lambda goal: (goal < order.first_goal, goal)))
    count = max(config.max_candidates, min(len(goals), MOST_CANDIDATES))
    chosen = ranking.choose(count)
    candidates = scene.make_candidates(chosen)
    signatures, reached = {each.signature for each in chosen}, {each.goal for each in chosen}
    seen = {each.label: each for each in ranking.seen}
    others = [
        each for each in seen.values() if each.goal not in reached or not any(each.signature <= other for other in signatures)
    ]
    unfollowed = scene.make_candidates(tuple(others))
    notes = {name: number for name, number in scene.notes.items() if number}
    return Search(candidates, notes, next_goal, unfollowed, scene.list_named())


class _Ranking:
    """Finds and ranks classes to all goals.

    A class ranks by its key, which is multiplied by STAY if it was followed in the previous prediction, under any name, and by
    REPEAT if it passes the obstacles as the shortest class to another goal does, or one that ranks before it. One that is more
    than max_detour times as long as the shortest one to its goal is not chosen. seen: classes that were found, among them all
    that are not chosen.
    """

    def __init__(self, scene: SearchScene, previous: Sequence[Candidate], max_detour: float, deadline: Deadline) -> None:
        self._scene, self._max_detour, self._deadline = scene, max_detour, deadline
        self._followed, self._signatures = {each.label for each in previous}, defaultdict[int, set[Signature]](set)
        for each in previous:
            self._signatures[each.goal].add(frozenset(each.sides))
        self._bests: list[PathClass] = []
        self._shortest: list[PathClass] = []
        self._others: list[Iterable[PathClass]] = []
        self.seen: list[PathClass] = []

    def find_bests(self, goals: Sequence[int]) -> int:
        """Find the best class to each of some goals; return the first goal for which there was no time, or 0.

        Only a goal that has a class from the previous prediction may have to wait, and never the first one.
        """
        next_goal, longest_s = 0, 0.0
        for goal in goals:
            known = [each for each in self._scene.known if each.goal == goal]
            if known and goal != goals[0] and self._deadline.left_s < longest_s:
                next_goal = next_goal if self._scene.notes['search_late'] else goal
                self._scene.notes['search_late'] += 1
                self._bests.append(known[0])
                self._shortest.append(known[0])
                continue
            began = time.perf_counter()
            self._find_best(goal)
            longest_s = max(longest_s, time.perf_counter() - began)
        return next_goal

    def _find_best(self, goal: int) -> None:
        """Find the best class to a goal: the shortest one, unless one that was followed is nearly as short."""
        stream, seen = self._scene.find_classes(goal, self._deadline), list[PathClass]()
        awaited = {label for label in self._followed if label.startswith(f'goal{goal}:')}
        for found in stream:
            seen.append(found)
            awaited.discard(found.label)
            if not awaited or seen[0].label in self._followed or STAY * found.key > seen[0].key:
                break
        if seen:
            best = min(seen, key=self._rank)
            self._bests.append(best)
            self._shortest.append(seen[0])
            others = chain([each for each in seen if each is not best], stream)
            self._others.append(self._leave_out_detours(others, seen[0].key))
        self._scene.notes['no_way'] += not seen

    def _leave_out_detours(self, stream: Iterable[PathClass], shortest: float) -> Iterator[PathClass]:
        """Yield the classes of a stream that are not much longer than the shortest one [m]."""
        longest = self._max_detour * shortest
        for found in stream:
            if self._rank(found)[0] <= longest:
                yield found
            else:
                self.seen.append(found)
                if STAY * found.key > longest:
                    break

    def choose(self, count: int) -> list[PathClass]:
        """Choose some classes, shortest first: the best one to each goal, as far as there is room, then others by their rank.

        If the time ends, known classes of the previous prediction take the place of those that were not found again.
        """
        bests = sorted(self._bests, key=self._rank)[:count]
        before = [(each.goal, each.signature) for each in self._shortest]
        chosen, labels, room = list[tuple[float, str, PathClass]](), {each.label for each in bests}, count - len(bests)

        def add(found: PathClass) -> None:
            is_repeated = any(goal != found.goal and agrees(found.signature, other) for goal, other in before)
            factor = REPEAT if is_repeated else 1.0
            insort(chosen, (factor * self._rank(found)[0], found.label, found))
            before.append((found.goal, found.signature))
            labels.add(found.label)

        is_late, others = False, merge(*self._others)
        for found in others if room else ():
            self.seen.append(found)
            if len(chosen) >= room and found.key * (1.0 if labels.issuperset(self._followed) else STAY) > chosen[room - 1][0]:
                break
            add(found)
            is_late = len(chosen) >= LEAST and self._deadline.has_passed
            if is_late:
                break
        self._scene.notes['search_late'] += is_late
        self.seen += self._bests if is_late else [*self._bests, *self._find_more(others)]
        if self._scene.notes['search_late']:
            # beside others to its goal, a class has to have the same obstacles in its name, so that no class comes twice
            found_now = [found for *_, found in chosen]
            named = {each.goal: each.named for each in [*bests, *found_now]}
            known = [each for each in self._scene.known if each.label not in labels and named.get(each.goal) == each.named]
            # where there is no time to find classes, there is none to solve more than before
            room = min(room, max(LEAST, len(self._followed) - len(bests)))
            chosen.clear()
            del before[len(self._shortest) :]
            for each in sorted([*found_now, *known], key=lambda each: each[:2]):
                add(each)
        return sorted([*bests, *[found for *_, found in chosen[:room]]])

    def _find_more(self, others: Iterable[PathClass]) -> list[PathClass]:
        """Find some classes more than are chosen, as long as there is time."""
        found = list[PathClass]()
        for each in others:
            found.append(each)
            if len(found) == MOST_UNFOLLOWED or self._deadline.has_passed:
                break
        return found

    def _rank(self, found: PathClass) -> tuple[float, str]:
        is_followed = any(agrees(found.signature, other) for other in self._signatures[found.goal])
        return found.key * (STAY if is_followed else 1.0), found.label
