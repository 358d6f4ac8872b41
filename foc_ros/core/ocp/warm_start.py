"""Where the search for a solution begins: at a guess, or at the solution of the last tick, shifted in time."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from foc_ros.core.kernels import Matrix, Tensor, Vector, compiled, freeze
from foc_ros.core.kernels.linear_algebra import (
    factorise_cholesky,
    multiply_transposed,
    multiply_vector,
    solve_lower,
    solve_lower_transposed,
)
from foc_ros.core.types import Array, Solution, Status

from .contacts.contacts import NO_CONTACTS, Contacts
from .contacts.hermite import interpolation_rows
from .problem import Problem
from .terms import Motion

REGULARISATION = 1e-9
"""Added to the diagonal of R R', which is singular where two contacts are at the same time."""


@dataclass(frozen=True, eq=False)
class Start:
    """Where a strategy begins.

    positions (N, 2): at steps 1..N, to linearise at [m]. A start from an earlier solution also has its stacked control (2N,), its
    contacts, safety factor, lambda, and slope dk/ds (0 where not known). lam is None for a cold start, which has none of these.
    is_unfinished: whether the deadline stopped the earlier solution. raises: how often the safety factor may be raised; finite
    where another search goes on from the result, in this prediction or the next one.
    """

    positions: Array
    control: Array | None = None
    contacts: Contacts = NO_CONTACTS
    safety_factor: float = 0.0
    lam: float | None = None
    safety_factor_slope: float = 0.0
    is_unfinished: bool = False
    raises: float = math.inf


def cold_start(guess: Array) -> Start:
    """Start at a guess (N + 1, 2) of the positions at steps 0..N [m]."""
    return Start(np.asarray(guess, dtype=float)[1:])


def warm_start(previous: Solution, problem: Problem) -> Start:
    """Start at an earlier solution, resampled at the new steps so that both end at the same time.

    Before the earlier solution begins, the hand is where it began; after it ends, the hand rests at its goal.
    """
    steps, dt = problem.horizon.steps, problem.horizon.dt
    elapsed_s = previous.dt * len(previous.control) - dt * steps
    positions, control = resample_solution(previous.mean, previous.control, previous.dt, elapsed_s, dt, steps)
    row = {identity: index for index, identity in enumerate(problem.obstacles.ids)}
    kept = [
        (row[identity], shifted, multiplier)
        for identity, time, multiplier in previous.multipliers
        if identity in row and 1 <= (shifted := (time * previous.dt - elapsed_s) / dt) <= steps
    ]
    table = np.array(kept, dtype=float).reshape(-1, 3)
    contacts = freeze(Contacts(table[:, 0].astype(np.intp), table[:, 1].copy(), table[:, 2].copy()))
    is_unfinished, slope = previous.status is Status.DEADLINE, previous.safety_factor_slope
    return Start(positions, control, contacts, previous.safety_factor, previous.lam, slope, is_unfinished)


@compiled
def resample_solution(
    mean: Matrix, control: Matrix, before: float, elapsed_s: float, dt: float, steps: int
) -> tuple[Matrix, Vector]:
    """Return positions (steps, 2) and the stacked control (2 steps,) at new steps of dt [s], the first elapsed_s later.

    mean (n + 1, states), its position first, and control (n, 2) at steps of `before` [s]; the control is zero before they begin
    and after they end.
    """
    n = len(control)
    positions, stacked = np.empty((steps, 2)), np.zeros(2 * steps)
    for t in range(steps):
        time = (elapsed_s + dt * (t + 1)) / before
        step = min(max(int(np.floor(time)), 0), n - 1)
        share = min(max(time - step, 0.0), 1.0)
        during = int(np.floor(time - 0.5 * dt / before))
        for axis in range(2):
            positions[t, axis] = (1.0 - share) * mean[step, axis] + share * mean[step + 1, axis]
            if 0 <= during < n:
                stacked[axis * steps + t] = control[during, axis]
    return positions, stacked


@compiled
def resample_rest(mean: Matrix, covariance: Tensor, control: Matrix, begin: float) -> tuple[Matrix, Tensor, Matrix]:
    """Return mean (N + 1, n), covariance (N + 1, n, n) and control (N, 2) from the step `begin` on, at N steps.

    Mean and covariance are interpolated; the control is constant within a step. A kernel: NumPy takes 60 us.
    """
    steps = len(control)
    means, covariances, controls = np.empty(mean.shape), np.empty(covariance.shape), np.empty(control.shape)
    for t in range(steps + 1):
        at = begin + (steps - begin) * t / steps
        row = min(int(at), steps - 1)
        share = at - row
        means[t] = (1.0 - share) * mean[row] + share * mean[row + 1]
        covariances[t] = (1.0 - share) * covariance[row] + share * covariance[row + 1]
        if t < steps:
            controls[t] = control[min(int(begin + (steps - begin) * (t + 0.5) / steps), steps - 1)]
    return means, covariances, controls


def interpolate_rest(mean: Array, begin: float) -> Array:
    """Return the mean (N + 1, n) from the step `begin` on, at N steps."""
    steps = len(mean) - 1
    at = np.linspace(begin, steps, steps + 1)
    row = np.minimum(at.astype(np.intp), steps - 1)
    share = (at - row)[:, None]
    rest: Array = (1.0 - share) * mean[row] + share * mean[row + 1]
    return rest


def correct_to_goal(problem: Problem, control: Array, path: Array, times: Array) -> Array:
    """Change a control (2N,) so that the mean meets a path (N, 2) at some times (c,) and the goal, from where the hand now is.

    times: of the contacts, in steps. Of all controls that do so the nearest is returned, u + R'(R R')^-1 e, with the rows R of
    what is to be met and the errors e of u, each divided by the length of its row.
    """
    whole, goal = np.concatenate((problem.initial_mean[None, :2], path)), problem.at_goal
    rows, targets = problem.horizon.last[goal], (problem.goal - problem.free[-1])[goal]
    return _correct_to_goal(problem.terms.motion, rows, targets, control, whole, times)


@compiled
def _correct_to_goal(motion: Motion, goal_rows: Matrix, targets: Vector, control: Vector, path: Matrix, times: Vector) -> Vector:
    """Return the corrected control; goal_rows (r, 2N) and targets (r,) of the states at the goal, path (N + 1, 2)."""
    count, steps = len(times), len(path) - 1
    rows, wanted = np.empty((2 * count + len(targets), len(control))), np.empty((2 * count + len(targets), 1))
    at_contacts, free = interpolation_rows(motion, times)
    for i in range(count):
        t = min(int(times[i]), steps - 1)
        share = times[i] - t
        for axis in range(2):
            rows[2 * i + axis] = at_contacts[axis, i]
            wanted[2 * i + axis, 0] = (1.0 - share) * path[t, axis] + share * path[t + 1, axis] - free[i, axis]
    rows[2 * count :], wanted[2 * count :, 0] = goal_rows, targets
    for i in range(len(rows)):
        length = np.sqrt((rows[i] ** 2).sum())
        rows[i], wanted[i] = rows[i] / length, wanted[i] / length
    square, missing = multiply_transposed(rows, rows), wanted - multiply_vector(rows, control)[:, None]
    for i in range(len(rows)):
        square[i, i] += REGULARISATION
    factor = factorise_cholesky(square, 0.0)
    weights = solve_lower_transposed(factor, solve_lower(factor, missing)[:, 0].copy())
    return control + weights @ rows
