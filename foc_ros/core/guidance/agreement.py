"""The sum of the candidates' forces, weakened by their disagreement, and candidates that are missing for a moment."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from foc_ros.core.types import Array, Prediction

MISSING_S = 0.2
"""Longest time for which a candidate that could not be solved keeps the likelihood that it had last [s]."""
Known = Mapping[str, tuple[float, float]]
"""Likelihood, and the time at which the candidate had it [s], by label."""


def remember_likelihoods(prediction: Prediction, known: Known) -> dict[str, tuple[float, float]]:
    """Return the last likelihood of every candidate of a prediction, and of those that it could not solve for `MISSING_S`."""
    kept = {
        each.label: known[each.label]
        for each in prediction.candidates
        if not each.has_likelihood and each.label in known and prediction.t - known[each.label][1] <= MISSING_S
    }
    return kept | {each.label: (each.likelihood, prediction.t) for each in prediction.candidates_with_likelihood}


def weigh_candidates(labels: tuple[str, ...], likelihoods: Array, known: Known, sharpness: float) -> Array:
    """Return the weights w_i (c,) of candidates with a likelihood p_i.

    Candidates that could not be solved take part with the likelihood q_j that they had last, and without a force of their own,
    so that the force of the others does not grow because one is missing. With the sharpness g,

        w_i = p_i^g / (sum_i p_i^g + sum_j q_j^g).
    """
    missing = sum(likelihood**sharpness for label, (likelihood, _) in known.items() if label not in labels)
    powers = likelihoods**sharpness
    total = float(powers.sum()) + missing
    weights: Array = powers / total if total > 0.0 else np.zeros(len(powers))
    return weights


def combine(weights: Array, forces: Array) -> tuple[Array, float]:
    """Return f = a sum_i p_i f_i (2,) [N] and the agreement a in [0, 1] of forces (c, 2) [N] with weights p_i (c,).

        a = |sum_i p_i f_i| / sum_i p_i |f_i|

    The agreement is 1 where all likely candidates pull the same way or none pulls, and 0 where they cancel.
    """
    total = weights @ forces
    separate = float(weights @ np.hypot(forces[:, 0], forces[:, 1]))
    agreement = min(float(np.hypot(*total)) / separate, 1.0) if separate > 0.0 else 1.0
    return agreement * total, agreement
