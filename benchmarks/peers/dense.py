"""The problem as dense matrices over the stacked jerk, as a plain implementation has it: nothing exploited."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from foc_ros.core.ocp.problem import Problem

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Dense:
    """Positions at steps 1..N are free (N, 2) + S (2, N, 2N) u; their variances are V (2, N, 2N) u^2; at the end E u = b."""

    S: Array
    V: Array
    free: Array
    E: Array
    b: Array

    def positions(self, u: Array) -> Array:
        """Mean positions, (N, 2) [m]."""
        return self.free + (self.S @ u).T


def dense(problem: Problem) -> Dense:
    """Stack a rest-to-goal problem of the triple integrator from its horizon alone."""
    response, n = problem.horizon.response, problem.horizon.steps
    S = np.ascontiguousarray(response[:, :2].swapaxes(0, 1))
    V = S**2 * np.repeat(problem.noise, n) ** 2
    states = problem.horizon.powers @ problem.initial_mean
    return Dense(S, V, states[1:, :2], response[-1], problem.goal - states[-1])


def control_along(made: Dense, guess: Array) -> Array:
    """Return the control (2N,) that follows positions (N, 2) best, for solvers that start from a control."""
    rows = np.concatenate((*made.S, 1e3 * made.E))
    wanted = np.concatenate((*(guess - made.free).T, 1e3 * made.b))
    return np.asarray(np.linalg.lstsq(rows, wanted, rcond=1e-8)[0])
