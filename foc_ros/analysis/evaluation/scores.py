# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Scores of forecasts and of predicted positions against the truth, with intervals, and what is chosen by held-out scores.

Intervals are bootstrap intervals over recordings (Efron 1979, doi:10.1214/aos/1176344552), because predictions within one are not
independent. Every setting is tried on every recording once, and each recording is scored with the setting best for the others, so
that what it says about itself never helps it.

The ellipse of a candidate says where the hand is if it follows this candidate. The whole prediction is the mixture of all
candidates, each with its likelihood. Its smallest region of probability p is where the density f is above a level (Hyndman 1996,
doi:10.2307/2684423). A position x lies within it if less than p of the probability is denser:

    Pr(f(Y) > f(x)) < p,  Y distributed by the mixture.

This is summed over the same points of every candidate: rings of equal probability, with points evenly spaced in angle.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.special import logsumexp

from foc_ros.analysis.evaluation.baselines import (
    SINGER_SETTINGS,
    Baseline,
    Forecast,
    compute_straight_costs,
    compute_straight_positions,
    forecast_singer,
)
from foc_ros.analysis.evaluation.observations import (
    HORIZONS_S,
    TIMES_S,
    Observation,
    ObservedRecording,
    Question,
    Questions,
    ask_main,
)
from foc_ros.core.types import Array

RESAMPLES = 1000
SEED = 1
CENTRAL = (2.5, 97.5)
"""Percentiles of an interval of 95 %."""
TENTHS, BINS = 10, 10
LEVELS = (0.5, 0.9)
"""Probabilities of the ellipses and regions."""
TIMES = np.array(TIMES_S)
HORIZONS = [TIMES_S.index(horizon) for horizon in HORIZONS_S]
"""Indices of the reported horizons among `TIMES_S`."""
EXACT = 1e-18
"""Variance of a position that is known [m^2]: that of a nanometre."""
RINGS = 25
"""Rings of a Gaussian. Its region is then exact at 50 and 90 %, because the border lies between two rings."""
SPOKES = 4
GOLDEN = np.pi * (3.0 - np.sqrt(5.0))
"""Angle from ring to ring [rad], so that no two have their points in the same directions."""
NEGLIGIBLE = 1e-4
"""Likelihood below which a candidate is left out."""


def _bootstrap(data: tuple[NDArray[Any], ...], statistic: Callable[..., Any], **options: Any) -> Any:
    """Resample by SciPy; equal data give equal intervals."""
    from scipy.stats import bootstrap  # not before: worker processes do without its 30 MB

    draws = np.random.default_rng(SEED)
    return bootstrap(data, statistic, n_resamples=RESAMPLES, method='percentile', random_state=draws, **options)


def resample(statistic: Callable[[NDArray[np.intp]], float], n: int) -> Array:
    """Return a statistic of the rows of the recordings, out of n, that are drawn in each resample, (RESAMPLES,)."""
    if n == 1:
        return np.full(RESAMPLES, float(statistic(np.zeros(1, dtype=np.intp))))
    drawn = _bootstrap((np.arange(n),), lambda rows: float(statistic(rows)), vectorized=False)
    return np.asarray(drawn.bootstrap_distribution)


def compute_mean_interval(values: Array, recording: Array) -> list[float]:
    """Return the interval of 95 % [low, high] of the mean of values (m,), at least one, from recordings (m,)."""
    _, number = np.unique(recording, return_inverse=True)
    sums, counts = np.bincount(number, values), np.bincount(number)
    if len(sums) == 1:
        return [float(values.mean())] * 2
    found = _bootstrap((sums, counts), _divide_sums, paired=True, vectorized=True)
    return [float(end) for end in found.confidence_interval]


