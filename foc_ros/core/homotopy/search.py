"""The search for homotopy classes: hand, goals and obstacles in; named candidates, each with a timed initial guess, out."""

from __future__ import annotations

import time
from bisect import insort
from collections import Counter
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from heapq import merge
from itertools import chain
from typing import NamedTuple

import numpy as np

from foc_ros.core.config import MOST_CANDIDATES, HomotopyConfig
from foc_ros.core.deadline import NEVER, Deadline
from foc_ros.core.errors import SceneError
from foc_ros.core.types import Array, Candidate, Obstacles

from .class_search import ClassQuery, PathClass, find_classes
from .guesses import build_guess
from .search_scene import build_search_scene

STATES, STATES_PER_CANDIDATE = 1000, 300
"""Number of states that the search for one goal may look at; a few dozen are enough for four candidates."""
EXPECTED = 5
"""A search for one goal looks for at most so many classes at first: more cost time and are seldom asked for."""
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
        The candidates, shortest first; then previous ones for which there was no time.
    notes : dict[str, int]
        Counts by name, none of them 0. hand_inside: obstacles whose margin holds the hand. goal_near: goals in the margin of an
        obstacle. goal_inside: goals inside an obstacle, which get no candidates. no_way: other goals without candidates.
        left_out: classes whose path meets circles that the largest graph does not contain. search_cut: goals whose search ended
        at the largest number of states. search_late: searches that the deadline ended or prevented.
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

    If there are more goals than that, the search finds one class to each goal, up to `MOST_CANDIDATES`. Obstacles are circles of
    their radius plus `config.clearance`. The uncertainty of the radius is left to the chance constraint, which weighs it by eta.

    Parameters
    ----------
    hand_mean : Array
        State mean (6,), SI units.
    goals : Array
        Positions (g, 2) [m].
    obstacles : Obstacles
        The obstacles.
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
        The deadline, after which the search returns what it has, and the goal at which it begins. Without previous candidates
        it looks for the first class to this goal whatever the time.

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
    hand, velocity = hand_mean[:4].astype(float).reshape(2, 2)
    scene = build_search_scene(hand, goals, obstacles, config.clearance, previous)
    reachable = np.flatnonzero(~scene.is_goal_inside).tolist()
    # a prediction cannot name a goal without a candidate
    count = max(config.max_candidates, min(len(reachable), MOST_CANDIDATES))
    max_states = STATES + STATES_PER_CANDIDATE * config.max_candidates
    notes = Counter(
        hand_inside=int(scene.holds_hand.sum()),
        goal_near=int((scene.holds_goal.any(axis=1) & ~scene.is_goal_inside).sum()),
        goal_inside=len(goals) - len(reachable),
    )
    expected = min(1 + -(-count // max(len(reachable), 1)), EXPECTED)
    order = sorted(reachable, key=lambda goal: (goal < turn.first_goal, goal))
    queries = [ClassQuery(goal, obstacles.ids, velocity, max_states, expected, turn.deadline) for goal in order]
    streams = {query.goal: find_classes(scene, query, notes, not previous and query is queries[0]) for query in queries}
    firsts, next_goal = _find_firsts(streams, {candidate.label for candidate in previous}, turn.deadline, notes)
    # goals that are not searched keep one candidate at least
    reserved = {each.goal for each in previous if each.goal in reachable} - {each.first.goal for each in firsts}
    room = count - len(reserved) if notes['search_late'] else count
    chosen = _select_classes(firsts, room, {candidate.label for candidate in previous}, turn.deadline, notes)
    candidates = []
    for one in chosen:
        path = one.lay_out()
        guess = build_guess(scene, path, one.goal, velocity, duration_s[one.goal], steps)
        candidates.append(Candidate(one.label, one.goal, one.sides, guess, path.length))
    if notes['search_late']:
        candidates += _keep_previous(candidates, previous, {*obstacles.ids}, {*reachable})[: count - len(candidates)]
    return Search(tuple(candidates), {name: number for name, number in notes.items() if number}, next_goal)


class Stream(NamedTuple):
    """The classes to one goal.

    first: the best one; rival: one of the previous prediction that is nearly as good, if the first is new; others: the classes
    besides the first, in the order of their rank.
    """

    first: PathClass
    rival: PathClass | None
    others: Iterable[PathClass]


def _find_firsts(
    streams: Mapping[int, Iterator[PathClass]], previous: Collection[str], deadline: Deadline, notes: Counter[str]
) -> tuple[list[Stream], int]:
    """Return the streams of the goals that have classes, and the first goal for which there was no time, or 0.

    streams: classes by goal, in the order of their rank; previous: labels of the previous prediction.
    """
    firsts: list[Stream] = []
    longest_s = 0.0
    for place, (goal, stream) in enumerate(streams.items()):
        began = time.perf_counter()
        if place and deadline.left_s < longest_s:
            notes['search_late'] += len(streams) - place
            return firsts, goal
        late = notes['search_late']
        awaited = {label for label in previous if label.startswith(f'goal{goal}:')}
        seen: list[PathClass] = []
        for found in stream:
            seen.append(found)
            awaited.discard(found.label)
            if not awaited or seen[0].label in previous or STAY * found.key > seen[0].key:
                break
        if seen:
            rival = next((each for each in seen[1:] if each.label in previous and STAY * each.key <= seen[0].key), None)
            firsts.append(Stream(seen[0], rival if seen[0].label not in previous else None, chain(seen[1:], stream)))
        notes['no_way'] += not seen and notes['search_late'] == late
        longest_s = max(longest_s, time.perf_counter() - began)
    return firsts, 0


def _keep_previous(
    candidates: Sequence[Candidate], previous: Sequence[Candidate], ids: Collection[str], goals: Collection[int]
) -> list[Candidate]:
    """Return the previous candidates that still fit the scene, to goals not searched to the end; first one to each goal.

    Beside new classes to its goal, a candidate has to have the same obstacles in its name, so that no class comes twice.
    """
    labels, names = {each.label for each in candidates}, {each.goal: _list_ids(each) for each in candidates}
    kept = [
        each
        for each in previous
        if each.label not in labels
        and each.goal in goals
        and _list_ids(each) <= {*ids}
        and names.get(each.goal, _list_ids(each)) == _list_ids(each)
    ]
    count = Counter(each.goal for each in candidates)
    places = []
    for each in kept:
        places.append(count[each.goal])
        count[each.goal] += 1
    return [kept[row] for row in sorted(range(len(kept)), key=places.__getitem__)]


def _list_ids(candidate: Candidate) -> set[str]:
    return {identity for identity, _ in candidate.sides}


def _select_classes(
    streams: Sequence[Stream], count: int, previous: Collection[str], deadline: Deadline, notes: Counter[str]
) -> list[PathClass]:
    """Choose `count` classes.

    The best class to each goal is chosen first, the shortest of these if there is no room for all. The rest is chosen by
    length, multiplied by REPEAT or STAY where they apply. A rival of the best class to a goal for which there is no room takes
    its place. previous: labels of the previous prediction.
    """
    kept = sorted(streams, key=lambda stream: _rank(stream.rival or stream.first, previous))[:count]
    room = count - len(kept)
    goal_of_course = {each.first.course: each.first.goal for each in sorted(kept, key=lambda stream: stream.first)}
    awaited = {*previous} - {each.first.label for each in kept}
    others: list[tuple[float, str, PathClass]] = []
    for found in merge(*[stream.others for stream in streams]) if room else ():
        if len(others) >= room and (STAY if awaited else 1.0) * found.key > others[room - 1][0]:
            break
        factor = REPEAT if goal_of_course.setdefault(found.course, found.goal) != found.goal else 1.0
        insort(others, (found.key * factor * (STAY if found.label in awaited else 1.0), found.label, found))
        awaited.discard(found.label)
        if deadline.has_passed:
            notes['search_late'] += 1
            break
    chosen = [found for _, _, found in others[:room]]
    labels = {found.label for found in chosen}
    firsts = [each.first if each.rival is None or each.rival.label in labels else each.rival for each in kept]
    return sorted([*firsts, *chosen])


def _rank(found: PathClass, previous: Collection[str]) -> tuple[float, str]:
    return found.key * (STAY if found.label in previous else 1.0), found.label
