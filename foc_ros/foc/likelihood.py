"""From costs to likelihoods: ratios of likelihoods are powers of ratios of costs.

    p_i / p_j = (J_j / J_i)^beta,  so  p_i = J_i^-beta / sum_j J_j^-beta,

which, unlike the usual exponential of cost differences, does not change with the unit of effort or the scale of the scene.

J_i = J_0 + w J_spent + J_to_go,i is the effort to go through class i and what all share: w of the effort spent since onset
(`likelihood.spent_share`), and a constant (`likelihood.base_effort`). The larger J_0, the more the rule becomes the
exponential of differences: (1 + J / J_0)^-beta -> exp(-beta J / J_0).

People weigh what is near, and leave far choices open. Where `likelihood.lookahead_s` is set, they look ahead by a time h that is
exponentially distributed with that mean. Ways that part later than h, S_i(h) = {j: tau_ij > h}, then look the same, and are worth
the mean over them,

    u_i = E_h[log mean_{j in S_i(h)} J_j^-beta],  p_i = q_i exp(u_i) / sum_j q_j exp(u_j),

with means weighted by q_j = 1 / (number of goals to which the way of j leads): a way round counts once. So a choice that lies tau
ahead is made with the exponent beta exp(-tau / lookahead_s): by the cost ratio when it is near, evenly when it is far.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from .config import LikelihoodConfig
from .errors import InputError
from .partings import Partings
from .records import Array

COST_FLOOR = 1e-9
"""Least cost told apart from none [m^2/s^5]: the effort of a reach of 1 um in 1 s, 720 D^2 / T^5 = 7e-10."""


def shared_cost(effort_spent: float, config: LikelihoodConfig) -> float:
    """Return the part of the cost [m^2/s^5] that all classes share, of a movement that has taken effort_spent [m^2/s^5]."""
    return config.base_effort + config.spent_share * effort_spent


def likelihoods(costs: Array, config: LikelihoodConfig, partings: Partings | None = None) -> Array:
    """Return the likelihoods (k,) of classes with costs (k,) >= 0 [m^2/s^5], summing to one; none for none.

    partings: of these classes, not asked for without a look-ahead. Costs below `COST_FLOOR` count as that. Computed from
    logarithms, so nothing overflows. Raises InputError for a cost that is negative or not finite.
    """
    values = np.asarray(costs, dtype=float)
    if not len(values):
        return np.zeros(0)
    wrong = np.flatnonzero(~(np.isfinite(values) & (values >= 0.0)))
    if len(wrong):
        raise InputError(f'costs[{wrong[0]}]', 'a finite number >= 0', values[wrong[0]])
    logs = -config.beta * np.log(np.maximum(values, COST_FLOOR))
    if config.lookahead_s > 0.0 and partings is not None:
        logs = _looking_ahead(logs - logs.max(), partings, config.lookahead_s)
    weights = np.exp(logs - logs.max())
    shares: Array = weights / weights.sum()
    return shares


def _looking_ahead(logs: Array, partings: Partings, lookahead_s: float) -> Array:
    """Return log(q_i) + E_h[log of the q-weighted mean of exp(logs) over those not parted from i by h], (k,)."""
    weight = 1.0 / np.bincount(partings.way)[partings.way]
    order = np.argsort(partings.after_s, axis=1, kind='stable')
    # Column m: of those from rank m on, which are what has not parted while h lies between the partings of ranks m - 1 and m.
    total = np.logaddexp.accumulate((logs + np.log(weight))[order][:, ::-1], axis=1)[:, ::-1]
    mean = total - np.log(np.cumsum(weight[order][:, ::-1], axis=1)[:, ::-1])
    later = np.exp(-np.take_along_axis(partings.after_s, order, axis=1) / lookahead_s)
    chance = -np.diff(later, axis=1, prepend=1.0)
    ahead: Array = np.log(weight) + (chance * mean).sum(axis=1)
    return ahead


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
