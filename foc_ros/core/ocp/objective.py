# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What the solver minimises: the logarithm of the cost, and what missing safety costs.

    loss = ln J(u) + rate (k_wanted - k)+ + floor (-k)+,   J = sum w u^2 + soft goals + fixed part,

with rate = shortfall / beta of the preference, so that beta times the loss is what the likelihood compares.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from foc_ros.core.safety_preference import COST_FLOOR
from foc_ros.core.types import Array

from .margin import Indices
from .problem import Problem
from .qp import Quadratic

FLOOR, LEAST_FLOOR = 20.0, 300.0
"""How much more a mean inside an obstacle costs than a smaller safety factor, for a unit of it: by this factor, at least this."""


class Cost(NamedTuple):
    """The cost and the goal of one problem, for a control in units of `Horizon.gain`.

    weights (2N,): of the squared control at lambda 0; fixed: part of the cost; goal_rows (e, 2N) of unit length and goal_targets
    (e,): what the goal fixes; soft_rows (s, 2N), soft_targets and soft_weights (s,): what it weighs.
    """

    weights: Array
    fixed: float
    goal_rows: Array
    goal_targets: Array
    soft_rows: Array
    soft_targets: Array
    soft_weights: Array


def tabulate_cost(problem: Problem) -> Cost:
    """Return the cost and the goal of a problem."""
    gain, dt = problem.horizon.gain, problem.horizon.dt
    fixed = (problem.preference.fixed_cost / problem.preference.dt + COST_FLOOR / dt) * gain**2
    rows, targets, softness = problem.goal_rows
    is_soft = softness > 0.0
    return Cost(
        1.0 + problem.weighted_variance,
        fixed,
        *problem.fixed_goal,
        rows[is_soft] / gain,
        targets[is_soft],
        0.5 * gain**2 / softness[is_soft],
    )


class Objective:
    """The objective of b problems.

    Parameters
    ----------
    problems : Sequence[Problem]
        The problems.
    wanted_k, rate : Array
        Wanted safety factor, and the worth of a unit of it in logarithms of cost, (b,).
    lam : Array
        Weight of the summed variances, (b,).
    """

    def __init__(self, problems: Sequence[Problem], wanted_k: Array, rate: Array, lam: Array) -> None:
        self.wanted_k = wanted_k
        self.set_rate(rate)
        # candidates with one goal share their problem
        known = {key: tabulate_cost(each) for key, each in {id(each): each for each in problems}.items()}
        costs = [known[id(each)] for each in problems]
        self.weights = np.stack([each.weights for each in costs])
        if lam.any():
            self.weights += lam[:, None] * np.stack([each.summed_variance for each in problems])
        self.fixed = np.array([each.fixed for each in costs])
        self.goal_rows = pad_rows([each.goal_rows for each in costs])
        self.goal_targets = pad_rows([each.goal_targets for each in costs])
        self.soft_rows = pad_rows([each.soft_rows for each in costs])
        self.soft_targets = pad_rows([each.soft_targets for each in costs])
        self.soft_weights = pad_rows([each.soft_weights for each in costs])
        self.beta = np.array([each.preference.beta for each in problems])
        # by this the losses of problems with different steps differ from those of costs in m^2/s^5
        self._scale = np.array([math.log(each.horizon.dt) - 2.0 * math.log(each.horizon.gain) for each in problems])
        self._goal = np.unique([each.goal for each in problems], axis=0, return_inverse=True)[1].reshape(-1)

    def set_rate(self, rate: Array) -> None:
        """Set the worth of a unit of safety (b,), and with it that of a mean that stays out of the obstacles."""
        self.rate, self.floor = rate, np.maximum(FLOOR * rate, LEAST_FLOOR)

    def compute_cost(self, rows: Indices, control: Array) -> Array:
        """Return J of controls (r, 2N) of some problems, in units of `Horizon.gain`^2."""
        missed = (self.soft_rows[rows] @ control[..., None])[..., 0] - self.soft_targets[rows]
        cost: Array = (self.weights[rows] * control**2).sum(axis=1) + (self.soft_weights[rows] * missed**2).sum(axis=1)
        cost += self.fixed[rows]
        return cost

    def compute_loss(self, rows: Indices, cost: Array, k: Array) -> Array:
        """Return the loss (r,) for costs and safety factors (r,)."""
        loss: Array = np.log(cost) + self.compute_penalty(rows, k)
        return loss

    def compute_penalty(self, rows: Indices, k: Array) -> Array:
        """Return what missing safety costs, (r,)."""
        short = np.maximum(self.wanted_k[rows] - np.maximum(k, 0.0), 0.0)
        penalty: Array = self.rate[rows] * short + self.floor[rows] * np.maximum(-k, 0.0)
        return penalty

    def expand(self, rows: Indices, control: Array, cost: Array) -> Quadratic:
        """Return ln J about controls (r, 2N) of some problems, for their costs (r,)."""
        share, soft = 2.0 / cost[:, None], self.soft_weights[rows]
        missed = (self.soft_rows[rows] @ control[..., None])[..., 0] - self.soft_targets[rows]
        gradient = share * (self.weights[rows] * control + ((soft * missed)[:, None] @ self.soft_rows[rows])[:, 0])
        return Quadratic(gradient, share * self.weights[rows], self.soft_rows[rows], share * soft, self.goal_rows[rows])

    def meet_goal(self, control: Array) -> Array:
        """Return the nearest controls (b, 2N) that meet the goals exactly."""
        missing = self.goal_targets - (self.goal_rows @ control[..., None])[..., 0]
        square = self.goal_rows @ self.goal_rows.swapaxes(1, 2)
        shares = np.linalg.pinv(square, hermitian=True) @ missing[..., None]
        met: Array = control + (self.goal_rows.swapaxes(1, 2) @ shares)[..., 0]
        return met

    def compare(self, loss: Array) -> Array:
        """Return how much less likely each problem is than the best one with its goal, for losses (b,), as a logarithm.

        Costs do not tell how likely goals are (`core.goals`): a goal that needs more effort may be the likely one.
        """
        absolute = loss + self._scale
        best = np.full(len(absolute), np.inf)
        np.minimum.at(best, self._goal, absolute)
        behind: Array = self.beta * (absolute - best[self._goal])
        return behind


def pad_rows(tables: Sequence[Array]) -> Array:
    """Return arrays with different numbers of rows as one, filled up by zeros."""
    most = max(len(each) for each in tables)
    if all(len(each) == most for each in tables):
        return np.stack(tables)
    return np.stack([np.pad(each, [(0, most - len(each))] + [(0, 0)] * (each.ndim - 1)) for each in tables])
