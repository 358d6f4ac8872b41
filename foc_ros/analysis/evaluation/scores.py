# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Scores of forecasts against the true answers, and what is chosen by held-out scores.

Every setting is tried on every recording once, and each recording is scored with the setting best for the others, so that what it
says about itself never helps it.
"""

from __future__ import annotations

from collections.abc import Hashable, Iterable, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from foc_ros.analysis.intervals import compute_mean_interval
from foc_ros.core.types import Array

from .baselines import Baseline, Forecast
from .observations import Observation
from .questions import GAP, Question, Questions

TENTHS, BINS = 10, 10


def compute_log_likelihoods(questions: Questions, baseline: Baseline) -> Array:
    """Return the sum of the log-likelihoods of the true answers under each setting of a predictor, (s,)."""
    return np.array(
        [
            sum(np.log([baseline.forecast(*each, setting).true_probability(each[1]) for each in questions]))
            for setting in baseline.settings
        ]
    )


def choose_held_out(table: Array, groups: Sequence[Hashable]) -> NDArray[np.intp]:
    """Choose for each recording the setting (r,) that is best for the recordings of all other groups, the first of equal ones.

    table (r, s): log-likelihoods of recordings under settings; groups: the group of each recording. Where each is its own group,
    this is leave-one-out cross-validation. A single group has no others, and all recordings are used.
    """
    rows = {group: [row for row, each in enumerate(groups) if each == group] for group in groups}
    total = table.sum(axis=0)
    best = {group: int((total - table[own].sum(axis=0) if len(rows) > 1 else total).argmax()) for group, own in rows.items()}
    return np.array([best[group] for group in groups], dtype=np.intp)


class Scores(NamedTuple):
    """The m forecasts of one predictor for one question.

    recording (m,): its number; progress (m,) in [0, 1]; left_s (m,): time to the end of the movement [s]; possible (m,): number
    of possible answers; log_likelihood (m,): of the true answer; confidence (m,): probability of the likeliest answer; correct
    (m,): whether that is the true one, a part of 1 if one of several; brier (m,).
    """

    recording: Array
    progress: Array
    left_s: Array
    possible: Array
    log_likelihood: Array
    confidence: Array
    correct: Array
    brier: Array


def score_forecasts(rows: Iterable[tuple[int, Observation, Question, Forecast]]) -> Scores:
    """Score forecasts, at least one, given with the number of the recording and what was asked.

    The progress of the gap in the next row counts from row to row, that of other questions over the whole movement.
    """
    scored = [
        (
            number,
            observation.truth.approach if question.name == GAP else observation.truth.progress,
            observation.truth.left_s,
            question.possible,
            np.log(forecast.true_probability(question)),
            forecast.confidence(),
            forecast.correctness(question),
            compute_brier_score(forecast, question),
        )
        for number, observation, question, forecast in rows
    ]
    return Scores(*np.array(scored, dtype=float).T)


def compute_brier_score(forecast: Forecast, question: Question) -> float:
    """Return the squared error of the probabilities, summed over all possible answers (Brier 1950)."""
    truth = np.zeros(len(question.answers))
    truth[question.truth] = 1.0
    return float(((forecast.probability - truth) ** 2).sum() + question.unlisted * forecast.each_other**2)


def compare_scores(ours: Scores, other: Scores, is_share: bool) -> dict[str, Any]:
    """Return the mean difference of two predictors in the same predictions, with its interval, and the tenths that are worse.

    is_share: compare the shares of correct answers instead of the log-likelihoods of the true ones.
    """
    difference = ours.correct - other.correct if is_share else ours.log_likelihood - other.log_likelihood
    tenths = find_tenths(ours.progress)
    by_tenth = [difference[tenths == each] for each in range(TENTHS)]
    return {
        'difference': float(difference.mean()),
        'interval': compute_mean_interval(difference, ours.recording),
        'worse_tenths': [number for number, each in enumerate(by_tenth, 1) if len(each) and each.mean() < 0.0],
    }


def summarise(scores: Scores) -> dict[str, Any]:
    """Return all scores as plain values: means over the predictions and by tenths, reliability, and the final lead.

    The expected calibration error is the mean distance of confidence and share correct over the bins (Naeini et al. 2015).
    """
    reliability = compute_reliability(scores)
    errors = [each['count'] * abs(each['confidence'] - each['right']) for each in reliability if each['count']]
    leads_from, leads_before_s = find_final_leads(scores)
    return {
        **_compute_means(scores, np.ones(len(scores.recording), dtype=bool)),
        'expected_calibration_error': sum(errors) / len(scores.confidence),
        'right_from_half_way': _mean(scores.correct[scores.progress >= 0.5]),
        'leads_for_good_from': _mean(leads_from),
        'leads_for_good_before_s': _mean(leads_before_s),
        'by_tenth': [_compute_means(scores, find_tenths(scores.progress) == number) for number in range(TENTHS)],
        'reliability': reliability,
    }


def find_tenths(progress: Array) -> NDArray[np.int64]:
    """Return the tenth, 0 to 9, in which each share lies."""
    # 0.7 / 0.1 falls short of 7
    return np.clip(np.floor(progress * TENTHS + 1e-9), 0, TENTHS - 1).astype(np.int64)


def compute_reliability(scores: Scores) -> list[dict[str, Any]]:
    """Return count, mean confidence and share of correct answers for each bin of the confidence in the likeliest answer.

    interval: of the share, 95 % by bootstrap over the recordings; None without a prediction.
    """
    number = np.minimum((scores.confidence * BINS).astype(int), BINS - 1)
    return [
        {
            'from': each / BINS,
            'to': (each + 1) / BINS,
            'count': int(inside.sum()),
            'confidence': _mean(scores.confidence[inside]),
            'right': _mean(scores.correct[inside]),
            'interval': compute_mean_interval(scores.correct[inside], scores.recording[inside]) if inside.any() else None,
        }
        for each in range(BINS)
        for inside in [number == each]
    ]


def find_final_leads(scores: Scores) -> Array:
    """Return from when on the likeliest answer is correct to the end: progress, and time left [s], of each recording (2, r).

    1 and 0 where the last forecast of a recording is wrong.
    """
    leads = []
    for recording in np.unique(scores.recording):
        rows = np.flatnonzero(scores.recording == recording)
        wrong = np.flatnonzero(scores.correct[rows] < 1.0)
        leading = rows[int(wrong[-1]) + 1 :] if len(wrong) else rows
        leads.append((scores.progress[leading[0]], scores.left_s[leading[0]]) if len(leading) else (1.0, 0.0))
    return np.array(leads).T


def _compute_means(scores: Scores, chosen: NDArray[np.bool_]) -> dict[str, Any]:
    uniform = -np.log(scores.possible)
    return {
        'predictions': int(chosen.sum()),
        'log_likelihood': _mean(scores.log_likelihood[chosen]),
        'uniform': _mean(uniform[chosen]),
        'gain': _mean((scores.log_likelihood - uniform)[chosen]),
        'brier': _mean(scores.brier[chosen]),
        'right': _mean(scores.correct[chosen]),
    }


def _mean(values: Array) -> float | None:
    return float(values.mean()) if len(values) else None
