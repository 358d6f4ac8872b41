# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Scores of predicted positions: their errors, the density of the true ones, and how many of these are inside of regions.

The ellipse of a candidate says where the hand is if it follows this candidate. The whole prediction is the mixture of all
candidates, each with its likelihood. Its smallest region of probability p is where the density f is above a level (Hyndman 1996,
doi:10.2307/2684423): a position x lies within it if Pr(f(Y) > f(x)) < p for Y distributed by the mixture. This is summed over the
same points of every candidate: rings of equal probability, with points evenly spaced in angle.

**The Singer model** of a manoeuvring target (Singer 1970, doi:10.1109/TAES.1970.310128) knows no scene. Per axis the acceleration
has the standard deviation sigma and decays with the time constant tau. It is driven by white noise, a' = -a / tau + w, of
spectral density 2 sigma^2 / tau. A Kalman filter follows the recorded positions, and its state is propagated ahead.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import expm
from scipy.special import logsumexp

from foc_ros.core.types import NANOSECONDS, Array

from .baselines import compute_straight_costs, compute_straight_positions
from .observations import Observation, ObservedRecording, ask_main
from .scores import choose_held_out
from .truth import HORIZONS, HORIZONS_S, TIMES_S

LEVELS = (0.5, 0.9)
RINGS, SPOKES = 25, 4
"""Rings of a Gaussian, and points of a ring. A region is exact at 50 and 90 %, because the border lies between two rings."""
Shares = dict[str, float | None]
"""A value for each horizon, by its name; None where every recording has ended before."""


def compute_position_scores(recordings: Sequence[ObservedRecording]) -> dict[str, Any]:
    """Return average and final displacement errors [m] by predictor and horizon, and shares of true positions inside.

    inside: the ellipse of the most likely candidate; inside_taken: of the candidate that was taken; inside_all: the smallest
    region of all candidates. nlpd: the mean negative logarithm of the density [1/m^2] at the true position. The average is over
    the times up to the horizon; recordings that end before a horizon do not count.
    """
    observations = [each for recording in recordings for each in recording.observations]
    means = [each.candidates.mean for each in observations]
    leading, mixture = [_choose_leading(each) for each in observations], [each.candidates.mixture for each in observations]
    predicted = {
        'most likely': [np.tensordot(*each, 1) for each in zip(leading, means, strict=True)],
        'likelihood-weighted': [np.tensordot(*each, 1) for each in zip(mixture, means, strict=True)],
        'constant velocity': [
            each.hand[:2] + TIMES_S[:, None] * (each.hand[2:4] if each.movement_age_s > 0.0 else np.zeros(2))
            for each in observations
        ],
        'straight minimum jerk': [
            compute_straight_positions(each, int(compute_straight_costs(each).argmin()), TIMES_S) for each in observations
        ],
    }
    densities = [compute_log_densities(each, each.candidates.mixture, each.candidates.covariance) for each in observations]
    true, errors = np.array([each.truth.positions for each in observations]), {}
    for name, each in predicted.items():
        distance = np.hypot(*(np.array(each) - true).transpose(2, 0, 1))
        mean = np.cumsum(distance, axis=1) / np.arange(1, len(TIMES_S) + 1)
        errors[name] = {'average': average(mean[:, HORIZONS]), 'final': average(distance[:, HORIZONS])}
    return {
        'displacement_m': errors,
        'nlpd': {'foc': average(-np.array(densities)), 'Singer Kalman': average(score_singer(recordings))},
        'inside': measure_inside(observations, leading),
        'inside_taken': measure_inside(observations, _choose_taken(recordings)),
        'inside_all': measure_inside(observations, mixture),
    }


def average(values: Array) -> Shares:
    """Return the mean of values at the horizons (m, 3) over predictions, by horizon; nan does not count."""
    columns = {f'{horizon:g}': column for horizon, column in zip(HORIZONS_S, values.T, strict=True)}
    return {name: float(np.nanmean(each)) if np.isfinite(each).any() else None for name, each in columns.items()}


