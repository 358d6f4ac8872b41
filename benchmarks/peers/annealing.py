"""Simulated annealing over two via points, as models of reaching were fitted in the past, without gradients or convexity.

The movement of least effort through given via points is the solution of a linear problem. The annealing searches for the points
that minimise the effort plus a penalty on the violation of the chance constraint.
"""

from __future__ import annotations

import numpy as np
from scipy.optimize import dual_annealing

from foc_ros.core.ocp.problem import Problem

from .dense import Array, build_dense, compute_k, compute_wanted_k

PENALTY = 30.0
"""Weight of the missing share of k, in units of the effort of the straight movement."""


class Annealing:
    """Via points at steps N/3 and 2N/3, each at most `span` [m] from the guess (N, 2) along each axis."""

    def __init__(self, problem: Problem, guess: Array, span: float = 0.06) -> None:
        self.problem, self.dense = problem, build_dense(problem)
        steps = problem.horizon.steps
        at = np.array([steps // 3, 2 * steps // 3])
        rows = np.concatenate((self.dense.E, self.dense.S[0, at], self.dense.S[1, at]))
        self.inverse = np.linalg.pinv(rows, rcond=1e-13)
        self.free = np.concatenate((self.dense.free[at, 0], self.dense.free[at, 1]))
        middle = np.concatenate((guess[at, 0], guess[at, 1]))
        self.bounds = np.stack((middle - span, middle + span), axis=1)
        straight = np.linalg.lstsq(self.dense.E, self.dense.b, rcond=None)[0]
        self.unit, self.wanted_k = float(straight @ straight), compute_wanted_k(problem)

    def compute_control(self, points: Array) -> Array:
        """Return the control of least effort through the points (4,): both x, then both y."""
        return np.asarray(self.inverse @ np.concatenate((self.dense.b, points - self.free)))

    def compute_cost(self, points: Array) -> float:
        """Return the effort with the penalty, relative to the effort of the straight movement."""
        u = self.compute_control(points)
        missing = max(0.0, 1.0 - compute_k(self.problem, self.dense, u) / self.wanted_k)
        return float(u @ u / self.unit + PENALTY * missing)

    def solve(self, iterations: int, seed: int) -> tuple[float, float, Array]:
        """Return the effort, the ratio of the achieved to the wanted k, and the positions (N, 2)."""
        found = dual_annealing(self.compute_cost, self.bounds, maxiter=iterations, rng=np.random.default_rng(seed))
        u = self.compute_control(found.x)
        return float(u @ u), compute_k(self.problem, self.dense, u) / self.wanted_k, self.dense.compute_positions(u)
