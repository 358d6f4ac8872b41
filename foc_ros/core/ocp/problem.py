# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""One reaching problem, from a hand state to a goal among obstacles, with its data over the horizon."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TypedDict, Unpack

import numpy as np
from numpy.typing import NDArray

from foc_ros.core.errors import SceneError
from foc_ros.core.obstacle_table import Obstacles
from foc_ros.core.obstacles.geometry import find_offset
from foc_ros.core.obstacles.risk import CANTELLI, RiskBound, centre_trajectories, compute_safety_factor, size_moments
from foc_ros.core.plant.covariance import stack_noise
from foc_ros.core.plant.plants import Horizon, apply_impulse_response, find_states_at_goal, variance_weights
from foc_ros.core.safety_preference import HARD, SafetyPreference
from foc_ros.core.types import Array, Record, as_readonly

BOTH = np.ones(2)
SMALLEST_EXTENT = 1e-6
"""Least size of a scene [m]."""
REACHED = 1e-5
"""Shortfall of a safety factor that counts as rounding, relative to the wanted one where that is above 1."""


@dataclass(frozen=True, eq=False)
class Problem(Record):
    """The task of the forward optimal control, and what follows from it (computed once, when it is first needed).

    Parameters
    ----------
    horizon
        The plant over N steps, for n states of which the first four are position and velocity.
    initial_mean, initial_covariance
        The state now: (n,) and (n, n).
    error_map
        (N + 1, n, n): the effect of an error of the initial state at steps 0..N; `horizon.powers` where nothing corrects it.
    goal
        Goal state (n,).
    noise
        c of each channel for one step, (2,).
    obstacles
        The obstacles now.
    eta
        Wanted probability of avoidance, of the events that `risk` counts.
    at_goal
        (n,) bool: the states that the mean reaches exactly at the goal.
    terminal_weights, stage_weights
        (n,): weights w of the squared mean error and of the variance of each state at the last step, and at each step before it.
    recovery_s
        Time in which a hand that is inside a margin has to leave it [s].
    qp_backend
        Name of the solver of quadratic programmes.
    risk
        What a safety factor guarantees.
    preference
        How effort and safety are weighed where the wanted eta is dear.
    """

    horizon: Horizon
    initial_mean: Array
    initial_covariance: Array
    error_map: Array
    goal: Array
    noise: Array
    obstacles: Obstacles
    eta: float
    at_goal: NDArray[np.bool_]
    terminal_weights: Array
    stage_weights: Array
    recovery_s: float = 0.0
    qp_backend: str = 'piqp'
    risk: RiskBound = CANTELLI
    preference: SafetyPreference = HARD

    @cached_property
    def wanted_k(self) -> float:
        """The safety factor that guarantees the wanted eta."""
        return self.risk.find_safety_factor(self.eta)

    def is_reached(self, k: float) -> bool:
        """Whether a safety factor is the wanted one, rounding apart."""
        return k >= self.wanted_k - REACHED * max(self.wanted_k, 1.0)

    @cached_property
    def extent(self) -> float:
        """Size of the scene, to which tolerances are relative [m]: distance to the goal, or the largest radius."""
        x, y = (self.goal[:2] - self.initial_mean[:2]).tolist()
        return max(math.hypot(x, y), SMALLEST_EXTENT, float(self.obstacles.radius.max(initial=0.0)))

    @cached_property
    def free(self) -> Array:
        """Mean state at steps 0..N without control, (N + 1, n)."""
        return self.horizon.powers @ self.initial_mean

    @cached_property
    def free_covariance(self) -> Array:
        """The part of the state covariance at steps 0..N that the control does not cause, (N + 1, n, n)."""
        if not self.initial_covariance.any():
            return np.zeros_like(self.error_map)
        carried: Array = self.error_map @ self.initial_covariance @ self.error_map.swapaxes(1, 2)
        return carried

    @cached_property
    def drift(self) -> Array:
        """How far each centre moves in a step, (m, 2) [m]."""
        return as_readonly(self.obstacles.velocity * self.horizon.dt)

    @cached_property
    def centre_trajectories(self) -> Array:
        """Mean centres of the obstacles at steps 0..N, (N + 1, m, 2) [m]."""
        return centre_trajectories(self.obstacles.centre, self.drift, self.horizon.steps)

    @property
    def centres(self) -> Array:
        """Mean centres of the obstacles at steps 1..N, obstacle by obstacle, (m, N, 2) [m]."""
        return self.centre_trajectories[1:].swapaxes(0, 1)

    @cached_property
    def inside_margin(self) -> NDArray[np.bool_]:
        """Whether the hand is now inside the margin of each obstacle, (m,); never without a recovery time."""
        if self.recovery_s <= 0 or not len(self.obstacles):
            return np.zeros(len(self.obstacles), dtype=np.bool_)
        x, y = (self.initial_mean[:2] - self.obstacles.centre).T
        found = find_offset(x, y, self.obstacles.edges)
        normal = np.stack((found.normal_x, found.normal_y), axis=1)
        covariance = self.initial_covariance[:2, :2] + self.obstacles.centre_covariance
        variance = np.einsum('ji,jik,jk->j', normal, covariance, normal)
        k = compute_safety_factor(found.distance, variance, *self.size)
        inside: NDArray[np.bool_] = k < self.wanted_k
        return inside

    @cached_property
    def size(self) -> tuple[Array, Array]:
        """E[R^2] [m^2] and Var[R^2] [m^4] of each obstacle, (m,) each."""
        return size_moments(self.obstacles)

    @cached_property
    def noise_variance(self) -> Array:
        """c^2 for every entry of the stacked control, (2N,)."""
        return stack_noise(self.noise**2, self.horizon.steps)

    @property
    def summed_variance(self) -> Array:
        """(2N,): the sum over steps of the variances of x and y is this times u^2, plus the free part."""
        summed: Array = variance_weights(self.horizon.states[:2], BOTH, BOTH) * self.noise_variance
        return summed

    @property
    def weighted_variance(self) -> Array:
        """(2N,): the variance terms of J_X are this times u^2, plus the free part."""
        weights = self.terminal_weights, self.stage_weights
        weighted: Array = variance_weights(self.horizon.states, *weights) * self.noise_variance
        return weighted

    @cached_property
    def goal_rows(self) -> tuple[Array, Array, Array]:
        """Rows (r, 2N), targets (r,) and softness (r,) that bring the mean to the goal.

        Softness 0 is an equality; softness 1 / (2 w) is a term w (X_i - goal_i)^2 of the cost.
        """
        weighted = np.flatnonzero(~self.at_goal & (self.terminal_weights > 0.0))
        order = np.concatenate((np.flatnonzero(self.at_goal), weighted))
        rows, targets = self.horizon.last[order], (self.goal - self.free[-1])[order]
        softness = np.zeros(len(order))
        softness[len(order) - len(weighted) :] = 0.5 / self.terminal_weights[weighted]
        if not self.stage_weights.any():
            return rows, targets, softness
        stage, steps = np.flatnonzero(self.stage_weights > 0), self.horizon.steps
        before, missing = self.horizon.response[:-1, stage], (self.goal - self.free[1:-1])[:, stage]
        return (
            np.concatenate((rows, before.reshape(-1, 2 * steps))),
            np.concatenate((targets, missing.ravel())),
            np.concatenate((softness, np.tile(0.5 / self.stage_weights[stage], steps - 1))),
        )

    @cached_property
    def fixed_goal(self) -> tuple[Array, Array]:
        """Rows (e, 2N) of unit length and targets (e,) that the goal fixes, for controls in units of `Horizon.gain`."""
        rows, targets, softness = self.goal_rows
        is_fixed, rows = softness == 0.0, rows / self.horizon.gain
        length = np.sqrt((rows[is_fixed] ** 2).sum(axis=1))
        return rows[is_fixed] / length[:, None], targets[is_fixed] / length

    def states(self, control: Array) -> Array:
        """Return the mean state of a stacked control (2N,) at steps 0..N, (N + 1, n)."""
        moved: Array = self.free + apply_impulse_response(self.horizon.states, np.asarray(control, dtype=float)).T
        return moved

    def positions(self, control: Array) -> Array:
        """Return the mean positions of a stacked control (2N,) at steps 1..N, (N, 2) [m]."""
        return self.states(control)[1:, :2]