def measure_inside(observations: Sequence[Observation], weights: Sequence[Array]) -> dict[str, Shares]:
    """Return the share of true positions in the smallest region of each of `LEVELS`, by horizon; weights (k,): of candidates."""
    given = (
        (each.candidates.mean[:, HORIZONS], each.candidates.covariance, each.truth.positions[HORIZONS]) for each in observations
    )
    denser = np.array([find_denser_share(weight, *each) for weight, each in zip(weights, given, strict=True)])
    return {f'{level:g}': average(np.where(np.isfinite(denser), denser < level, np.nan)) for level in LEVELS}


def compute_log_densities(observation: Observation, shares: Array, covariance: Array) -> Array:
    """Return the log-density (..., 3) of the true positions at the horizons [nat, metres], nan where the movement has ended."""
    offset = (observation.truth.positions - observation.candidates.mean)[:, HORIZONS]
    return log_mixture_density(shares, offset, covariance)


def find_denser_share(weight: Array, mean: Array, covariance: Array, position: Array) -> Array:
    """Return the probability (h,) of all that is denser than a position (h, 2) [m], nan where the position is not known.

    weight (k,) of normal distributions with mean (k, h, 2) [m] and covariance (k, h, 2, 2) [m^2], positive definite.
    """
    counted = weight > 1e-4
    weight, mean, covariance = weight[counted] / weight[counted].sum(), mean[counted], covariance[counted]
    points = mean + np.einsum('khij,mj->mkhi', np.linalg.cholesky(covariance), POINTS)
    level = log_mixture_density(weight, position[..., None, :, :] - mean, covariance)
    is_above = log_mixture_density(weight, points[..., None, :, :] - mean, covariance) > level
    return np.where(np.isfinite(level), (is_above.mean(axis=0) * weight[:, None]).sum(axis=0), np.nan)


def log_mixture_density(weight: Array, offset: Array, covariance: Array) -> Array:
    """Return the log-density (..., h) of a mixture of normal distributions at offsets (..., k, h, 2) [m] from their means."""
    x, y, xx, yy, xy = *np.moveaxis(offset, -1, 0), covariance[..., 0, 0], covariance[..., 1, 1], covariance[..., 0, 1]
    determinant = xx * yy - xy**2
    distance = (yy * x**2 - 2.0 * xy * x * y + xx * y**2) / determinant
    logs = -0.5 * (distance + np.log(determinant)) - np.log(2.0 * np.pi)
    return np.asarray(logsumexp(logs, axis=-2, b=weight[:, None]))


def _make_points() -> Array:
    """Return points (m, 2) of equal weight that represent the standard normal distribution, no two rings in equal directions."""
    radii, golden_angle = np.sqrt(-2.0 * np.log1p(-(np.arange(RINGS) + 0.5) / RINGS)), np.pi * (3.0 - np.sqrt(5.0))
    angles = golden_angle * np.arange(RINGS)[:, None] + 2.0 * np.pi / SPOKES * np.arange(SPOKES)
    return np.stack([radii[:, None] * np.cos(angles), radii[:, None] * np.sin(angles)], axis=-1).reshape(-1, 2)


POINTS = _make_points()


def _choose_leading(observation: Observation) -> Array:
    candidates, label = observation.candidates, observation.most_likely
    row = candidates.labels.index(label) if label else int(candidates.likelihood.argmax())
    return np.asarray(np.eye(len(candidates))[row])


def _choose_taken(recordings: Sequence[ObservedRecording]) -> list[Array]:
    """Return weights that choose the likeliest candidate of the true answer; the most likely candidate where none gives it."""
    found = []
    for recording in recordings:
        questions = {observation.stamp_ns: question for observation, question in ask_main(recording)}
        for each in recording.observations:
            question, likelihood = questions.get(each.stamp_ns), each.candidates.likelihood
            if question is not None and (is_true := question.given == question.truth).any():
                found.append(np.eye(len(likelihood))[np.where(is_true, likelihood, -1.0).argmax()])
            else:
                found.append(_choose_leading(each))
    return found


SINGER_SETTINGS = np.array([*product(np.geomspace(0.05, 6.4, 8), (2e-4, 1e-3), (0.1, 0.3, 1.0))])
"""The settings that are tried, (s, 3): standard deviations of the acceleration [m/s^2] and of a measured position [m], and decay
time of the acceleration [s]."""


