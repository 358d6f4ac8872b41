# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Where the search for a solution begins: at a guess of the path, or at an earlier solution, shifted in time."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from foc_ros.core.solution import Solution
from foc_ros.core.types import Array

from .margin import Indices
from .problem import Problem


class Forces(NamedTuple):
    """Contacts of one movement: rows of the obstacles, times [steps] and multipliers [1/m] of ln J; (q,) each."""

    obstacle: Indices
    time: Array
    multiplier: Array


NO_FORCES = Forces(np.zeros(0, dtype=np.intp), np.zeros(0), np.zeros(0))


@dataclass(frozen=True, eq=False)
class Start:
    """Where a strategy begins.

    path (N + 1, 2): positions at steps 0..N, which tell the homotopy class [m]. A start from an earlier solution also has its
    stacked control (2N,), its contacts, its safety factor and its lambda; control and lam are None for a guess.
    """

    path: Array
    control: Array | None = None
    forces: Forces = field(default=NO_FORCES)
    safety_factor: float = 0.0
    lam: float | None = None


def cold_start(guess: Array) -> Start:
    """Start at a guess (N + 1, 2) of the positions at steps 0..N [m]."""
    return Start(np.asarray(guess, dtype=float))


def warm_start(previous: Solution, problem: Problem) -> Start:
    """Start at an earlier solution, resampled at the new steps so that both end at the same time.

    Before the earlier solution begins, the hand is where it began; after it ends, the hand rests at its goal.
    """
    steps, dt = problem.horizon.steps, problem.horizon.dt
    elapsed_s = previous.dt * len(previous.control) - dt * steps
    path, control = resample(previous, elapsed_s, dt, steps)
    row = {identity: index for index, identity in enumerate(problem.obstacles.ids)}
    cost = max(previous.effort, np.finfo(float).tiny)
    kept = [
        (row[identity], shifted, multiplier / cost)
        for identity, time, multiplier in previous.multipliers
        if identity in row and 1 <= (shifted := (time * previous.dt - elapsed_s) / dt) <= steps
    ]
    table = np.array(kept, dtype=float).reshape(-1, 3)
    forces = Forces(table[:, 0].astype(np.intp), table[:, 1].copy(), table[:, 2].copy())
    return Start(path, control, forces, previous.safety_factor, previous.lam)


def resample(previous: Solution, elapsed_s: float, dt: float, steps: int) -> tuple[Array, Array]:
    """Return path (steps + 1, 2) and stacked control (2 steps,) of a solution at new steps of dt [s], from elapsed_s on."""
    count = len(previous.control)
    at = np.clip((elapsed_s + dt * np.arange(steps + 1)) / previous.dt, 0.0, count)
    step = np.minimum(at.astype(np.intp), count - 1)
    share = (at - step)[:, None]
    path: Array = (1.0 - share) * previous.path[step] + share * previous.path[step + 1]
    # the mean over each new step: the integral of the control, which is linear within the old steps
    total = np.concatenate((np.zeros((1, 2)), np.cumsum(previous.control, axis=0)))
    control = (1.0 - share) * total[step] + share * total[step + 1]
    return path, (np.diff(control, axis=0) * (previous.dt / dt)).T.ravel()


def follow(problem: Problem, path: Array, tightness: float = 1.0) -> Array:
    """Return the control (2N,), in units of `Horizon.gain`, that follows a path (N + 1, 2) smoothly and meets the goal.

    It minimises squared distances at the steps plus a weight of the effort: a path that is followed too tightly has an effort,
    and so a variance, that makes its margins meaningless. tightness: by how much the distances weigh more than usually.
    """
    response, gain = problem.horizon.position_response, problem.horizon.gain
    rows, targets, softness = problem.goal_rows
    rows, targets = rows[softness == 0.0] / gain, targets[softness == 0.0]
    length = np.sqrt((rows**2).sum(axis=1))
    rows, targets = rows / length[:, None], targets / length
    to_steps = response.at_steps.reshape(-1, rows.shape[1])
    square = to_steps.T @ to_steps + response.smoothing / tightness * np.eye(rows.shape[1])
    near = np.linalg.solve(square, np.column_stack((to_steps.T @ (path[1:] - problem.free[1:, :2]).ravel(), rows.T)))
    free, held = near[:, 0], near[:, 1:]
    control: Array = free + held @ np.linalg.lstsq(rows @ held, targets - rows @ free, rcond=None)[0]
    return control
