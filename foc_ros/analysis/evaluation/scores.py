"""Scores of forecasts against what came true, over a movement and over a whole set of recordings."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from foc_ros.core.types import Array, Record

from .forecasts import Forecast
from .questions import Question

TENTHS, BINS = 10, 10


@dataclass(frozen=True, eq=False)
class Judged(Record):
    """The m forecasts of one predictor for one question, row by row.

    recording (m,): its number; progress (m,) in [0, 1]; open (m,): number of open answers; log_likelihood (m,): of what came
    true; confidence (m,): of the likeliest answer; right (m,): whether it came true, a part of 1 if one of several; brier (m,).
    """

    recording: NDArray[np.int64]
    progress: Array
    open: Array
    log_likelihood: Array
    confidence: Array
    right: Array
    brier: Array

    def __len__(self) -> int:
        return len(self.recording)


def judge(rows: Sequence[tuple[int, float, Question, Forecast]]) -> Judged:
    """Judge forecasts: number of the recording, progress, question and forecast."""
    return Judged(
        np.array([row[0] for row in rows], dtype=np.int64),
        np.array([row[1] for row in rows], dtype=float),
        np.array([row[2].open for row in rows], dtype=float),
        np.log([row[3].true(row[2]) for row in rows]),
        np.array([row[3].confidence() for row in rows], dtype=float),
        np.array([row[3].right(row[2]) for row in rows], dtype=float),
        np.array([brier(row[3], row[2]) for row in rows], dtype=float),
    )


def brier(forecast: Forecast, question: Question) -> float:
    """Return the Brier score: the squared error of the probabilities, summed over all answers (Brier 1950)."""
    came = np.zeros(len(question.answers))
    came[question.truth] = 1.0
    return float(((forecast.probability - came) ** 2).sum() + question.unlisted * forecast.each_other**2)


def summary(judged: Judged) -> dict[str, Any]:
    """Return all scores as plain values: means over the predictions, the same by tenths, reliability, and the final lead."""
    return {
        **_means(judged, np.ones(len(judged), dtype=bool)),
        'expected_calibration_error': calibration_error(judged),
        'right_from_half_way': _mean(judged.right[judged.progress >= 0.5]),
        'leads_for_good_from': _mean(np.array(list(leads_from(judged).values()))),
        'by_tenth': [_means(judged, tenth(judged.progress) == number) for number in range(TENTHS)],
        'reliability': reliability(judged),
    }


def tenth(progress: Array) -> NDArray[np.int64]:
    """Return the tenth, 0 to 9, in which each share lies."""
    # 0.7 / 0.1 falls short of 7
    return np.clip(np.floor(progress * TENTHS + 1e-9), 0, TENTHS - 1).astype(np.int64)


def reliability(judged: Judged) -> list[dict[str, Any]]:
    """Return, for each bin of confidence in the likeliest answer, how many, mean confidence, and share that came true."""
    number = np.minimum((judged.confidence * BINS).astype(int), BINS - 1)
    bins = [number == each for each in range(BINS)]
    return [
        {
            'from': each / BINS,
            'to': (each + 1) / BINS,
            'count': int(held.sum()),
            'confidence': _mean(judged.confidence[held]),
            'right': _mean(judged.right[held]),
        }
        for each, held in enumerate(bins)
    ]


def calibration_error(judged: Judged) -> float | None:
    """Return the expected calibration error: mean distance of confidence and share right over the bins, by their counts.

    Naeini, Cooper and Hauskrecht 2015.
    """
    if not len(judged):
        return None
    bins = [each for each in reliability(judged) if each['count']]
    return float(sum(each['count'] * abs(each['confidence'] - each['right']) for each in bins) / len(judged))


def leads_from(judged: Judged) -> dict[int, float]:
    """Return, for each recording, the progress from which on the likeliest answer was the true one until the end; 1 for never."""
    found = {}
    for recording in np.unique(judged.recording).tolist():
        rows = np.flatnonzero(judged.recording == recording)
        wrong = np.flatnonzero(judged.right[rows] < 1.0)
        first = int(wrong[-1]) + 1 if len(wrong) else 0
        found[recording] = float(judged.progress[rows[first]]) if first < len(rows) else 1.0
    return found


def _means(judged: Judged, held: NDArray[np.bool_]) -> dict[str, Any]:
    uniform = -np.log(judged.open)
    return {
        'predictions': int(held.sum()),
        'log_likelihood': _mean(judged.log_likelihood[held]),
        'uniform': _mean(uniform[held]),
        'gain': _mean((judged.log_likelihood - uniform)[held]),
        'brier': _mean(judged.brier[held]),
        'right': _mean(judged.right[held]),
    }


def _mean(values: Array) -> float | None:
    return float(values.mean()) if len(values) else None
