# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Likelihoods of homotopy classes from their costs: ratios of likelihoods are powers of ratios of costs.

    p_i / p_j = (J_j / J_i)^beta,  so  p_i = J_i^-beta / sum_j J_j^-beta,

which, unlike the usual exponential of cost differences, does not change with the unit of effort or the scale of the scene. This
is the rule `cost_ratio`; `likelihood.rule` can name another one, which maps costs to logarithms of weights. A class whose safety
factor k is below the wanted one has a smaller weight, by the factor exp(-likelihood.shortfall (k_wanted - k)).

J_i is the integral of the squared control of class i: its effort to go times the length of a step.

This is for operators who plan the whole way; among several goals they decide as `decide_goals` says. They do so where they
need less time than their planning horizon. Otherwise they look ahead: they weigh what is near and leave distant choices open,
with p' from the rules below. The horizon has a log-normal distribution with the median H = `likelihood.planning_horizon_s` and
the spread sigma, between operators or of one from choice to
choice, so that with the shortest time to go T of the classes

    p_i <- (1 - s) p_i + s p'_i,   s = Phi(log(T / H) / sigma).

An operator looks ahead by a time h that is exponentially distributed with the mean `likelihood.lookahead_s`. A path class W,
with all goals to which it leads, has the weight V_W = sum_{i in W} J_i^-beta. The path classes that branch off from W later than
h, S_W(h) = {W': tau_WW' > h}, are not yet distinguished from W, so that each gets their mean weight:

    p'_W = exp(u_W) / sum_W' exp(u_W'),  u_W = E_h[log mean_{W' in S_W(h)} V_W'],  and within W  p'_i = p'_W J_i^-beta / V_W.

A choice that lies tau ahead is therefore made with the exponent beta exp(-tau / lookahead_s): by the ratio of costs when it is
near, evenly when it is far. With a `lookahead_s` of 0, h is infinite.

These p'_i give the probabilities of the gaps of the next row. All ways beyond this row are equally likely, however many goals
they lead to. With the classes G that take the same gap in the next row as class i, on n ways through all rows, and those W of its
own way, which differ in their goals,

    p'_i <- (sum_{j in G} p'_j) / n  p_i / sum_{j in W} p_j.

Where no row is ahead, W and G are the classes that lead to the same goal, and all is decided as near.

The weight of a class that weaves through w_i rows (`classes.rows`) is smaller by exp(-`likelihood.weaving` w_i), in both p, p'.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from .classes.rows import Decisions
from .classes.sides import BranchTimes
from .config import WHOLE_WAY_S, LikelihoodConfig
from .errors import InputError
from .registry import LIKELIHOOD_RULES
from .safety_preference import COST_FLOOR
from .types import Array

LEAST_LOG = -700.0
"""Least logarithm of a weight relative to the largest one: a rule may give a class no weight at all, and numbers stay finite."""
BETWEEN_OPERATORS, OWN_SPREAD = 1.0, 0.3
"""Standard deviation of the logarithm of the planning horizon: between operators, and of one operator from choice to choice."""


class ClassGoals(NamedTuple):
    """The goals of k classes: row (k,) of each, and factors on the likelihoods of the goals (g,), None where they are one."""

    row: NDArray[np.intp]
    weights: Array | None = None


def compute_likelihoods(
    costs: Array,
    config: LikelihoodConfig,
    branch_times: BranchTimes | None = None,
    shortfalls: Array | None = None,
    decisions: Decisions | None = None,
    time_s: float = 0.0,
    planning_spread: float = BETWEEN_OPERATORS,
    goals: ClassGoals | None = None,
) -> Array:
    """Return the likelihoods (k,) of classes by the rule that `likelihood.rule` names; they sum to one.

    Parameters
    ----------
    costs
        Costs J_i (k,) >= 0 [m^2/s^5]; those below `COST_FLOOR` count as `COST_FLOOR`, to keep numbers in range.
    config
        The rule and its parameters.
    branch_times
        When the classes branch off, for a look-ahead only.
    shortfalls
        By how much safety factors are below the wanted one, (k,) >= 0; zero if not given.
    decisions
        Gaps and ways of the classes, without which all choices are near.
    time_s
        Shortest time to go of the classes [s].
    planning_spread
        Standard deviation of the logarithm of the planning horizon.
    goals
        The goals of the classes, if there are several.

    Raises
    ------
    InputError
        For a cost that is negative or not finite.
    """
    values = np.asarray(costs, dtype=float)
    for row, value in enumerate(values.tolist()):
        if not 0.0 <= value < math.inf:
            raise InputError(f'costs[{row}]', 'a finite number >= 0', value)
    losses = np.zeros(len(values))
    if shortfalls is not None:
        np.multiply(config.shortfall, shortfalls, out=losses, where=shortfalls > 0.0)
    logs = LIKELIHOOD_RULES.get(config.rule)(values, config) - losses
    best = logs.max(initial=-np.inf)
    logs = np.maximum(logs - best, LEAST_LOG) if np.isfinite(best) else np.zeros(len(values))
    woven = np.zeros(len(values)) if decisions is None else config.weaving * decisions.woven
    planned = normalise_logs(logs - woven)
    if goals is not None and len(logs):
        planned = decide_goals(planned, values, goals, config)
    share = compute_lookahead_share(time_s, config, planning_spread)
    if share == 0.0 or not len(logs) or (branch_times is None and decisions is None):
        return planned
    near = logs
    if config.lookahead_s > 0.0 and branch_times is not None:
        near = _weigh_by_lookahead(logs, branch_times, config.lookahead_s)
    if decisions is not None:
        beyond = logs - woven - _sum_weights(logs, decisions.way)
        near = beyond + _sum_weights(near - woven, decisions.next_gap) - _sum_weights(beyond, decisions.next_gap)
    mixed: Array = (1.0 - share) * planned + share * normalise_logs(near)
    return mixed