class ProblemOptions(TypedDict, total=False):
    """What may differ from the default problem of `rest_to_goal`.

    goal_weight: weight w of the position variance at the end; passing: whether the hand passes the goal at any constant velocity
    instead of resting there; recovery_s, initial_covariance, error_map, risk and preference: as in `Problem`.
    """

    goal_weight: float
    passing: bool
    recovery_s: float
    initial_covariance: Array
    error_map: Array
    risk: RiskBound
    preference: SafetyPreference


def rest_to_goal(
    horizon: Horizon,
    initial_mean: Array,
    goal_position: Array,
    obstacles: Obstacles,
    noise: Array,
    eta: float,
    **options: Unpack[ProblemOptions],
) -> Problem:
    """Build the default problem: the mean reaches the goal position exactly, at rest.

    Parameters
    ----------
    horizon
        The plant over N steps, for n states.
    initial_mean
        State now, (n,).
    goal_position
        (2,) [m].
    obstacles
        The obstacles now.
    noise
        c of each channel for one step, (2,).
    eta
        Wanted probability of avoidance.
    **options
        See :class:`ProblemOptions`.

    Raises
    ------
    SceneError
        If a number is not finite.
    """
    n = len(initial_mean)
    goal = np.zeros(n)
    goal[:2] = goal_position
    covariance = np.asarray(options.get('initial_covariance', np.zeros((n, n))), dtype=float)
    for field, value in (('start', initial_mean), ('goal', goal_position), ('noise', noise), ('start covariance', covariance)):
        if not np.isfinite(value).all():
            raise SceneError(field, 'finite numbers', np.asarray(value).tolist())
    return Problem(
        horizon=horizon,
        initial_mean=np.asarray(initial_mean, dtype=float),
        initial_covariance=covariance,
        error_map=options.get('error_map', horizon.powers),
        goal=goal,
        noise=np.asarray(noise, dtype=float),
        obstacles=obstacles,
        eta=eta,
        at_goal=find_states_at_goal(n, options.get('passing', False)),
        terminal_weights=np.where(np.arange(n) < 2, options.get('goal_weight', 0.0), 0.0),
        stage_weights=np.zeros(n),
        recovery_s=options.get('recovery_s', 0.0),
        risk=options.get('risk', CANTELLI),
        preference=options.get('preference', HARD),
    )


def group_by_response(problems: Sequence[Problem]) -> list[list[int]]:
    """Return the rows of the problems that have the same response of the position to the control, for each response."""
    groups: dict[int, list[int]] = {}
    for row, problem in enumerate(problems):
        groups.setdefault(id(problem.horizon.position_response), []).append(row)
    return list(groups.values())