def _divide_sums(sums: Array, counts: Array, axis: int) -> Array:
    return np.asarray(sums.sum(axis=axis) / counts.sum(axis=axis))


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

    The expected calibration error is the mean distance of confidence and share correct over the bins (Naeini et al. 2015).
    left_s (m,): time from each forecast to the end of its movement [s], without which the time of the lead is not known.
    """
    leads = find_final_leads(scores)
    reliability, n = compute_reliability(scores), len(scores.confidence)
    bins = [each for each in reliability if each['count']]
    return {
        **_compute_means(scores, np.ones(len(scores.recording), dtype=bool)),
        'expected_calibration_error': sum(each['count'] * abs(each['confidence'] - each['right']) for each in bins) / n,
        'right_from_half_way': _mean(scores.correct[scores.progress >= 0.5]),
        'leads_for_good_from': _mean(np.array([1.0 if row is None else scores.progress[row] for row in leads.values()])),
        'leads_for_good_before_s': None if left_s is None else _mean(find_lead_times(leads, left_s)),
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


def find_lead_times(leads: Mapping[int, int | None], left_s: Array) -> Array:
    """Return the time before the end at which the right answer leads for good, for each recording [s]; 0 if it never does."""
    return np.array([0.0 if row is None else left_s[row] for row in leads.values()])


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


def compute_position_scores(recordings: Sequence[ObservedRecording]) -> dict[str, Any]:
    """Return average and final displacement errors [m] by predictor and horizon, and shares of true positions inside.

    inside: the ellipse of the most likely candidate; inside_taken: of the candidate that was taken; inside_all: the smallest
    region of all candidates. nlpd: the mean negative logarithm of the density [1/m^2] at the true position, under the mixture of
    all candidates, and under the Singer model with the setting that is best for the other recordings. The average is over the
    times up to the horizon; recordings that end before a horizon do not count.
    """
    observations = [each for recording in recordings for each in recording.observations]
    true = np.array([each.truth.positions for each in observations])
    leading, taken = [_find_leading(each) for each in observations], _find_taken(recordings)
    denser = np.array([compute_denser_share(each, each.candidates.mixture, each.candidates.covariance) for each in observations])
    predicted = {
        'most likely': np.array([each.candidates.mean[row] for each, row in zip(observations, leading, strict=True)]),
        'likelihood-weighted': np.array(
            [np.tensordot(each.candidates.mixture, each.candidates.mean, 1) for each in observations]
        ),
        'constant velocity': np.array([_continue_velocity(each) for each in observations]),
        'straight minimum jerk': np.array([_continue_minimum_jerk(each) for each in observations]),
    }

    return {
        'displacement_m': {name: _compute_errors(positions, true) for name, positions in predicted.items()},
        'nlpd': {
            'foc': _average_at_horizons(np.array([compute_nlpd(each) for each in observations])),
            'Singer Kalman': _average_at_horizons(_score_singer(recordings)),
        },
        'inside': _compute_coverage(observations, leading),
        'inside_taken': _compute_coverage(observations, taken),
        'inside_all': {
            f'{level:g}': _average_at_horizons(np.where(np.isfinite(denser), denser < level, np.nan)) for level in LEVELS
        },
    }


def _compute_coverage(observations: Sequence[Observation], rows: Sequence[int]) -> dict[str, dict[str, float | None]]:
    """Return the shares of true positions inside the ellipses of one candidate (m,) of each observation, by level and horizon."""
    true = np.array([each.truth.positions for each in observations])
    mean = np.array([each.candidates.mean[row] for each, row in zip(observations, rows, strict=True)])
    covariance = np.array([each.candidates.covariance[row] for each, row in zip(observations, rows, strict=True)])
    return {f'{level:g}': _average_at_horizons(is_inside_ellipse(true - mean, covariance, level)) for level in LEVELS}


def compute_nlpd(observation: Observation) -> Array:
    """Return the negative log-density of the true positions under the published mixture (h,) [nat, metres], nan elsewhere."""
    candidates, found = observation.candidates, np.full(len(TIMES), np.nan)
    counted = np.flatnonzero(candidates.likelihood > 0.0)
    offset = observation.truth.positions - candidates.mean[counted]
    covariance = candidates.covariance[counted] + EXACT * np.eye(2)
    entries = covariance[..., 0, 0], covariance[..., 1, 1], covariance[..., 0, 1]
    found[HORIZONS] = -log_mixture_density(candidates.mixture[counted], offset, *entries)[HORIZONS]
    return found


def _score_singer(recordings: Sequence[ObservedRecording]) -> Array:
    """Return the negative log-densities (m, h) of the Singer model, each with the setting best for the other recordings."""
    tables = [_tabulate_singer(each) for each in recordings]
    table = np.array([-np.nansum(each, axis=(0, 2)) for each in tables])
    chosen = choose_held_out(table, [each.name for each in recordings])
    return np.concatenate([each[:, setting] for each, setting in zip(tables, chosen, strict=True)])


def _tabulate_singer(recording: ObservedRecording) -> Array:
    """Return the negative log-densities of the true positions (m, s, h) [nat, metres] under each setting of the Singer model."""
    path, observations = recording.path, recording.observations
    stamps_ns = np.array([each.stamp_ns for each in observations])
    mean, variance = forecast_singer(path.stamps_ns, path.positions, stamps_ns, TIMES[HORIZONS])
    true = np.array([each.truth.positions[HORIZONS] for each in observations])
    squared = ((true[:, None] - mean) ** 2).sum(axis=-1)
    found = np.full((len(observations), len(SINGER_SETTINGS), len(TIMES)), np.nan)
    found[:, :, HORIZONS] = np.log(2.0 * np.pi * variance) + squared / (2.0 * variance)
    return found


def is_inside_ellipse(offset: Array, covariance: Array, level: float) -> Array:
    """Return 1 where the ellipse of a probability holds a point at offset (..., 2) [m], 0 where not, nan where there is none."""
    # chi-square distribution of two degrees of freedom
    squared = (offset * np.linalg.solve(covariance + EXACT * np.eye(2), offset[..., None])[..., 0]).sum(axis=-1)
    return np.where(np.isfinite(squared), (squared <= -2.0 * np.log(1.0 - level)).astype(float), np.nan)


def compute_denser_share(observation: Observation, shares: Array, covariance: Array) -> Array:
    """Return the probability of all that is denser than the true positions (h,), at the horizons, nan elsewhere.

    shares (k,) and covariance (k, h, 2, 2) [m^2] of the candidates.
    """
    found = np.full(len(TIMES), np.nan)
    mean, truth = observation.candidates.mean[:, HORIZONS], observation.truth.positions[HORIZONS]
    found[HORIZONS] = find_denser_share(shares, mean, covariance[:, HORIZONS] + EXACT * np.eye(2), truth)
    return found


def find_denser_share(weight: Array, mean: Array, covariance: Array, position: Array) -> Array:
    """Return the probability (h,) of all that is denser than a position, nan where the position is not known.

    weight (k,) of normal distributions with mean (k, h, 2) [m] and covariance (k, h, 2, 2) [m^2], positive definite;
    position (h, 2) [m].
    """
    counted = weight > NEGLIGIBLE
    weight, mean, covariance = weight[counted] / weight[counted].sum(), mean[counted], covariance[counted]
    points = mean + np.einsum('khij,mj->mkhi', np.linalg.cholesky(covariance), POINTS)
    entries = covariance[..., 0, 0], covariance[..., 1, 1], covariance[..., 0, 1]
    level = log_mixture_density(weight, position[..., None, :, :] - mean, *entries)
    is_above = log_mixture_density(weight, points[..., None, :, :] - mean, *entries) > level
    return np.where(np.isfinite(level), (is_above.mean(axis=0) * weight[:, None]).sum(axis=0), np.nan)


def log_mixture_density(weight: Array, offset: Array, xx: Array, yy: Array, xy: Array) -> Array:
    """Return the logarithm of the density (..., h) of a mixture of normal distributions with weights (k,).

    At offset (..., k, h, 2) [m] from the mean of each, for covariances [[xx, xy], [xy, yy]] (..., k, h) [m^2].
    """
    x, y, determinant = offset[..., 0], offset[..., 1], xx * yy - xy**2
    distance = (yy * x**2 - 2.0 * xy * x * y + xx * y**2) / determinant
    logs = np.log(weight)[:, None] - 0.5 * (distance + np.log(determinant)) - np.log(2.0 * np.pi)
    return np.asarray(logsumexp(logs, axis=-2))


def _make_points() -> Array:
    """Return points (m, 2) of equal weight that represent the standard normal distribution."""
    radii = np.sqrt(-2.0 * np.log1p(-(np.arange(RINGS) + 0.5) / RINGS))
    angles = GOLDEN * np.arange(RINGS)[:, None] + 2.0 * np.pi / SPOKES * np.arange(SPOKES)
    return np.stack([radii[:, None] * np.cos(angles), radii[:, None] * np.sin(angles)], axis=-1).reshape(-1, 2)


POINTS = _make_points()


def _compute_errors(positions: Array, true: Array) -> dict[str, dict[str, float | None]]:
    distance = np.hypot(*(positions - true).transpose(2, 0, 1))
    average = np.cumsum(distance, axis=1) / np.arange(1, len(TIMES) + 1)
    return {'average': _average_at_horizons(average), 'final': _average_at_horizons(distance)}


def _average_at_horizons(values: Array) -> dict[str, float | None]:
    """Return the mean of (m, h) over predictions at each of the horizons; nan does not count."""
    columns = {f'{horizon:g}': values[:, index] for horizon, index in zip(HORIZONS_S, HORIZONS, strict=True)}
    return {name: float(np.nanmean(each)) if np.isfinite(each).any() else None for name, each in columns.items()}


def _find_leading(observation: Observation) -> int:
    """Return the row of the most likely candidate, as published."""
    candidates, label = observation.candidates, observation.most_likely
    return candidates.labels.index(label) if label else int(candidates.likelihood.argmax())


def _find_taken(recordings: Sequence[ObservedRecording]) -> list[int]:
    """Return the row of the likeliest candidate of the true answer; of the most likely candidate where none gives it."""
    rows = []
    for recording in recordings:
        questions = {observation.stamp_ns: question for observation, question in ask_main(recording)}
        for each in recording.observations:
            question = questions.get(each.stamp_ns)
            if question is not None and (is_true := question.given == question.truth).any():
                rows.append(int(np.where(is_true, each.candidates.likelihood, -1.0).argmax()))
            else:
                rows.append(_find_leading(each))
    return rows


def _continue_velocity(observation: Observation) -> Array:
    velocity = observation.hand[2:4] if observation.movement_age_s > 0.0 else np.zeros(2)
    return np.asarray(observation.hand[:2] + TIMES[:, None] * velocity)


def _continue_minimum_jerk(observation: Observation) -> Array:
    return compute_straight_positions(observation, int(compute_straight_costs(observation).argmin()), TIMES)
