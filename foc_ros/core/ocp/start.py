# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Where the search for a solution begins: at a guess of the path, or at an earlier solution, from where the hand is on it now."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from foc_ros.core.interpolation import interpolate_linear, interpolate_position
from foc_ros.core.solution import Solution
from foc_ros.core.types import Array

from .margin import Indices
from .problem import Problem

HELD = 3e-3
"""Distance from the places where an earlier solution touched obstacles, relative to the scene, that counts as much as a change of
the control by its own size."""
ERROR_EFFORT = np.array([[720.0, 360.0, 60.0], [360.0, 192.0, 36.0], [60.0, 36.0, 9.0]])
"""Least effort e'Me / T^5 that removes the errors of a triple integrator within a time T. In e, the error of the velocity is
multiplied by T, and that of the acceleration by T^2."""
TRIED, PARTS = 0.5, 4
"""The hand is looked for on this first part of an earlier movement, at so many points of each step."""
JITTER = 1e-13
"""Softness of the goal and of places, relative to the squares of their rows, which may depend on each other."""


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
    stacked control (2N,), its contacts, its safety factor and its lambda; control and lam are None for a guess. guess (N + 1, 2):
    where the search may begin instead of an earlier solution that was not settled.
    """

    path: Array
    control: Array | None = None
    forces: Forces = field(default=NO_FORCES)
    safety_factor: float = 0.0
    lam: float | None = None
    guess: Array | None = None


def cold_start(guess: Array) -> Start:
    """Start at a guess (N + 1, 2) of the positions at steps 0..N [m]."""
    return Start(np.asarray(guess, dtype=float))


def warm_start(previous: Solution, problem: Problem) -> Start:
    """Start at an earlier solution, from where the hand is on it now, at the pace with which it ends at the new time.

    A movement at r times its pace has the same path. Its velocity is r times as large, its jerk r^3 times, and a force about r^2
    times. The least change of this control leads the hand to the places where the earlier solution touched obstacles.
    """
    steps, dt, gain = problem.horizon.steps, problem.horizon.dt, problem.horizon.gain
    begin_s = _find_hand(previous, problem)
    pace = (previous.dt * len(previous.control) - begin_s) / (dt * steps)
    path, control = resample(previous, begin_s, pace * dt, steps)
    control *= pace ** (previous.mean.shape[1] // 2)
    row = {identity: index for index, identity in enumerate(problem.obstacles.ids)}
    cost = max(previous.effort, np.finfo(float).tiny)
    kept = [
        (row[identity], shifted, multiplier / cost)
        for identity, time, multiplier in previous.multipliers
        if identity in row and 1 <= (shifted := (time * previous.dt - begin_s) / (pace * dt)) <= steps
    ]
    table = np.array(kept, dtype=float).reshape(-1, 3)
    forces = Forces(table[:, 0].astype(np.intp), table[:, 1].copy(), table[:, 2].copy())
    if kept:
        places = interpolate_position(previous.mean, previous.dt, forces.time * pace * dt + begin_s)
        weight = (HELD * problem.extent) ** 2 / cost
        control = follow(problem, forces.time, places, weight / gain**2, control * gain) / gain
    return Start(path, control, forces, previous.safety_factor, previous.lam)


def _find_hand(previous: Solution, problem: Problem) -> float:
    """Return the time [s] of the state of an earlier movement to which the hand gets with the least effort.

    It is not the time that has passed: a hand at rest is at the beginning, for as long as it rests.
    """
    count, new_s = len(previous.control), problem.horizon.dt * problem.horizon.steps
    at = np.linspace(0.0, TRIED * count, int(TRIED * count) * PARTS + 1)
    states = interpolate_linear(previous.mean, at)
    orders = states.shape[1] // 2
    pace, order = (previous.dt * (count - at) / new_s)[:, None, None], np.arange(orders)[:, None]
    errors = states[:, : 2 * orders].reshape(-1, orders, 2) * pace**order - problem.initial_mean[: 2 * orders].reshape(orders, 2)
    errors *= new_s**order
    effort = (errors * (ERROR_EFFORT[:orders, :orders] @ errors)).sum(axis=(1, 2))
    return float(previous.dt * at[effort.argmin()])


def resample(previous: Solution, begin_s: float, dt: float, steps: int) -> tuple[Array, Array]:
    """Return path (steps + 1, 2) and stacked control (2 steps,) of a solution at new steps of dt [s], from a time of it on."""
    count = len(previous.control)
    at = np.minimum((begin_s + dt * np.arange(steps + 1)) / previous.dt, count)
    # the mean over each new step: the integral of the control, which is linear within the old steps
    total = np.concatenate((np.zeros((1, 2)), np.cumsum(previous.control, axis=0)))
    control = np.diff(interpolate_linear(total, at), axis=0) * (previous.dt / dt)
    return interpolate_linear(previous.path, at), control.T.ravel()


def follow(problem: Problem, times: Array, places: Array, weight: float, control: Array | None = None) -> Array:
    """Return the control nearest to a given one with which the mean meets the goal and is near some places at their times.

    It minimises the squared distances from the places plus a weight of the squared change of the control. Its dual has one
    unknown for each coordinate of a place and for each state that the goal fixes.

    Parameters
    ----------
    problem
        The problem, of N steps.
    times, places
        Times (q,) in steps, after 0, and positions (q, 2) [m].
    weight
        Of the squared change of the control in units of `Horizon.gain` [m^2].
    control
        The given control (2N,), in units of `Horizon.gain`; zero where there is none.

    Returns
    -------
    Array
        The control (2N,), in units of `Horizon.gain`.
    """
    horizon = problem.horizon
    control = np.zeros(2 * horizon.steps) if control is None else control
    goal, targets = problem.fixed_goal
    free = interpolate_position(problem.free, horizon.dt, times * horizon.dt)
    rows = np.concatenate((goal, horizon.position_response.at(times).reshape(-1, len(control))))
    missing = np.concatenate((targets, (places - free).ravel())) - rows @ control
    square = rows @ rows.T
    may_miss = JITTER * square.diagonal() + np.repeat((0.0, weight), (len(goal), 2 * len(times)))
    followed: Array = control + rows.T @ np.linalg.solve(square + np.diag(may_miss), missing)
    return followed
