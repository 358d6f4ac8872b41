"""How far predicted positions are from the true ones, and how many of these the predicted ellipses hold."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from foc_ros.core.types import Array

from .heldout import asked
from .minimum_jerk import straight_cost, straight_positions
from .observations import HORIZONS_S, TIMES_S, Observation, Observations
from .regions import denser

LEVELS = (0.5, 0.9)
"""Probabilities of the ellipses."""
TIMES = np.array(TIMES_S)
EXACT = 1e-18
"""Variance of a position that is known [m^2]: a nanometre's."""


def position_scores(recordings: Sequence[Observations]) -> dict[str, Any]:
    """Return average and final displacement errors [m] by predictor and horizon, and the shares inside of what was predicted.

    inside: the ellipse of the most likely way; inside_taken: of the way that was taken; inside_all: the smallest region of all
    ways together. The average is over the times up to the horizon; a horizon counts where the recording goes on until then.
    """
    seen = [each for recording in recordings for each in recording.each]
    true = np.array([each.truth.positions for each in seen])
    likely, taken = [_leading(each) for each in seen], _taken(recordings)
    beyond = np.array([mixture_levels(each, each.ways.likelihood, each.ways.covariance) for each in seen])
    predicted = {
        'most likely': np.array([each.ways.mean[row] for each, row in zip(seen, likely, strict=True)]),
        'likelihood-weighted': np.array([np.tensordot(each.ways.likelihood, each.ways.mean, 1) for each in seen]),
        'constant velocity': np.array([_going_on(each) for each in seen]),
        'straight minimum jerk': np.array([_straight(each) for each in seen]),
    }
    return {
        'displacement_m': {name: _errors(positions, true) for name, positions in predicted.items()},
        'inside': {f'{level:g}': _by_horizon(_inside(seen, likely, true, level)) for level in LEVELS},
        'inside_taken': {f'{level:g}': _by_horizon(_inside(seen, taken, true, level)) for level in LEVELS},
        'inside_all': {f'{level:g}': _by_horizon(_within(beyond, level)) for level in LEVELS},
    }


def _errors(positions: Array, true: Array) -> dict[str, dict[str, float | None]]:
    apart = np.hypot(*(positions - true).transpose(2, 0, 1))
    average = np.cumsum(apart, axis=1) / np.arange(1, len(TIMES) + 1)
    return {'average': _by_horizon(average), 'final': _by_horizon(apart)}


def _by_horizon(values: Array) -> dict[str, float | None]:
    """Return the mean (m, h) over predictions at each of the horizons; nan does not count."""
    at = {f'{horizon:g}': values[:, TIMES_S.index(horizon)] for horizon in HORIZONS_S}
    return {name: float(np.nanmean(each)) if np.isfinite(each).any() else None for name, each in at.items()}


def _inside(seen: Sequence[Observation], chosen: Sequence[int], true: Array, level: float) -> Array:
    """Return 1 where the ellipse of a chosen candidate holds the true position, 0 where not, nan where there is none."""
    mean = np.array([each.ways.mean[row] for each, row in zip(seen, chosen, strict=True)])
    covariance = np.array([each.ways.covariance[row] for each, row in zip(seen, chosen, strict=True)])
    return held(true - mean, covariance, level)


def mixture_levels(seen: Observation, likelihood: Array, covariance: Array) -> Array:
    """Return what is denser than the true positions (h,), at the horizons, nan elsewhere: see `regions`."""
    levels = np.full(len(TIMES), np.nan)
    at = [TIMES_S.index(horizon) for horizon in HORIZONS_S]
    levels[at] = denser(likelihood, seen.ways.mean[:, at], covariance[:, at] + EXACT * np.eye(2), seen.truth.positions[at])
    return levels


def _within(levels: Array, level: float) -> Array:
    return np.where(np.isfinite(levels), (levels < level).astype(float), np.nan)


def held(away: Array, covariance: Array, level: float) -> Array:
    """Return 1 where the ellipse of a probability holds a point, 0 where not, nan where there is none.

    away (..., 2) [m] from its middle, covariance (..., 2, 2): by the chi-square of two degrees of freedom.
    """
    squared = (away * np.linalg.solve(covariance + EXACT * np.eye(2), away[..., None])[..., 0]).sum(axis=-1)
    return np.where(np.isfinite(squared), (squared <= -2.0 * np.log(1.0 - level)).astype(float), np.nan)


def _leading(seen: Observation) -> int:
    """Return the row of the most likely way, as published."""
    return seen.ways.labels.index(seen.most_likely) if seen.most_likely else int(seen.ways.likelihood.argmax())


def _taken(recordings: Sequence[Observations]) -> list[int]:
    """Return the row of the likeliest candidate of those that go the way taken; of the most likely way where none does."""
    rows = []
    for recording in recordings:
        about = {seen.stamp_ns: question for seen, question in asked(recording)}
        for seen in recording.each:
            question = about.get(seen.stamp_ns)
            same = question.given == question.truth if question is not None else np.zeros(len(seen.ways), dtype=bool)
            rows.append(int(np.where(same, seen.ways.likelihood, -1.0).argmax()) if same.any() else _leading(seen))
    return rows


def _going_on(seen: Observation) -> Array:
    velocity = seen.hand[2:4] if seen.since_s > 0.0 else np.zeros(2)
    return np.asarray(seen.hand[:2] + TIMES[:, None] * velocity)


def _straight(seen: Observation) -> Array:
    return straight_positions(seen, int(straight_cost(seen).argmin()), TIMES)
