# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Scores of forecasts against the true answers, what is chosen by held-out scores, and bootstrap intervals.

Every setting is tried on every recording once, and each recording is scored with the setting best for the others.

**Intervals** are by bootstrap (Efron 1979, doi:10.1214/aos/1176344552); equal data give equal ones. What is drawn are recordings
or trials, because predictions within one recording are not independent.

**A goal that nobody announced** is tried out: each recording is replayed again with its goal left out of the list. The share
`other` is then right in the second replay and wrong in the first. Its calibration error is the mean distance of share and
frequency over ten bins, with the replays without the goal as frequent as `likelihood.other_goal` says. The loss is what the share
costs where the goal is on the list, the mean of -log(1 - other).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from foc_ros.analysis.recordings import Recording, TableRecording
from foc_ros.analysis.scenes import NO_GOAL
from foc_ros.core.learning.movements import find_reached_goal
from foc_ros.core.types import Array
from foc_ros.ros.messages.plane import project

from .baselines import Baseline, Forecast
from .observations import GAP, Observation, ObservedRecording, Question, Questions

TENTHS, BINS = 10, 10
RESAMPLES, SEED = 1000, 1
CENTRAL = (2.5, 97.5)
"""Percentiles of an interval of 95 %."""
TIE = 1e-12
FEWEST = 6
"""Recordings below which nothing has an interval of 95 % over recordings: n of them hold the median with 1 - 2^(1 - n)."""
FEW = 20
"""Recordings or trials below which a result comes with a warning."""


def compute_log_likelihoods(questions: Questions, baseline: Baseline) -> Array:
    """Return the sum of the log-likelihoods of the true answers under each setting of a predictor, (s,)."""
    probabilities = (
        [baseline.forecast(*each, setting).true_probability(each[1]) for each in questions] for setting in baseline.settings
    )
    return np.array([np.log(each).sum() for each in probabilities])


def choose_held_out(table: Array) -> NDArray[np.intp]:
    """Choose for each recording the setting (r,) that is best for all others, by a table of log-likelihoods (r, s)."""
    others: Array = table.sum(axis=0) - table if len(table) > 1 else table
    return np.asarray(others.argmax(axis=1))


class Scores(NamedTuple):
    """The m forecasts of one predictor for one question.

    recording (m,): its number; progress (m,) in [0, 1]; left_s (m,): time to the end of the movement [s]; possible (m,): number
    of possible answers; confidence (m,): probability of the likeliest answer; correct (m,): whether that is the true one, a part
    of 1 if one of several.
    """

    recording: Array
    progress: Array
    left_s: Array
    possible: Array
    log_likelihood: Array
    confidence: Array
    correct: Array
    brier: Array

    def take(self, rows: NDArray[Any]) -> Scores:
        """Return the scores of some forecasts, by their numbers or by a mask."""
        return Scores(*(each[rows] for each in self))

    def average(self) -> dict[str, Any]:
        """Return the number of forecasts and the means of their scores, None where there are none."""
        uniform = -np.log(self.possible)
        return {
            'predictions': len(self.possible),
            'log_likelihood': find_mean(self.log_likelihood),
            'uniform': find_mean(uniform),
            'gain': find_mean(self.log_likelihood - uniform),
            'brier': find_mean(self.brier),
            'right': find_mean(self.correct),
        }


def score_forecasts(rows: Iterable[tuple[int, Observation, Question, Forecast]]) -> Scores:
    """Score forecasts, given with the number of the recording and what was asked.

    The progress of the gap in the next row counts from row to row, that of other questions over the whole movement.
    """
    scored = []
    for number, observation, question, forecast in rows:
        truth, progress = observation.truth, observation.truth.approach if question.name == GAP else observation.truth.progress
        p, other, is_true = forecast.probability, forecast.each_other, np.arange(len(question.answers)) == question.truth
        confidence = max(p.max(), other)
        likeliest = (p >= confidence - TIE).sum() + question.unlisted * (other >= confidence - TIE)
        correct = (p[question.truth] >= confidence - TIE) / likeliest
        brier = ((p - is_true) ** 2).sum() + question.unlisted * other**2  # Brier 1950
        log_likelihood = np.log(p[question.truth])
        scored.append((number, progress, truth.left_s, question.possible, log_likelihood, confidence, correct, brier))
    return Scores(*np.array(scored, dtype=float).reshape(-1, len(Scores._fields)).T)


