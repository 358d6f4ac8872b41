"""The search for homotopy classes: hand, goals and obstacles in; named candidates, each with a timed initial guess, out."""

from __future__ import annotations

from bisect import insort
from collections import Counter
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, field
from heapq import merge
from itertools import islice

import numpy as np

from foc_ros.core.config import MOST_CANDIDATES, HomotopyConfig
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


@dataclass(frozen=True)
class Search:
    """What a search has found.

    Attributes
    ----------
    candidates : tuple[Candidate, ...]
        The candidates, shortest first.
    notes : dict[str, int]
        Counts by name, none of them 0. hand_inside: obstacles whose margin holds the hand. goal_near: goals in the margin of an
        obstacle. goal_inside: goals inside an obstacle, which get no candidates. no_way: other goals without candidates.
        left_out: classes whose path meets circles that the largest graph does not contain. search_cut: goals whose search ended
        at the largest number of states.
    """

    candidates: tuple[Candidate, ...]
    notes: dict[str, int] = field(default_factory=dict)


def search(
    hand_mean: Array,
    goals: Array,
    obstacles: Obstacles,
    config: HomotopyConfig,
    duration_s: Sequence[float],
    steps: int,
    previous: Sequence[Candidate] = (),
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
        Candidates of the previous prediction. They stay unless others are clearly better.

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
    queries = [ClassQuery(goal, obstacles.ids, velocity, max_states, expected) for goal in reachable]
    classes = [find_classes(scene, query, notes) for query in queries]
    chosen = _select_classes(classes, count, {candidate.label for candidate in previous}, notes)
    candidates = []
    for one in chosen:
        path = one.lay_out()
        guess = build_guess(scene, path, one.goal, velocity, duration_s[one.goal], steps)
        candidates.append(Candidate(one.label, one.goal, one.sides, guess, path.length))
    return Search(tuple(candidates), {name: number for name, number in notes.items() if number})


def _select_classes(
    streams: Sequence[Iterator[PathClass]], count: int, previous: Collection[str], notes: Counter[str]
) -> list[PathClass]:
    """Choose `count` classes from those to each goal, which come in the order of their rank.

    The best class to each goal is chosen first, the shortest of these if there is no room for all. The rest is chosen by
    length, multiplied by REPEAT or STAY where they apply. previous: labels of the previous prediction.
    """
    firsts = sorted([found for stream in streams for found in islice(stream, 1)])
    notes['no_way'] = len(streams) - len(firsts)
    firsts = firsts[:count]
    room = count - len(firsts)
    goal_of_course = {found.course: found.goal for found in firsts}
    awaited = {*previous} - {found.label for found in firsts}
    others: list[tuple[float, str, PathClass]] = []
    for found in merge(*streams) if room else ():
        if len(others) >= room and (STAY if awaited else 1.0) * found.key > others[room - 1][0]:
            break
        factor = REPEAT if goal_of_course.setdefault(found.course, found.goal) != found.goal else 1.0
        insort(others, (found.key * factor * (STAY if found.label in awaited else 1.0), found.label, found))
        awaited.discard(found.label)
    return sorted([*firsts, *[found for _, _, found in others[:room]]])
