"""What a prediction is asked, which answers are open, and which one came true.

- `way`: on which sides will the hand pass the obstacles still ahead?
- `gap`: the same for the next row of obstacles only.
- `goal`: which goal will it reach?

Asked only where at least two answers are open: of rows with m_1, m_2, ... obstacles (m_1 + 1)(m_2 + 1)..., of g goals g.
Candidates may also weave through a row; such an answer can be given, but is not among the open ones that a guess is spread over.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from foc_ros.core.types import LEFT, Record

from .observations import Observation, Observations

WAY, GAP, GOAL = 'way', 'gap', 'goal'

Answer = tuple[int, ...]
"""Sides of the obstacles asked about, LEFT or RIGHT, in their order; or the row of a goal."""


@dataclass(frozen=True, eq=False)
class Question(Record):
    """One question to one prediction.

    name; obstacles (a,): rows of those asked about; open: number of open answers; answers: those that a candidate gives, and the
    true one; given (k,): which of these each candidate gives; is_open: whether each is one of the open ones; truth: the place of
    the true one.
    """

    name: str
    obstacles: NDArray[np.intp]
    open: int
    answers: tuple[Answer, ...]
    given: NDArray[np.intp]
    is_open: NDArray[np.bool_]
    truth: int

    @property
    def unlisted(self) -> int:
        """Number of open answers that no candidate gives and that did not come true."""
        return max(self.open - int(self.is_open.sum()), 0)


def relevant(recording: Observations) -> frozenset[str]:
    """Return the obstacles that matter in a recording: those in the name of any candidate."""
    found: set[str] = set()
    for each in recording.each:
        found.update(each.ids[row] for row in np.flatnonzero(each.ways.named.any(axis=0)))
    return frozenset(found)


def question(name: str, seen: Observation, obstacles: frozenset[str]) -> Question | None:
    """Return a question, None where fewer than two answers are open or the truth is not known; obstacles: those that matter."""
    if name == GOAL:
        return _about_goals(seen)
    ahead = np.flatnonzero(seen.truth.ahead & np.array([identity in obstacles for identity in seen.ids], dtype=bool))
    if name == GAP and len(ahead):
        ahead = ahead[seen.row[ahead] == seen.row[ahead].min()]
    if not len(ahead):
        return None
    _, members = np.unique(seen.row[ahead], return_counts=True)
    given = [tuple(each) for each in seen.ways.sides[:, ahead].tolist()]
    truth = tuple(seen.truth.sides[ahead].tolist())
    answers, places = _listed([*given, truth])
    opened = np.array([_is_open(answer, seen, ahead) for answer in answers])
    return Question(name, ahead, int(np.prod(members + 1)), answers, places[:-1], opened, int(places[-1]))


def _about_goals(seen: Observation) -> Question | None:
    if seen.truth.goal is None or len(seen.goals) < 2:
        return None
    answers = tuple((goal,) for goal in range(len(seen.goals)))
    none = np.zeros(0, dtype=np.intp)
    everyone = np.ones(len(answers), dtype=bool)
    return Question(GOAL, none, len(answers), answers, seen.ways.goal.astype(np.intp), everyone, seen.truth.goal)


def _listed(given: Iterable[Answer]) -> tuple[tuple[Answer, ...], NDArray[np.intp]]:
    places: dict[Answer, int] = {}
    order = [places.setdefault(answer, len(places)) for answer in given]
    return tuple(places), np.array(order, dtype=np.intp)


def _is_open(answer: Answer, seen: Observation, ahead: NDArray[np.intp]) -> bool:
    """Tell whether sides lead through one gap of each row: left of some obstacles from the right on, right of all the others."""
    aside = seen.centre[ahead] @ np.array([-seen.along[1], seen.along[0]])
    for row in np.unique(seen.row[ahead]):
        members = np.flatnonzero(seen.row[ahead] == row)
        passes = [answer[member] == LEFT for member in members[np.argsort(aside[members], kind='stable')]]
        if any(later and not earlier for earlier, later in pairwise(passes)):
            return False
    return True