def compare_scores(ours: Scores, other: Scores, is_share: bool) -> dict[str, Any]:
    """Return the mean difference of two predictors, its interval, None of one recording, and the tenths that are worse."""
    difference = ours.correct - other.correct if is_share else ours.log_likelihood - other.log_likelihood
    tenths = find_tenths(ours.progress)
    by_tenth, is_one = [difference[tenths == each] for each in range(TENTHS)], np.ptp(ours.recording) == 0.0
    return {
        'difference': float(difference.mean()),
        'interval': None if is_one else compute_mean_interval(difference, ours.recording),
        'worse_tenths': [number for number, each in enumerate(by_tenth, 1) if len(each) and each.mean() < 0.0],
    }


def summarise(scores: Scores) -> dict[str, Any]:
    """Return all scores as plain values: means over the predictions and by tenths, reliability, and the final lead.

    The expected calibration error is the mean distance of confidence and share correct over the bins (Naeini et al. 2015).
    """
    reliability, tenths, leads = compute_reliability(scores), find_tenths(scores.progress), []
    errors = [each['count'] * abs(each['confidence'] - each['right']) for each in reliability if each['count']]
    for recording in np.unique(scores.recording):
        # from when on the likeliest answer is correct to the end of a recording; 1 and 0 where the last one is wrong
        own = scores.take(scores.recording == recording)
        leading = own.take(np.cumprod(own.correct[::-1] == 1.0)[::-1] == 1)
        leads.append((leading.progress[0], leading.left_s[0]) if len(leading.progress) else (1.0, 0.0))
    leads_from, leads_before_s = np.array(leads).T
    return {
        **scores.average(),
        'expected_calibration_error': sum(errors) / len(scores.confidence),
        'right_from_half_way': find_mean(scores.correct[scores.progress >= 0.5]),
        'leads_for_good_from': find_mean(leads_from),
        'leads_for_good_before_s': find_mean(leads_before_s),
        'by_tenth': [scores.take(tenths == number).average() for number in range(TENTHS)],
        'reliability': reliability,
    }


def find_tenths(progress: Array) -> NDArray[np.int64]:
    """Return the tenth, 0 to 9, in which each share lies."""
    # 0.7 / 0.1 falls short of 7
    return np.clip(np.floor(progress * TENTHS + 1e-9), 0, TENTHS - 1).astype(np.int64)


def compute_reliability(scores: Scores) -> list[dict[str, Any]]:
    """Return numbers, mean confidence and share of correct answers, with its interval, for each bin of the confidence."""
    number = np.minimum((scores.confidence * BINS).astype(int), BINS - 1)
    return [
        {
            'from': each / BINS,
            'to': (each + 1) / BINS,
            'count': len(own.correct),
            'recordings': len(np.unique(own.recording)),
            'confidence': find_mean(own.confidence),
            'right': find_mean(own.correct),
            'interval': compute_mean_interval(own.correct, own.recording) if len(own.correct) else None,
        }
        for each in range(BINS)
        for own in [scores.take(number == each)]
    ]


def find_mean(values: Array) -> float | None:
    """Return the mean of values, None where there are none."""
    return float(values.mean()) if len(values) else None


def leave_goals_out(recordings: Mapping[str, Recording], plane: str = 'xy') -> dict[str, Recording]:
    """Return the recordings of tables that have several goals without the goal that was reached in the task plane."""
    found: dict[str, Recording] = {}
    for name, each in recordings.items():
        if not isinstance(each, TableRecording) or each.scene.goals is None or len(each.scene.goals) < 2:
            continue
        goal = each.goal
        if goal is None:
            goal = find_reached_goal(*(project(points, plane)[0] for points in (each.positions, each.scene.goals)))[0]
        if goal is not None:
            found[name] = replace(each, scene=replace(each.scene, goals=np.delete(each.scene.goals, goal, axis=0), goal=NO_GOAL))
    return found


