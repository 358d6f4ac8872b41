"""The search for homotopy classes: hand, goals and obstacles in; named candidates, each with a timed initial guess, out."""

from __future__ import annotations

import time
from bisect import insort
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from heapq import merge
from itertools import chain
from typing import NamedTuple

from foc_ros.core.config import MOST_CANDIDATES, HomotopyConfig
from foc_ros.core.deadline import NEVER, Deadline
from foc_ros.core.errors import SceneError
from foc_ros.core.types import Array, Candidate, Obstacles

from .names import name_course
from .scene import PathClass, SearchScene

REPEAT = 1.5
"""A class that passes all obstacles as a class to another goal does ranks as if it were this times as long: it adds little."""
STAY = 0.95
"""A class of the previous prediction ranks as if it were this times as long: noise does not swap classes of equal length."""


class Turn(NamedTuple):
    """How long a search may take, and the goal (row) at which it begins, so that all goals have their turn if time is short."""

    deadline: Deadline = NEVER
    first_goal: int = 0


ALL = Turn()


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
    """

    candidates: tuple[Candidate, ...]
    notes: dict[str, int] = field(default_factory=dict)
    next_goal: int = 0


def search(
    hand_mean: Array,
    goals: Array,
    obstacles: Obstacles,
    config: HomotopyConfig,
    duration_s: Sequence[float],
    steps: int,
    previous: Sequence[Candidate] = (),
    turn: Turn = ALL,
) -> Search:
    """Find the best `config.max_candidates` homotopy classes between the hand and the goals.

    If there are more goals than that, the search finds one class to each goal, up to `MOST_CANDIDATES`. Obstacles are grown by
    `config.clearance`. The uncertainty of the radius is left to the chance constraint, which weighs it by eta.

    Parameters
    ----------
    hand_mean : Array
        State mean (6,), SI units.
    goals : Array
        Positions (g, 2) [m].
    obstacles : Obstacles
        The obstacles, where they are now.
    config : HomotopyConfig
        Number of candidates and clearance.
    duration_s : Sequence[float]
        Time to go to each goal [s].
    steps : int
        Number N of time steps of the guesses.
    previous : Sequence[Candidate], optional
        Candidates of the previous prediction. They stay unless others are clearly better. Where the deadline leaves no time to
        search, they are returned as they are.
    turn : Turn, optional
        The deadline, and the goal at which the search begins. The first class to this goal, and to each goal without a previous
        candidate, is searched whatever the time.

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
    scene = SearchScene(hand_mean, goals, obstacles, config, previous)
    names, notes = scene.names, scene.notes
    is_inside = ~names.blocks.all(axis=1)
    notes.update(
        hand_inside=int(names.holds_hand.sum()),
        goal_near=int((names.holds_goal.any(axis=1) & ~is_inside).sum()),
        goal_inside=int(is_inside.sum()),
    )
    known, followed = _list_known(previous, {*obstacles.ids}, len(goals)), {each.label for each in previous}
    bests, courses, others, next_goal = _find_bests(scene, len(goals), known, followed, turn)
    count = max(config.max_candidates, min(len(goals), MOST_CANDIDATES))
    kept = sorted(bests, key=lambda each: _rank(each, followed))[:count]
    chosen = [*kept, *_choose_others(scene, kept, courses, others, known, count - len(kept), followed, turn.deadline)]
    candidates = scene.make_candidates(sorted(chosen), duration_s, steps)
    return Search(candidates, {name: number for name, number in notes.items() if number}, next_goal)


def _list_known(previous: Sequence[Candidate], ids: Collection[str], goals: int) -> list[PathClass]:
    """Return the classes of previous candidates that still fit the scene, in the order of their length."""
    known = [
        PathClass(each.length, each.label, each.goal, name_course(each.sides), each.sides, each.guess, each)
        for each in previous
        if each.goal < goals and all(identity in ids for identity, _ in each.sides)
    ]
    return sorted(known, key=lambda each: each[:2])


def _rank(found: PathClass, followed: Collection[str]) -> tuple[float, str]:
    """Return by what a class is compared with others to the same goal; followed: labels of the previous prediction."""
    return found.key * (STAY if found.label in followed else 1.0), found.label


def _find_bests(
    scene: SearchScene, goals: int, known: Sequence[PathClass], followed: Collection[str], turn: Turn
) -> tuple[list[PathClass], dict[str, int], list[Iterable[PathClass]], int]:
    """Return the best class to each goal, the goals by the courses of their shortest classes, the other classes, a goal left out.

    A goal that has a known class is left out if there is no time, unless it is the one at which the search begins.
    """
    bests, firsts, others, next_goal, longest_s = list[PathClass](), list[PathClass](), list[Iterable[PathClass]](), 0, 0.0
    for goal in sorted(range(goals), key=lambda goal: (goal < turn.first_goal, goal)):
        best_known = min((each for each in known if each.goal == goal), key=lambda each: _rank(each, followed), default=None)
        if longest_s and best_known is not None and turn.deadline.left_s < longest_s:
            next_goal = next_goal if scene.notes['search_late'] else goal
            scene.notes['search_late'] += 1
            bests.append(best_known)
            firsts.append(best_known)
            continue
        began, seen, stream = time.perf_counter(), list[PathClass](), scene.find_classes(goal, turn.deadline)
        awaited = {label for label in followed if label.startswith(f'goal{goal}:')}
        for found in stream:
            seen.append(found)
            awaited.discard(found.label)
            if not awaited or seen[0].label in followed or STAY * found.key > seen[0].key:
                break
        if seen:
            bests.append(min(seen, key=lambda each: _rank(each, followed)))
            firsts.append(seen[0])
            others.append(chain([each for each in seen if each is not bests[-1]], stream))
        scene.notes['no_way'] += not seen
        longest_s = max(longest_s, time.perf_counter() - began)
    courses = {each.course: each.goal for each in sorted(firsts, key=lambda each: each[:2], reverse=True)}
    return bests, courses, others, next_goal


def _choose_others(
    scene: SearchScene,
    bests: Sequence[PathClass],
    courses: Mapping[str, int],
    streams: Sequence[Iterable[PathClass]],
    known: Sequence[PathClass],
    room: int,
    followed: Collection[str],
    deadline: Deadline,
) -> list[PathClass]:
    """Choose as many classes as there is room for, besides the best one to each goal.

    They rank by their keys, multiplied by REPEAT or STAY where they apply. If the time ends, known classes of the previous
    prediction take the place of those that were not found again.
    """
    goal_of_course, labels = dict(courses), {each.label for each in bests}
    chosen = list[tuple[float, str, PathClass]]()

    def add(found: PathClass) -> None:
        factor = REPEAT if goal_of_course.setdefault(found.course, found.goal) != found.goal else 1.0
        insort(chosen, (_rank(found, followed)[0] * factor, found.label, found))
        labels.add(found.label)

    is_late = deadline.has_passed
    for found in merge(*streams) if room and not is_late else ():
        factor = STAY if not labels.issuperset(followed) else 1.0
        if len(chosen) >= room and factor * found.key > chosen[room - 1][0]:
            break
        add(found)
        is_late = deadline.has_passed
        if is_late:
            break
    scene.notes['search_late'] += is_late
    if scene.notes['search_late']:
        names = {each.goal: {identity for identity, _ in each.sides} for each in [*bests, *[each for *_, each in chosen]]}
        for each in known:
            # beside others to its goal, a class has to have the same obstacles in its name, so that no class comes twice
            if each.label not in labels and names.get(each.goal) == {identity for identity, _ in each.sides}:
                add(each)
    return [each for *_, each in chosen[:room]]
