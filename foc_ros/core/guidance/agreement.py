"""The sum of the candidates' forces, weakened by their disagreement and by that of the hand; candidates that are missing."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

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


def combine(weights: Array, forces: Array, is_idle: NDArray[np.bool_]) -> tuple[Array, float]:
    """Return f = a sum_i w_i b_i f_i (2,) [N] and the agreement a in [0, 1] of forces (c, 2) [N] with weights w_i (c,).

        a = |sum_i w_i b_i f_i| / sum_i w_i |f_i|

    Candidates that are idle (c,) give no force, b_i = 0, and count in the agreement as others do; b_i = 1 otherwise. The
    agreement is 1 where all likely candidates pull the same way or none pulls, and 0 where they cancel.
    """
    total = weights @ np.where(is_idle[:, None], 0.0, forces)
    separate = float(weights @ np.hypot(forces[:, 0], forces[:, 1]))
    agreement = min(float(np.hypot(*total)) / separate, 1.0) if separate > 0.0 else 1.0
    return agreement * total, agreement


def yield_to_hand(force: Array, acceleration: Array, strongest: float) -> Array:
    """Return a force (2,) [N] that falls as the hand accelerates against it, and is zero from an acceleration A on.

        f <- f clip(1 + f . a / (|f| A), 0, 1)

    A hand that accelerates against a force of guidance is pushed by its operator, and more strongly than by guidance, whatever
    its mass is. The operator wants another way, which the likelihoods will say later.

    acceleration: a (2,), of the hand [m/s^2]; strongest: A [m/s^2], 0 for a force that does not fall.
    """
    size = float(np.hypot(*force))
    if not strongest or not size:
        return force
    return force * min(max(1.0 + float(force @ acceleration) / (size * strongest), 0.0), 1.0)
