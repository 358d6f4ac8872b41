"""All predictors judged on all recordings; what is fitted is judged on recordings that it was not fitted to."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from foc_ros.core.config import LikelihoodConfig
from foc_ros.core.errors import RecordingError
from foc_ros.core.types import Array
from foc_ros.io.terminal import track

from .families import baseline_grids
from .heldout import Family, asked_about, chosen, log_likelihoods
from .observations import Observation, Observations
from .positions import position_scores
from .questions import GAP, GOAL, WAY, Question
from .scores import Judged, judge
from .workers import Failure, run

FITTED_TO = {WAY: WAY, GAP: WAY, GOAL: GOAL}
"""The question whose answers a predictor's setting is chosen by, for each question that it is judged by."""


@dataclass(frozen=True)
class Evaluation:
    """How all predictors did.

    judged: by question, then by predictor; settings: by question that they are fitted to, then by predictor, those that are
    best on all recordings; positions: scores of predicted positions.
    """

    judged: Mapping[str, Mapping[str, Judged]]
    settings: Mapping[str, Mapping[str, Any]]
    positions: Mapping[str, Any]


def evaluate(recordings: Sequence[Observations], published: LikelihoodConfig, executor: Executor) -> Evaluation:
    """Judge all predictors on recordings, one at least; published: the likelihood that they were replayed with."""
    compared = baseline_grids(recordings, published)
    tables = tabulated(recordings, compared, executor)
    names = [recording.name for recording in recordings]
    judged: dict[str, dict[str, Judged]] = {}
    for name, fitted_to in FITTED_TO.items():
        pairs = [(number, *pair) for number, recording in enumerate(recordings) for pair in asked_about(recording, name)]
        if pairs:
            judged[name] = {
                family.name: _judged(family, chosen(tables[fitted_to, family.name], names), pairs) for family in compared
            }
    settings = {
        name: {family.name: family.settings[int(tables[name, family.name].sum(axis=0).argmax())] for family in compared}
        for name in (WAY, GOAL)
        if name in judged
    }
    return Evaluation(judged, settings, position_scores(recordings))


def tabulated(recordings: Sequence[Observations], compared: Sequence[Family], executor: Executor) -> dict[tuple[str, str], Array]:
    """Return the log-likelihood of each recording (r) with each setting (s) of every family, (r, s) by question and name."""
    items = [(recording.name, (recording, tuple(compared))) for recording in recordings]
    rows: list[dict[tuple[str, str], Array]] = []
    for name, row in track(run(_row, items, executor), 'compare', len(items)):
        if isinstance(row, Failure):
            raise RecordingError(f'{name}: {row.reason}')
        rows.append(row)
    return {key: np.array([row[key] for row in rows]) for key in rows[0]}


def _row(item: tuple[Observations, tuple[Family, ...]]) -> dict[tuple[str, str], Array]:
    recording, compared = item
    pairs = {name: asked_about(recording, name) for name in (WAY, GOAL)}
    return {(name, family.name): log_likelihoods(pairs[name], family) for name in pairs for family in compared}


def _judged(family: Family, places: NDArray[np.intp], pairs: Sequence[tuple[int, Observation, Question]]) -> Judged:
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