def forecast_singer(stamps_ns: NDArray[np.int64], positions: Array, at_ns: Array, ahead_s: Array) -> tuple[Array, Array]:
    """Forecast the positions some times (h,) [s] after each of some stamps (m,) [ns], which are among those of the samples.

    stamps_ns (n,), rising, and positions (n, 2) [m] of the samples. Returns the mean (m, s, h, 2) [m] and the variance (m, s, h)
    [m^2] per axis under each of the s `SINGER_SETTINGS`.
    """
    accelerations, noises, _ = SINGER_SETTINGS.T
    mean, covariance = np.zeros((len(noises), 3, 2)), np.zeros((len(noises), 3, 3))
    mean[:, 0], covariance[:, 0, 0] = positions[0], noises**2
    covariance[:, 1, 1], covariance[:, 2, 2] = 1.0, accelerations**2  # a velocity of 1 m/s
    wanted, found, last_ns, ahead = set(at_ns.tolist()), [], int(stamps_ns[0]), [_discretise(float(each)) for each in ahead_s]
    for stamp_ns, position in zip(stamps_ns.tolist(), positions, strict=True):
        if stamp_ns > last_ns:
            transition, added = _discretise((stamp_ns - last_ns) / NANOSECONDS)
            mean, covariance = transition @ mean, transition @ covariance @ transition.swapaxes(1, 2) + added
            gain = covariance[:, :, 0] / (covariance[:, 0, 0] + noises**2)[:, None]
            mean = mean + gain[:, :, None] * (position - mean[:, 0])[:, None]
            kept = np.eye(3) - gain[:, :, None] * np.eye(3)[0]
            # Joseph form: the covariance stays positive
            covariance = kept @ covariance @ kept.swapaxes(1, 2) + noises[:, None, None] ** 2 * gain[:, :, None] * gain[:, None]
            last_ns = stamp_ns
        if stamp_ns in wanted:
            wanted.remove(stamp_ns)
            rows = [(transition[:, 0], added[:, 0, 0]) for transition, added in ahead]  # of the position
            later = [(row[:, None] @ mean, (row[:, None] @ covariance @ row[..., None])[:, 0, 0] + more) for row, more in rows]
            found.append([np.stack(each, axis=1) for each in zip(*later, strict=True)])
    means, variances = (np.array(each) for each in zip(*found, strict=True))
    return means[:, :, :, 0], variances


@lru_cache(maxsize=4096)
def _discretise(dt: float) -> tuple[Array, Array]:
    """Return transition and added covariance (s, 3, 3) over dt [s] for each setting, by Van Loan (1978)."""
    accelerations, _, decays = SINGER_SETTINGS.T
    drift, rate = np.zeros((len(decays), 3, 3)), np.zeros((len(decays), 6, 6))
    drift[:, 0, 1] = drift[:, 1, 2] = 1.0
    drift[:, 2, 2] = -1.0 / decays
    rate[:, :3, :3], rate[:, 3:, 3:] = -drift, drift.swapaxes(1, 2)
    rate[:, 2, 5] = 2.0 * accelerations**2 / decays
    grown = expm(rate * dt)
    transition = grown[:, 3:, 3:].swapaxes(1, 2)
    return transition, transition @ grown[:, :3, 3:]


def score_singer(recordings: Sequence[ObservedRecording]) -> Array:
    """Return the negative log-densities (m, 3) of the true positions [nat, metres], each with the setting best for the others."""
    tables = []
    for recording in recordings:
        path, observations = recording.path, recording.observations
        stamps_ns = np.array([each.stamp_ns for each in observations])
        mean, variance = forecast_singer(path.stamps_ns, path.positions, stamps_ns, np.array(HORIZONS_S))
        true = np.array([each.truth.positions[HORIZONS] for each in observations])
        squared = ((true[:, None] - mean) ** 2).sum(axis=-1)
        tables.append(np.log(2.0 * np.pi * variance) + squared / (2.0 * variance))  # (m, s, 3), under each setting
    table = np.array([-np.nansum(each, axis=(0, 2)) for each in tables])
    chosen = choose_held_out(table)
    return np.concatenate([each[:, setting] for each, setting in zip(tables, chosen, strict=True)])