def decide_goals(shares: Array, costs: Array, goals: ClassGoals, config: LikelihoodConfig) -> Array:
    """Return the likelihoods (k,) of classes whose goals were chosen first.

    The likelihood of a goal follows from the least cost of its classes, times its weight. Its classes divide it as before.

    Parameters
    ----------
    shares
        Likelihoods of the classes (k,) before the choice of goals.
    costs
        Their costs (k,), comparable between goals [m^2/s^5].
    goals
        Their goals.
    config
        The rule and its parameters.
    """
    rows, group = np.unique(goals.row, return_inverse=True)
    least = np.full(len(rows), np.inf)
    np.minimum.at(least, group, costs)
    of_goal = compute_likelihoods(least, config) * (1.0 if goals.weights is None else goals.weights[rows])
    decided = divide_among_groups(shares, group, of_goal)
    decided /= decided.sum()
    return decided


def divide_among_groups(weights: Array, group: NDArray[np.intp], totals: Array) -> Array:
    """Return weights (k,) scaled so that those of each group sum to its total (g,); a group without weights gets none."""
    sums = np.bincount(group, weights, len(totals))
    divided: Array = weights * np.divide(totals, sums, out=np.zeros_like(totals), where=sums > 0.0)[group]
    return divided


def compute_lookahead_share(time_s: float, config: LikelihoodConfig, planning_spread: float) -> float:
    """Return the probability Phi(log(T / H) / sigma) that an operator looks ahead whose time to go is time_s [s]."""
    if config.planning_horizon_s == 0.0:
        return 1.0
    if time_s <= 0.0 or config.planning_horizon_s >= WHOLE_WAY_S:
        return 0.0
    log_ratio = math.log(config.planning_horizon_s) - math.log(time_s)
    return 0.5 * math.erfc(log_ratio / (math.sqrt(2.0) * planning_spread))


def cost_ratio_logs(costs: Array, config: LikelihoodConfig) -> Array:
    """Return log J_i^-beta, (k,), for costs (k,): the rule `cost_ratio`."""
    logs: Array = -config.beta * np.log(np.maximum(costs, COST_FLOOR))
    return logs


def normalise_logs(logs: Array) -> Array:
    """Return the weights (k,) that are proportional to exp(logs) and sum to one."""
    if not len(logs):
        return np.zeros(0)
    weights: Array = np.exp(logs - logs.max())
    weights /= weights.sum()
    return weights


def _sum_weights(logs: Array, group: NDArray[np.intp]) -> Array:
    """Return for each class the logarithm (k,) of the sum of the weights exp(logs) of its group."""
    sums = np.full(int(group.max()) + 1, -np.inf)
    np.logaddexp.at(sums, group, logs)
    summed: Array = sums[group]
    return summed


def _weigh_by_lookahead(logs: Array, branch_times: BranchTimes, lookahead_s: float) -> Array:
    """Return u_W + log(J_i^-beta / V_W) of each class, (k,), from the logarithms of J_i^-beta."""
    numbers, path_class = np.unique(branch_times.path_class, return_inverse=True)
    weight = np.full(len(numbers), -np.inf)
    np.logaddexp.at(weight, path_class, logs)
    after_s = np.full((len(numbers), len(numbers)), np.inf)
    np.minimum.at(after_s, (path_class[:, None], path_class), branch_times.after_s)
    order = np.argsort(after_s, axis=1, kind='stable')
    # Column m: the classes from rank m on, which have not branched off while h lies between the branch times m - 1 and m.
    total = np.logaddexp.accumulate(weight[order][:, ::-1], axis=1)[:, ::-1]
    mean = total - np.log(np.arange(len(numbers), 0, -1))
    later = np.exp(-np.take_along_axis(after_s, order, axis=1) / lookahead_s)
    probability = -np.diff(later, axis=1, prepend=1.0)
    weighted: Array = ((probability * mean).sum(axis=1) - weight)[path_class] + logs
    return weighted
