"""The problem as dense matrices over the stacked jerk, as a plain implementation has it, and the chance constraint on them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from foc_ros.core.ocp.problem import Problem

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class DenseProblem:
    """Matrices of a problem over the control u (2N,), the jerk of x and then of y.

    The positions at steps 1..N are `free` (N, 2) + S (2, N, 2N) u, their variances are V (2, N, 2N) u^2, and the goal state is
    reached where E (6, 2N) u = b (6,).
    """

    S: Array
    V: Array
    free: Array
    E: Array
    b: Array

    def compute_positions(self, u: Array) -> Array:
        """Return the mean positions of a control, (N, 2) [m]."""
        return self.free + (self.S @ u).T

    def fit_control(self, path: Array) -> Array:
        """Return the control (2N,) that follows positions (N, 2) best and ends at the goal."""
        rows = np.concatenate((*self.S, 1e3 * self.E))
        targets = np.concatenate((*(path - self.free).T, 1e3 * self.b))
        return np.asarray(np.linalg.lstsq(rows, targets, rcond=1e-8)[0])


def build_dense(problem: Problem) -> DenseProblem:
    """Stack a rest-to-goal problem of the triple integrator. Only its horizon is used."""
    response, n = problem.horizon.response, problem.horizon.steps
    S = np.ascontiguousarray(response[:, :2].swapaxes(0, 1))
    V = S**2 * np.repeat(problem.noise, n) ** 2
    states = problem.horizon.powers @ problem.initial_mean
    return DenseProblem(S, V, states[1:, :2], response[-1], problem.goal - states[-1])


def compute_wanted_k(problem: Problem) -> float:
    """Return the safety factor k that eta requires by Cantelli's inequality."""
    return float(np.sqrt(problem.eta / (1 - problem.eta)))


def compute_k(problem: Problem, dense: DenseProblem, u: Array) -> float:
    """Return the smallest k = -E[C] / sqrt(Var[C]) over obstacles and steps, at the mean that the control leads to."""
    obstacles = problem.obstacles
    offset = dense.compute_positions(u) - obstacles.centre[:, None]
    variance = dense.V @ u**2
    mean, var = obstacles.radius[:, None] ** 2, obstacles.radius_stddev[:, None] ** 2
    surplus = (offset**2).sum(axis=2) - mean - var
    total = 4 * mean * var + 2 * var**2 + 4 * (offset[..., 0] ** 2 * variance[0] + offset[..., 1] ** 2 * variance[1])
    return float((surplus / np.sqrt(total)).min())
