"""The questions that are put to a prediction, the possible answers, and the true one.

- `way`: in which homotopy class will the hand pass the obstacles still ahead?
- `gap`: the same for the next row of obstacles only.
- `goal`: which goal will it reach?

A question is put only where at least two answers are possible: rows of m_1, m_2, ... obstacles have (m_1 + 1)(m_2 + 1)... unless
a gap is too narrow for the hand, and g goals have g. Candidates may also weave through a row; such an answer can be given, but a
uniform guess does not count it.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from foc_ros.core.types import Record

from .ground_truth import Sides
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
    found: set[str] = set()
    for each in recording.observations:
        found.update(each.ids[row] for row in np.flatnonzero(each.candidates.is_named.any(axis=0)))
    return frozenset(found)


def ask(name: str, observation: Observation, relevant: frozenset[str]) -> Question | None:
    """Return a question about the relevant obstacles, None where fewer than two answers are possible or the truth is unknown."""
    if name == GOAL:
        return _ask_goal(observation)
    is_relevant = np.array([identity in relevant for identity in observation.ids], dtype=bool)
    ahead = np.flatnonzero(observation.truth.is_ahead & is_relevant)
    if name == GAP and len(ahead):
        ahead = ahead[observation.row[ahead] == observation.row[ahead].min()]
    if not len(ahead):
        return None
    through = [np.unique(gaps[:, members], axis=0) for gaps, members in _split_by_row(observation, ahead)]
    possible = int(np.prod([len(each) for each in through]))
    if possible < 2:
        return None
    given = [tuple(each) for each in observation.candidates.sides[:, ahead].tolist()]
    answers, indices = _index_answers([*given, tuple(observation.truth.sides[ahead].tolist())])
    is_possible = np.array([_leads_through_one_gap_each(answer, observation, ahead) for answer in answers])
    return Question(name, ahead, possible, answers, indices[:-1], is_possible, int(indices[-1]))


def _ask_goal(observation: Observation) -> Question | None:
    count = len(observation.goals)
    if observation.truth.goal is None or count < 2:
        return None
    answers, given = tuple((goal,) for goal in range(count)), observation.candidates.goal.astype(np.intp)
    return Question(GOAL, np.zeros(0, dtype=np.intp), count, answers, given, np.ones(count, dtype=bool), observation.truth.goal)


def _index_answers(given: Iterable[Answer]) -> tuple[tuple[Answer, ...], NDArray[np.intp]]:
    indices: dict[Answer, int] = {}
    order = [indices.setdefault(answer, len(indices)) for answer in given]
    return tuple(indices), np.array(order, dtype=np.intp)


def _split_by_row(observation: Observation, ahead: NDArray[np.intp]) -> Iterator[tuple[Sides, NDArray[np.intp]]]:
    """Yield for each row ahead the sides of its open gaps, and its obstacles among those ahead."""
    for number in np.unique(observation.row[ahead]):
        yield observation.gaps[number], ahead[observation.row[ahead] == number]


def _leads_through_one_gap_each(answer: Answer, observation: Observation, ahead: NDArray[np.intp]) -> bool:
    """Tell whether sides lead through one open gap of each row."""
    sides = np.zeros(len(observation.ids), dtype=np.int8)
    sides[ahead] = answer
    return all((gaps[:, members] == sides[members]).all(axis=1).any() for gaps, members in _split_by_row(observation, ahead))
