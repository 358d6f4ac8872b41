"""All predictors judged on all recordings; what is fitted is judged on recordings that it was not fitted to."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from typing import Any

import numpy as np

from foc_ros.foc.config import LikelihoodConfig
from foc_ros.foc.errors import RecordingError
from foc_ros.foc.records import Array
from foc_ros.terminal import track

from .families import families
from .heldout import Family, asked, chosen, log_likelihoods
from .observations import Observation, Observations
from .positions import position_scores
from .questions import GAP, QUESTIONS, Question, question, relevant
from .scores import Judged, judge
from .workers import Failure, run


@dataclass(frozen=True)
class Evaluation:
    """How all predictors did.

    judged: by question, then by predictor; settings: by predictor, the one that is best on all recordings; positions: scores of
    predicted positions.
    """

    judged: Mapping[str, Mapping[str, Judged]]
    settings: Mapping[str, Any]
    positions: Mapping[str, Any]


def evaluate(recordings: Sequence[Observations], published: LikelihoodConfig, executor: Executor) -> Evaluation:
    """Judge all predictors on recordings, one at least; published: the likelihood that they were replayed with."""
    compared = families(recordings, published)
    tables = tabulated(recordings, compared, executor)
    names = [recording.name for recording in recordings]
    judged: dict[str, dict[str, Judged]] = {}
    for name in QUESTIONS:
        pairs = [(number, *pair) for number, recording in enumerate(recordings) for pair in _about(recording, name)]
        if pairs:
            judged[name] = {family.name: _judged(family, tables[family.name], names, pairs) for family in compared}
    best = {family.name: family.settings[int(tables[family.name].sum(axis=0).argmax())] for family in compared}
    return Evaluation(judged, best, position_scores(recordings))


def tabulated(recordings: Sequence[Observations], compared: Sequence[Family], executor: Executor) -> dict[str, Array]:
    """Return the log-likelihood of each recording (r) with each setting (s) of every family, (r, s) by its name."""
    items = [(recording.name, (recording, tuple(compared))) for recording in recordings]
    rows: list[dict[str, Array]] = []
    for name, row in track(run(_row, items, executor), 'compare', len(items)):
        if isinstance(row, Failure):
            raise RecordingError(f'{name}: {row.reason}')
        rows.append(row)
    return {family.name: np.array([row[family.name] for row in rows]) for family in compared}


def _row(item: tuple[Observations, tuple[Family, ...]]) -> dict[str, Array]:
    recording, compared = item
    pairs = asked(recording)
    return {family.name: log_likelihoods(pairs, family) for family in compared}


def _about(recording: Observations, name: str) -> Iterator[tuple[Observation, Question]]:
    matters = relevant(recording)
    for seen in recording.each:
        found = question(name, seen, matters)
        if found is not None:
            yield seen, found


def _judged(family: Family, table: Array, names: Sequence[str], pairs: Sequence[tuple[int, Observation, Question]]) -> Judged:
    places = chosen(table, names)
    return judge(
        [
            (
                number,
                seen.truth.approach if about.name == GAP else seen.truth.progress,
                about,
                family.forecast(seen, about, family.settings[places[number]]),
            )
            for number, seen, about in pairs
        ]
    )
