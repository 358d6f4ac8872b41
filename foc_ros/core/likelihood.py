"""From costs to likelihoods: ratios of likelihoods are powers of ratios of costs.

    p_i / p_j = (J_j / J_i)^beta,  so  p_i = J_i^-beta / sum_j J_j^-beta,

which, unlike the usual exponential of cost differences, does not change with the unit of effort or the scale of the scene.

J_i is the effort to go through class i, where time has a price what its duration costs (`duration.time_price`), and what all
share: a part of the effort spent since onset (`likelihood.spent_share`).

People weigh what is near, and leave far choices open. Where `likelihood.lookahead_s` is set, they look ahead by a time h that is
exponentially distributed with that mean. A way round W, with all goals to which it leads, is worth V_W = sum_{i in W} J_i^-beta.
Ways that part from W later than h, S_W(h) = {W': tau_WW' > h}, look the same as W, and are worth their mean:

    p_W = exp(u_W) / sum_W' exp(u_W'),  u_W = E_h[log mean_{W' in S_W(h)} V_W'],  and within W  p_i = p_W J_i^-beta / V_W.

So a choice that lies tau ahead is made with the exponent beta exp(-tau / lookahead_s): by the ratio of costs when it is near,
evenly when it is far. Looking ahead without end, h is infinite, and p_i is as above.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from .config import LikelihoodConfig
from .errors import InputError
from .homotopy.branch_times import BranchTimes
from .kernels import Vector, compiled
from .types import Array

COST_FLOOR = 1e-9
"""Least cost told apart from none [m^2/s^5]: the effort of a reach of 1 um in 1 s, 720 D^2 / T^5 = 7e-10."""


def compute_shared_cost(effort_spent: float, config: LikelihoodConfig) -> float:
    """Return the part of the cost [m^2/s^5] that all classes share, of a movement that has taken effort_spent [m^2/s^5]."""
    return config.spent_share * effort_spent


def compute_likelihoods(costs: Array, config: LikelihoodConfig, partings: BranchTimes | None = None) -> Array:
    """Return the likelihoods (k,) of classes with costs (k,) >= 0 [m^2/s^5], summing to one; none for none.

    partings: of these classes, not asked for without a look-ahead. Costs below `COST_FLOOR` count as that. Computed from
    logarithms, so nothing overflows. Raises InputError for a cost that is negative or not finite.
    """
    values = np.ascontiguousarray(costs, dtype=float)
    for row, value in enumerate(values.tolist()):
        if not 0.0 <= value < math.inf:
            raise InputError(f'costs[{row}]', 'a finite number >= 0', value)
    logs = worths(values, config.beta)
    if config.lookahead_s > 0.0 and partings is not None and len(logs):
        logs = _looking_ahead(logs - logs.max(), partings, config.lookahead_s)
    return shares(logs)


@compiled
def worths(costs: Vector, beta: float) -> Vector:
    """Return log J_i^-beta, (k,)."""
    return -beta * np.log(np.maximum(costs, COST_FLOOR))


@compiled
def shares(logs: Vector) -> Vector:
    """Return what is proportional to exp(logs) and sums to one, (k,)."""
    if not len(logs):
        return np.zeros(0)
    weights: Array = np.exp(logs - logs.max())
    weights /= weights.sum()
    return weights


def _looking_ahead(logs: Array, partings: BranchTimes, lookahead_s: float) -> Array:
    """Return u_W + log(J_i^-beta / V_W) of each class, (k,), from the logarithms of J_i^-beta."""
    numbers, way = np.unique(partings.way, return_inverse=True)
    worth = np.full(len(numbers), -np.inf)
    np.logaddexp.at(worth, way, logs)
    after_s = np.full((len(numbers), len(numbers)), np.inf)
    np.minimum.at(after_s, (way[:, None], way), partings.after_s)
    order = np.argsort(after_s, axis=1, kind='stable')
    # Column m: of those from rank m on, which are what has not parted while h lies between the partings of ranks m - 1 and m.
    total = np.logaddexp.accumulate(worth[order][:, ::-1], axis=1)[:, ::-1]
    mean = total - np.log(np.arange(len(numbers), 0, -1))
    later = np.exp(-np.take_along_axis(after_s, order, axis=1) / lookahead_s)
    chance = -np.diff(later, axis=1, prepend=1.0)
    weighed: Array = ((chance * mean).sum(axis=1) - worth)[way] + logs
    return weighed


def select_most_likely(likelihoods: Mapping[str, float], previous: str | None, margin: float) -> str | None:
    """Return the label of the most likely class, which stays `previous` until another leads by more than `margin`.

    likelihoods: by label. Of equally likely ones the label first in the alphabet holds, whatever the order of the input. None
    for none.
    """
    if not likelihoods:
        return None
    lead, best = min((-share, label) for label, share in likelihoods.items())
    held = likelihoods.get(previous) if previous is not None else None
    return previous if held is not None and -lead - held <= margin else best
