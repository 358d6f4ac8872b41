# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Where the search for a solution begins: at a guess of the path, or at an earlier solution, from where the hand is on it now."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from foc_ros.core.interpolation import interpolate_linear, interpolate_position
from foc_ros.core.solution import Solution
from foc_ros.core.types import Array

from .margin import Indices
from .objective import pad_rows
from .problem import Problem
from .qp import number_rows

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


def warm_start(previous: Sequence[Solution], problems: Sequence[Problem]) -> list[Start]:
    """Start at earlier solutions, from where the hand is on each now, at the pace with which it ends at the new time.

    A movement at r times its pace has the same path. Its velocity is r times as large, its jerk r^3 times, and a force about r^2
    times. The least change of this control leads the hand to the places where the earlier solution touched obstacles. All
    solutions have the same number of steps and states, and all problems the same response to the control.
    """
    if not previous:
        return []
    steps = problems[0].horizon.steps
    dt, mean = np.array([each.dt for each in previous]), np.stack([each.mean for each in previous])
    gain, step_s = np.array([each.horizon.gain for each in problems]), np.array([each.horizon.dt for each in problems])
    extent = np.array([each.extent for each in problems])
    begin = _find_hand(mean, dt, problems)
    stride = (mean.shape[1] - 1 - begin) / steps
    path, control = resample(mean[..., :2], np.stack([each.control for each in previous]), begin, stride, steps)
    control *= ((stride * dt / step_s) ** (mean.shape[2] // 2))[:, None]
    cost = np.maximum([each.effort for each in previous], (JITTER * extent / gain) ** 2)
    tables = [{name: index for index, name in enumerate(each.obstacles.ids)} for each in problems]
    kept = [
        (row, table[identity], shifted, multiplier / cost[row])
        for row, (solution, table) in enumerate(zip(previous, tables, strict=True))
        for identity, time, multiplier in solution.multipliers
        if identity in table and (shifted := steps - (mean.shape[1] - 1 - time) / stride[row]) >= 1.0
    ]
    where, obstacle, time, multiplier = np.array(kept, dtype=float).reshape(-1, 4).T
    where, obstacle = where.astype(np.intp), obstacle.astype(np.intp)
    moments_s = (begin[where] + stride[where] * time) * dt[where]
    places = interpolate_position(mean[where], dt[where], moments_s[:, None])[:, 0]
    weight = (HELD * extent) ** 2 / cost
    control = follow(problems, where, time, places, weight / gain**2, control * gain[:, None]) / gain[:, None]
    forces = [Forces(*(each[where == row] for each in (obstacle, time, multiplier))) for row in range(len(problems))]
    begun = zip(path, control, forces, previous, strict=True)
    return [Start(each, moved, pushes, solution.safety_factor, solution.lam) for each, moved, pushes, solution in begun]


def _find_hand(mean: Array, dt: Array, problems: Sequence[Problem]) -> Array:
    """Return the times (b,) [steps] of states of earlier movements to which the hand gets with the least effort.

    It is not the time that has passed: a hand at rest is at the beginning, for as long as it rests.
    """
    count, orders = mean.shape[1] - 1, mean.shape[2] // 2
    new_s = np.array([each.horizon.dt * each.horizon.steps for each in problems])[:, None]
    at = np.linspace(0.0, TRIED * count, int(TRIED * count) * PARTS + 1)
    states = interpolate_linear(mean, np.broadcast_to(at, (len(mean), len(at)))).reshape(len(mean), len(at), orders, 2)
    pace, order = (dt[:, None] * (count - at) / new_s)[..., None, None], np.arange(orders)[:, None]
    hand = np.stack([each.initial_mean for each in problems]).reshape(-1, 1, orders, 2)
    errors = (states * pace**order - hand) * new_s[..., None, None] ** order
    effort = (errors * (ERROR_EFFORT[:orders, :orders] @ errors)).sum(axis=(2, 3))
    begin: Array = at[effort.argmin(axis=1)]
    return begin


def resample(path: Array, control: Array, begin: Array, stride: Array, steps: int) -> tuple[Array, Array]:
    """Return what is left of movements, at new steps: paths (b, steps + 1, 2) and stacked controls (b, 2 steps).

    Parameters
    ----------
    path, control
        Positions (b, N + 1, 2) [m] and controls (b, N, 2).
    begin, stride
        Where the rest begins, and the length of its steps, (b,) [steps].
    steps
        Number of the new steps.
    """
    at = np.minimum(begin[:, None] + stride[:, None] * np.arange(steps + 1), control.shape[1])
    # the mean over each new step: the integral of the control, which is linear within the old steps
    total = np.concatenate((np.zeros((len(control), 1, 2)), np.cumsum(control, axis=1)), axis=1)
    left = np.diff(interpolate_linear(total, at), axis=1) / stride[:, None, None]
    return interpolate_linear(path, at), left.swapaxes(1, 2).reshape(len(control), -1)


def follow(
    problems: Sequence[Problem], where: Indices, times: Array, places: Array, weight: Array, control: Array | None = None
) -> Array:
    """Return the controls nearest to given ones with which the means meet the goals and are near some places at their times.

    They minimise the squared distances from the places plus a weight of the squared change of the control. Their dual has one
    unknown for each coordinate of a place and for each state that the goal fixes.

    Parameters
    ----------
    problems
        b problems of N steps, with the same response to the control.
    where, times, places
        Rows of the problems (q,), times (q,) in steps, after 0, and positions (q, 2) [m].
    weight
        Of the squared change of each control in units of `Horizon.gain`, (b,) [m^2].
    control
        The given controls (b, 2N), in units of `Horizon.gain`; zero where there are none.

    Returns
    -------
    Array
        The controls (b, 2N), in units of `Horizon.gain`.
    """
    horizon, count = problems[0].horizon, len(problems)
    control = np.zeros((count, 2 * horizon.steps)) if control is None else control
    goal, targets = (pad_rows([each.fixed_goal[part] for each in problems]) for part in (0, 1))
    numbered = number_rows(where, count)
    dt, free = np.array([each.horizon.dt for each in problems]), np.stack([each.free for each in problems])
    missing = places - interpolate_position(free[where], dt[where], (times * dt[where])[:, None])[:, 0]
    response = numbered.spread(horizon.position_response.at(times))
    rows = np.concatenate((goal, response.reshape(count, -1, 2 * horizon.steps)), axis=1)
    wanted = np.concatenate((targets, numbered.spread(missing).reshape(count, -1)), axis=1)
    square = rows @ rows.swapaxes(1, 2)
    at, ends = np.arange(square.shape[1]), goal.shape[1]
    square[:, at, at] += JITTER * np.where(at < ends, 1.0, square[:, at, at])
    square[:, at[ends:], at[ends:]] += weight[:, None]
    pushes = np.linalg.solve(square, wanted[..., None] - rows @ control[..., None])
    followed: Array = control + (rows.swapaxes(1, 2) @ pushes)[..., 0]
    return followed
