"""From costs to likelihoods: ratios of likelihoods are powers of ratios of costs.

    p_i / p_j = (J_j / J_i)^beta,  so  p_i = J_i^-beta / sum_j J_j^-beta,

which, unlike the usual exponential of cost differences, does not change with the unit of effort or the scale of the scene.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from .errors import InputError
from .records import Array

COST_FLOOR = 1e-9
"""Least cost told apart from none [m^2/s^5]: the effort of a reach of 1 um in 1 s, 720 D^2 / T^5 = 7e-10."""


def likelihoods(costs: Array, beta: float) -> Array:
    """Return the likelihoods (k,) of classes with costs (k,) >= 0 [m^2/s^5], summing to one; none for none.

    Costs below `COST_FLOOR` count as that. Computed from logarithms, so nothing overflows. Raises InputError for a cost that is
    negative or not finite.
    """
    values = np.asarray(costs, dtype=float)
    if not len(values):
        return np.zeros(0)
    wrong = np.flatnonzero(~(np.isfinite(values) & (values >= 0.0)))
    if len(wrong):
        raise InputError(f'costs[{wrong[0]}]', 'a finite number >= 0', values[wrong[0]])
    logs = -beta * np.log(np.maximum(values, COST_FLOOR))
    weights = np.exp(logs - logs.max())
    shares: Array = weights / weights.sum()
    return shares


def most_likely(labels: Sequence[str], likelihoods: Array, previous: str | None, margin: float) -> str | None:
    """Return the label of the most likely class, which stays `previous` until another leads by more than `margin`.

    Of equally likely ones the label first in the alphabet holds, whatever the order of the input. None for none.
    """
    if not labels:
        return None
    ranked = sorted(zip(labels, likelihoods, strict=True), key=lambda item: (-item[1], item[0]))
    best, lead = ranked[0]
    held = dict(ranked).get(previous) if previous is not None else None
    return previous if held is not None and lead - held <= margin else best
