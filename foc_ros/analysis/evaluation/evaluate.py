"""All predictors scored on all recordings, and the result as plain values for JSON."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import Executor
from dataclasses import asdict, is_dataclass
from pathlib import Path
from typing import Any

import numpy as np

from foc_ros.analysis.box_scenes import read_picked
from foc_ros.analysis.parallel import collect_all
from foc_ros.analysis.recordings import LABELS, TRIALS
from foc_ros.core.config import Config, flatten
from foc_ros.core.types import LEFT, NANOSECONDS, Array
from foc_ros.io.csv_tables import read_rows

from .baselines import PLAIN, PUBLISHED, REFITTED, Baseline, make_baselines
from .cross_validation import choose_held_out, compute_log_likelihoods
from .metrics import Scores, score_forecasts, summarise
from .observations import Observation, ObservedRecording
from .position_metrics import compute_position_scores
from .questions import GAP, GOAL, PATH_CLASS, ask_all
from .verdict import compare_scores, make_verdict

FITTED_TO = {PATH_CLASS: PATH_CLASS, GAP: PATH_CLASS, GOAL: GOAL}
"""The question by whose answers the settings of a predictor are chosen, for each question that it is scored by."""
Table = dict[tuple[str, str], Array]
"""Log-likelihood of each recording (r) under each setting (s), (r, s), by question and predictor."""


def evaluate(recordings: Sequence[ObservedRecording], config: Config, executor: Executor) -> dict[str, Any]:
    """Score all predictors on recordings, at least one, that were replayed with a configuration; return plain values for JSON.

    What is fitted is scored on recordings that it was not fitted to. `questions`: values of `metrics.summarise` by question and
    predictor; for `gap`, tenths and `right_from_half_way` count from row to row, else over the whole movement. `settings`: by
    question and predictor, the best for all recordings. `comparisons`: of the published predictions with each baseline, by
    question. `positions`: values of `position_metrics.compute_position_scores`. `verdict`: sentences.
    """
    baselines = make_baselines(recordings, config.likelihood)
    items = [(recording.name, (recording, baselines)) for recording in recordings]
    tables = collect_all(_tabulate_log_likelihoods, items, executor, 'compare')
    table = {key: np.array([each[key] for each in tables]) for key in tables[0]}
    asked = [name for name in FITTED_TO if any(ask_all(recording, name) for recording in recordings)]
    scores = {
        name: {each.name: _score_held_out(each, table[FITTED_TO[name], each.name], recordings, name) for each in baselines}
        for name in asked
    }
    left_s = {name: _find_times_left(recordings, name) for name in asked}
    answer = {
        'recordings': len(recordings),
        'predictions': sum(len(recording.observations) for recording in recordings),
        'questions': {name: {other: summarise(each, left_s[name]) for other, each in scores[name].items()} for name in asked},
        'comparisons': {
            name: {
                other: compare_scores(scores[name][PUBLISHED], each, is_share=name == GAP)
                for other, each in scores[name].items()
                if other not in (PUBLISHED, REFITTED, PLAIN)
            }
            for name in asked
        },
        'settings': {
            name: {each.name: _make_plain(each.settings[int(table[name, each.name].sum(axis=0).argmax())]) for each in baselines}
            for name in asked
            if name != GAP
        },
        'positions': compute_position_scores(recordings),
        'parameters': flatten(config),
    }
    return answer | {'verdict': make_verdict(answer)}


def _find_times_left(recordings: Sequence[ObservedRecording], name: str) -> Array:
    """Return the time [s] to the end of the movement from each observation to which a question is put, (m,)."""
    return np.array([(each.path.end_ns - seen.stamp_ns) / NANOSECONDS for each in recordings for seen, _ in ask_all(each, name)])


def _tabulate_log_likelihoods(item: tuple[ObservedRecording, Sequence[Baseline]]) -> Table:
    recording, baselines = item
    questions = {name: ask_all(recording, name) for name in (PATH_CLASS, GOAL)}
    return {(name, each.name): compute_log_likelihoods(questions[name], each) for name in questions for each in baselines}


def _score_held_out(baseline: Baseline, table: Array, recordings: Sequence[ObservedRecording], name: str) -> Scores:
    """Score a predictor, on each recording with the setting that is best for the others by a table (r, s)."""
    choices = choose_held_out(table, [each.name for each in recordings])
    return score_forecasts(
        (
            number,
            observation.truth.approach if name == GAP else observation.truth.progress,
            question,
            baseline.forecast(observation, question, baseline.settings[choices[number]]),
        )
        for number, recording in enumerate(recordings)
        for observation, question in ask_all(recording, name)
    )


def _make_plain(setting: Any) -> Any:
    return asdict(setting) if is_dataclass(setting) and not isinstance(setting, type) else setting


def find_label_mismatches(data: Path, recordings: Sequence[ObservedRecording]) -> dict[str, str]:
    """Return both texts for each recording whose label is not the path class that was taken; none where there are no labels.

    The columns of labels.csv after the first are the gaps taken, row by row, counted from low x. The column `sides` of trials.csv
    has the side of each box by the end of its name; where it says which object was picked up instead, that is the truth already.
    Raises RecordingError for a table that cannot be read.
    """
    if (data / TRIALS).exists() and read_picked(data / TRIALS):
        return {}
    if (data / TRIALS).exists():
        return _find_side_mismatches(data / TRIALS, recordings)
    if not (data / LABELS).exists():
        return {}
    labels = {row.cells['recording']: row.cells for row in read_rows(data / LABELS, ('recording',))}
    found = {}
    for recording in recordings:
        cells = labels.get(recording.name)
        if cells is None:
            found[recording.name] = 'no label'
            continue
        labelled = [text for column, text in cells.items() if column != 'recording']
        taken = [str(gap) for gap in find_gaps(recording.observations[0])]
        if labelled != taken:
            found[recording.name] = f'label {" ".join(labelled)}, path {" ".join(taken)}'
    return found


def _find_side_mismatches(file: Path, recordings: Sequence[ObservedRecording]) -> dict[str, str]:
    labels = {row.cells['recording']: row.cells['sides'] for row in read_rows(file, ('recording', 'sides'))}
    found = {}
    for recording in recordings:
        first = recording.observations[0]
        names = [identity.rpartition('/')[0] for identity in first.ids]
        taken = {name: 'left' if side == LEFT else 'right' for name, side in zip(names, first.truth.sides, strict=True)}
        labelled = [each.rpartition('=') for each in labels.get(recording.name, '').split()]
        others = [
            f'{name} label {side}, path {taken[full]}'
            for name, _, side in labelled
            for full, is_ahead in zip(names, first.truth.is_ahead, strict=True)
            if is_ahead and full.endswith(name) and taken[full] != side
        ]
        if others or recording.name not in labels:
            found[recording.name] = '; '.join(others) or 'no label'
    return found


def find_gaps(observation: Observation) -> list[int]:
    """Return the gap that the hand really took in each row still ahead, counted from low x."""
    truth, row = observation.truth, observation.row
    left_is_low = observation.left[0] < 0.0
    is_higher = (truth.sides == LEFT) != left_is_low
    return [int(is_higher[(row == each) & truth.is_ahead].sum()) for each in np.unique(row[truth.is_ahead])]
