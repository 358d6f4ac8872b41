# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The questions that are put to a prediction, with the answers of its candidates and the true one.

- `way`: in which homotopy class will the hand pass the obstacles still ahead?
- `gap`: the same for the next row of obstacles only.
- `goal`: which goal will it reach?

In a row of m obstacles (`rows`) a path that does not turn back takes one of m + 1 gaps, so that rows of m_1, m_2, ... obstacles
leave (m_1 + 1)(m_2 + 1)... homotopy classes. A gap that is too narrow for the hand is none. A question is put only where at least
two answers are possible. Candidates may also weave through a row; such an answer can be given, but a uniform guess does not count
it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from foc_ros.core.types import Record

from .observations import Observation, ObservedRecording

PATH_CLASS, GAP, GOAL = 'way', 'gap', 'goal'
Answer = tuple[int, ...]
"""Sides of the obstacles in question, LEFT or RIGHT, in their order; or the row of a goal."""
Questions = list[tuple[Observation, 'Question']]


@dataclass(frozen=True, eq=False)
class Question(Record):
    """One question to one prediction.

    name; obstacles (a,): rows of those in question; possible: number of possible answers; answers: those that a candidate gives,
    and the true one; given (k,): index of the answer of each candidate; is_possible: whether each answer is one of the possible
    ones; truth: index of the true answer.
    """

    name: str
    obstacles: NDArray[np.intp]
    possible: int
    answers: tuple[Answer, ...]
    given: NDArray[np.intp]
    is_possible: NDArray[np.bool_]
    truth: int

    @property
    def unlisted(self) -> int:
        """Number of possible answers that no candidate gives and that are not the true one."""
        return max(self.possible - int(self.is_possible.sum()), 0)


def ask_all(recording: ObservedRecording, name: str) -> Questions:
    """Return a question with every observation of a recording to which it can be put."""
    relevant = find_relevant_obstacles(recording)
    pairs = ((observation, ask(name, observation, relevant)) for observation in recording.observations)
    return [(observation, question) for observation, question in pairs if question is not None]


def ask_main(recording: ObservedRecording) -> Questions:
    """Return the questions that one set of parameters is fitted to: path classes, or goals where no path class is in question."""
    return ask_all(recording, PATH_CLASS) or ask_all(recording, GOAL)


def find_relevant_obstacles(recording: ObservedRecording) -> frozenset[str]:
    """Return the obstacles that are in the label of any candidate of a recording."""
    return frozenset[str]().union(*(each.candidates.named for each in recording.observations))


def ask(name: str, observation: Observation, relevant: frozenset[str]) -> Question | None:
    """Return a question about the relevant obstacles, None where fewer than two answers are possible or the truth is unknown."""
    truth, candidates = observation.truth, observation.candidates
    if name == GOAL:
        count = len(observation.goals)
        if truth.goal is None or count < 2:
            return None
        answers, given = tuple((goal,) for goal in range(count)), candidates.goal.astype(np.intp)
        return Question(GOAL, np.zeros(0, dtype=np.intp), count, answers, given, np.ones(count, dtype=bool), truth.goal)
    is_relevant = np.array([identity in relevant for identity in observation.ids], dtype=bool)
    ahead = np.flatnonzero(truth.is_ahead & is_relevant)
    if name == GAP and len(ahead):
        ahead = ahead[observation.row[ahead] == observation.row[ahead].min()]
    indices: dict[Answer, int] = {}
    rows = [indices.setdefault(tuple(sides), len(indices)) for sides in candidates.sides[:, ahead].tolist()]
    true = indices.setdefault(tuple(truth.sides[ahead].tolist()), len(indices))
    listed, row = np.array([*indices]), observation.row[ahead]
    possible, is_possible = 1, np.ones(len(listed), dtype=bool)
    for number in np.unique(row):
        gaps = np.unique(observation.gaps[number][:, ahead[row == number]], axis=0)
        possible *= len(gaps)
        is_possible &= (listed[:, None, row == number] == gaps).all(axis=2).any(axis=1)
    if possible < 2:
        return None
    return Question(name, ahead, possible, tuple(indices), np.array(rows, dtype=np.intp), is_possible, true)