def score_other_goal(
    announced: Sequence[ObservedRecording], left_out: Sequence[ObservedRecording], prior: float
) -> dict[str, float] | None:
    """Return the scores of the share `other`, None where no recording was replayed both ways or the prior is zero."""
    without = {(each.name, seen.stamp_ns): seen.other for each in left_out for seen in each.observations}
    rows = []
    for recording in announced:
        seen = [each for each in recording.observations if (recording.name, each.stamp_ns) in without]
        half = next((each for each in seen if each.truth.progress >= 0.5), seen[-1] if seen else None)
        rows += [(each.other, without[recording.name, each.stamp_ns], each is half) for each in seen]
    if not rows or not prior:
        return None
    from scipy.stats import mannwhitneyu  # not before: worker processes do without its 30 MB

    def measure_area(chosen: NDArray[np.bool_]) -> float:
        """Return the probability that a share where it is right is larger than one where it is wrong, a tie counting half."""
        return float(mannwhitneyu(right[chosen], wrong[chosen]).statistic) / int(chosen.sum()) ** 2

    wrong, right, is_half = np.array(rows, dtype=float).T
    # the calibration error over bins of the share, where the right ones have the weight `prior` in all
    share, weight = np.concatenate([wrong, right]), np.repeat([(1.0 - prior) / len(wrong), prior / len(right)], len(wrong))
    number = np.minimum((share * BINS).astype(int), BINS - 1)
    expected = np.bincount(number, weight * share, BINS)
    happened = np.bincount(number[len(wrong) :], weight[len(wrong) :], BINS)
    return {
        'area_under_curve_half_way': measure_area(is_half == 1.0),
        'area_under_curve': measure_area(is_half >= 0.0),
        'calibration_error': float(np.abs(expected - happened).sum()),
        'loss': float(-np.log1p(-wrong).mean()),
        'share': float(wrong.mean()),
        'share_left_out': float(right.mean()),
    }


def describe_other_goal(scores: Mapping[str, Any]) -> str:
    """Return the scores in a sentence."""
    return (
        f'Another goal: with the right one left out its share is {scores["share_left_out"]:.2f} on average, with it '
        f'{scores["share"]:.2f}; area under the curve {scores["area_under_curve_half_way"]:.2f} half way, '
        f'{scores["area_under_curve"]:.2f} of all; calibration error {scores["calibration_error"]:.3f}; '
        f'loss {scores["loss"]:.3f} nat.'
    )


def warn_of_few(count: int, what: str) -> list[str]:
    """Return a warning where recordings or trials are few."""
    words = f'Few {what} ({count}): intervals are wide, and differences may be chance. {FEW} or more tell more.'
    return [words] if count < FEW else []


def draw_rows(n: int, seed: int = SEED, resamples: int = RESAMPLES) -> NDArray[np.intp]:
    """Return the rows, out of n, that are drawn in each resample, (resamples, n)."""
    return np.random.default_rng(seed).integers(0, n, (resamples, n))


def resample(statistic: Callable[[NDArray[np.intp]], float], n: int) -> Array:
    """Return a statistic of the rows, out of n, that are drawn in each resample, (RESAMPLES,)."""
    return np.array([float(statistic(rows)) for rows in draw_rows(n)])


def compute_mean_interval(values: Array, group: NDArray[Any], seed: int = SEED, resamples: int = RESAMPLES) -> list[float]:
    """Return the interval of 95 % [low, high] of the mean of values (m,), at least one, of which groups (m,) are drawn."""
    _, number = np.unique(group, return_inverse=True)
    sums, counts = np.bincount(number, values), np.bincount(number)
    drawn = draw_rows(len(counts), seed, resamples)
    ends: list[float] = np.percentile(sums[drawn].sum(axis=1) / counts[drawn].sum(axis=1), CENTRAL).tolist()
    return ends
