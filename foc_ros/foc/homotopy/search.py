"""The search for ways round: hand, goals and obstacles in; named candidates, each with a timed guess, out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from foc_ros.foc.config import MOST_CANDIDATES, HomotopyConfig
from foc_ros.foc.errors import SceneError
from foc_ros.foc.records import Array, Candidate, Obstacles

from .classes import NOTES, Classes
from .guesses import guesses
from .levels import Levels
from .scene import scene
from .selection import select

STATES, STATES_PER_CANDIDATE = 1000, 300
"""States that the search for one goal may look at: a few dozen are enough for four candidates."""
WAYS_PER_CANDIDATE = 2
"""Ways that are looked for at first: some beyond the candidates tell that no more are short enough."""


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
    hand, velocity = complex(*hand_mean[:2]), complex(*hand_mean[2:4])
    view = scene(hand, np.ascontiguousarray(goals, dtype=float).view(complex)[:, 0], obstacles, config.clearance, previous)
    levels = {radius.tobytes(): Levels(view, radius, velocity) for radius in view.radius}
    states = STATES + STATES_PER_CANDIDATE * config.max_candidates
    reachable = np.flatnonzero(~view.inside).tolist()
    usual = WAYS_PER_CANDIDATE * config.max_candidates
    classes = [Classes(view, levels[view.radius[goal].tobytes()], goal, obstacles.ids, states, usual) for goal in reachable]
    # a goal without a candidate could never be foretold
    count = max(config.max_candidates, min(len(classes), MOST_CANDIDATES))
    chosen = select(classes, count, {candidate.label for candidate in previous})
    notes = {name: sum(to_goal.notes[name] for to_goal in classes) for name in NOTES}
    notes |= {'hand_inside': int(np.count_nonzero(view.held)), 'goal_inside': int(np.count_nonzero(view.inside))}
    notes['goal_near'] = int(np.count_nonzero(view.near.any(axis=1) & ~view.inside))
    candidates = tuple(
        Candidate(one.rank[1], one.goal, one.sides, path, length)
        for one, (path, length) in zip(chosen, guesses(view, velocity, chosen, duration_s, steps), strict=True)
    )
    return Search(candidates, {name: count for name, count in notes.items() if count})
