"""Scores of forecasts against the truth: log-likelihood, Brier score, calibration error, share of correct answers."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from foc_ros.core.types import Array

from .bootstrap import compute_mean_interval
from .forecasts import Forecast
from .questions import Question

TENTHS, BINS = 10, 10


class Scores(NamedTuple):
    """The m forecasts of one predictor for one question.

    recording (m,): its number; progress (m,) in [0, 1]; possible (m,): number of possible answers; log_likelihood (m,): of the
    true answer; confidence (m,): probability of the likeliest answer; correct (m,): whether that is the true one, a part of 1
    if one of several; brier (m,).
    """

    recording: Array
    progress: Array
    possible: Array
    log_likelihood: Array
    confidence: Array
    correct: Array
    brier: Array


def score_forecasts(rows: Iterable[tuple[int, float, Question, Forecast]]) -> Scores:
    """Score forecasts, at least one, given with the number of the recording, progress and question."""
    scored = [
        (
            number,
            progress,
            question.possible,
            np.log(forecast.true_probability(question)),
            forecast.confidence(),
            forecast.correctness(question),
            compute_brier_score(forecast, question),
        )
        for number, progress, question, forecast in rows
    ]
    return Scores(*np.array(scored, dtype=float).T)


def compute_brier_score(forecast: Forecast, question: Question) -> float:
    """Return the squared error of the probabilities, summed over all possible answers (Brier 1950)."""
    truth = np.zeros(len(question.answers))
    truth[question.truth] = 1.0
    return float(((forecast.probability - truth) ** 2).sum() + question.unlisted * forecast.each_other**2)


def summarise(scores: Scores, left_s: Array | None = None) -> dict[str, Any]:
    """Return all scores as plain values: means over the predictions and by tenths, reliability, and the final lead.

    left_s (m,): time from each forecast to the end of its movement [s], without which the time of the lead is not known.
    """
    leads = find_final_leads(scores)
    return {
        **_compute_means(scores, np.ones(len(scores.recording), dtype=bool)),
        'expected_calibration_error': compute_calibration_error(scores),
        'right_from_half_way': _mean(scores.correct[scores.progress >= 0.5]),
        'leads_for_good_from': _mean(np.array([1.0 if row is None else scores.progress[row] for row in leads.values()])),
        'leads_for_good_before_s': None if left_s is None else _mean(find_lead_times(leads, left_s)),
        'by_tenth': [_compute_means(scores, find_tenths(scores.progress) == number) for number in range(TENTHS)],
        'reliability': compute_reliability(scores),
    }


def find_lead_times(leads: Mapping[int, int | None], left_s: Array) -> Array:
    """Return the time before the end at which the right answer leads for good, for each recording [s]; 0 if it never does."""
    return np.array([0.0 if row is None else left_s[row] for row in leads.values()])


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


def compute_calibration_error(scores: Scores) -> float:
    """Return the mean distance of confidence and share correct over the bins, by their counts (Naeini et al. 2015)."""
    bins = [each for each in compute_reliability(scores) if each['count']]
    return float(sum(each['count'] * abs(each['confidence'] - each['right']) for each in bins) / len(scores.confidence))


def find_final_leads(scores: Scores) -> dict[int, int | None]:
    """Return, for each recording, the forecast (row) from which on the likeliest answer is correct to the end, None if none."""
    found: dict[int, int | None] = {}
    for recording in np.unique(scores.recording).astype(int).tolist():
        rows = np.flatnonzero(scores.recording == recording)
        wrong = np.flatnonzero(scores.correct[rows] < 1.0)
        first = int(wrong[-1]) + 1 if len(wrong) else 0
        found[recording] = int(rows[first]) if first < len(rows) else None
    return found


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
