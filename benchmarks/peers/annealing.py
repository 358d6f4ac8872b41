"""Simulated annealing over a few via points, as models of reaching were fitted before: no gradient, no convexity.

The movement through given via points at given times is the one of least effort, a linear problem; the annealing looks for the
points, by the effort plus a penalty on the surrogate's violation.
"""

from __future__ import annotations

import numpy as np
from scipy.optimize import dual_annealing

from foc_ros.core.ocp.problem import Problem

from .dense import Array, dense
from .naive import achieved

PENALTY = 30.0
"""Weight of the missing share of k, in efforts of the straight movement."""


class Annealing:
    """Via points at steps N/3 and 2N/3, each anywhere within `span` [m] of the guess there."""

    def __init__(self, problem: Problem, guess: Array, span: float = 0.06) -> None:
        self.problem, self.made = problem, dense(problem)
        steps = problem.horizon.steps
        at = np.array([steps // 3, 2 * steps // 3])
        rows = np.concatenate((self.made.E, self.made.S[0, at], self.made.S[1, at]))
        self.through = np.linalg.pinv(rows, rcond=1e-13)
        self.free = np.concatenate((self.made.free[at, 0], self.made.free[at, 1]))
        middle = np.concatenate((guess[at, 0], guess[at, 1]))
        self.bounds = np.stack((middle - span, middle + span), axis=1)
        straight = np.linalg.lstsq(self.made.E, self.made.b, rcond=None)[0]
        self.scale, self.wanted = float(straight @ straight), np.sqrt(problem.eta / (1 - problem.eta))

    def control(self, points: Array) -> Array:
        """Return the least effort through the points (4,): x of both, y of both."""
        return np.asarray(self.through @ np.concatenate((self.made.b, points - self.free)))

    def cost(self, points: Array) -> float:
        """Effort with the penalty, relative to the straight movement's."""
        u = self.control(points)
        missing = max(0.0, 1.0 - achieved(self.problem, self.made, u) / self.wanted)
        return float(u @ u / self.scale + PENALTY * missing)

    def solve(self, iterations: int, seed: int) -> tuple[float, float, Array]:
        """Return the effort, the k achieved relative to the one wanted, and the positions (N, 2)."""
        found = dual_annealing(self.cost, self.bounds, maxiter=iterations, rng=np.random.default_rng(seed))
        u = self.control(found.x)
        return float(u @ u), achieved(self.problem, self.made, u) / self.wanted, self.made.positions(u)
