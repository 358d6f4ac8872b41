"""The search for ways round: hand, goals and obstacles in; named candidates, each with a timed guess, out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from foc_ros.core.config import MOST_CANDIDATES, HomotopyConfig
from foc_ros.core.errors import SceneError
from foc_ros.core.types import Array, Candidate, Obstacles

from .classes import NOTES, Classes, Quest
from .guesses import guesses
from .levels import IncrementalRoadmap
from .names import names_of
from .scene import scene
from .selection import select
from .taut import AT

STATES, STATES_PER_CANDIDATE = 1000, 300
"""States that the search for one goal may look at: a few dozen are enough for four candidates."""
SPARE_WAYS = 2
"""Ways to one goal that are looked for at first, beside those that there is room for after the first to each: that first one, and
one that tells that no more are short enough."""


@dataclass(frozen=True)
class Search:
    """candidates: shortest first; notes: what was decided on the way, as counts by name, none that is 0.

    hand_inside: obstacles whose margin holds the hand; goal_near: goals in an obstacle's margin; goal_inside: goals inside an
    obstacle, which get no candidates; no_way: other goals without any; left_out: classes that circles beyond the last roadmap
    were in the way of; search_cut: goals whose search ended at its bound.
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
    """Find the best config.max_candidates classes between the hand and the goals.

    Of more goals it is one to each, up to `MOST_CANDIDATES`.

    hand_mean (6,): state mean, SI units; goals (g, 2) [m]; duration_s: time to go to each goal [s]; steps: N of the guesses;
    previous: the candidates of the tick before, which stay where others are not clearly better. Obstacles are circles of radius
    + config.clearance: what their size is uncertain by is left to the chance constraint, which weighs it by eta. Raises
    SceneError where the arguments do not fit each other.
    """
    if hand_mean.shape != (6,) or goals.ndim != 2 or goals.shape[1] != 2:
        raise SceneError('hand_mean, goals', 'arrays (6,) and (g, 2)', f'{hand_mean.shape} and {goals.shape}')
    if len(duration_s) != len(goals):
        raise SceneError('duration_s', f'one for each of the {len(goals)} goals', len(duration_s))
    x, y, v_x, v_y = hand_mean[:4].tolist()
    hand, velocity, names = complex(x, y), complex(v_x, v_y), names_of(obstacles.ids)
    view = scene(hand, np.ascontiguousarray(goals, dtype=float).view(complex)[:, 0], obstacles, config.clearance, previous)
    sizes = [radius.tobytes() for radius in view.radius]
    levels = {size: IncrementalRoadmap(view, radius) for size, radius in zip(sizes, view.radius, strict=True)}
    reachable = [goal for goal, inside in enumerate(view.inside.tolist()) if not inside]
    # a goal without a candidate could never be foretold
    count = max(config.max_candidates, min(len(reachable), MOST_CANDIDATES))
    states, usual = STATES + STATES_PER_CANDIDATE * config.max_candidates, max(count - len(reachable), 0) + SPARE_WAYS
    quest, notes = Quest(view, velocity, names, states, usual), dict.fromkeys(NOTES, 0)
    classes = [Classes(quest, levels[sizes[goal]], goal, notes) for goal in reachable]
    chosen = select(classes, count, {candidate.label for candidate in previous})
    notes |= {'hand_inside': int(np.count_nonzero(view.held)), 'goal_inside': len(goals) - len(reachable)}
    notes['goal_near'], notes['no_way'] = view.close, sum(to_goal.none for to_goal in classes)
    candidates = tuple(
        Candidate(one.label, one.goal, tuple(zip(one.ids, one.sides, strict=True)), path, float(one.pieces[-1, AT]))
        for one, path in zip(chosen, guesses(view, velocity, chosen, duration_s, steps), strict=True)
    )
    return Search(candidates, {name: count for name, count in notes.items() if count})
