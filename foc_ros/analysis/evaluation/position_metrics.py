"""Displacement errors and densities of predicted positions, and the coverage of predicted ellipses and regions.

The ellipse of a candidate says where the hand is if it follows this candidate. The whole prediction is the mixture of all
candidates, each with its likelihood. Its smallest region of probability p is where the density f is above a level (Hyndman 1996,
doi:10.2307/2684423). A position x lies within it if less than p of the probability is denser:

    Pr(f(Y) > f(x)) < p,  Y distributed by the mixture.

This is summed over the same points of every candidate: rings of equal probability, with points evenly spaced in angle.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from scipy.special import logsumexp

from foc_ros.core.types import Array

from .cross_validation import choose_held_out
from .ground_truth import HORIZONS_S, TIMES_S
from .minimum_jerk import compute_straight_costs, compute_straight_positions
from .observations import Observation, ObservedRecording
from .questions import ask_main
from .singer import SETTINGS, forecast_singer

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
    found = np.full((len(observations), len(SETTINGS), len(TIMES)), np.nan)
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
