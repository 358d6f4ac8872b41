"""IPOPT, through CasADi, on the un-linearised problem: least effort subject to the chance constraint itself.

Positions and variances are variables of their own, tied to the control by equations. The derivatives are then sparse, which took
a third of the time of the program in the control alone. Which barrier strategy is faster depends on the scene; the faster one is
the peer.
"""

from __future__ import annotations

import time
from typing import Any

import casadi
import numpy as np

from foc_ros.core.ocp.problem import Problem

from .dense import Array, build_dense, compute_wanted_k

OPTIONS = {'print_time': False, 'ipopt.print_level': 0, 'ipopt.sb': 'yes'}
BARRIERS = ('adaptive', 'monotone')
LENGTH = 0.1
"""Unit of positions [m]."""


class Ipopt:
    """The program of one problem, built and differentiated beforehand. Only :meth:`solve` is to be timed."""

    def __init__(self, problem: Problem, barrier: str) -> None:
        self.dense, n = build_dense(problem), problem.horizon.steps
        self.unit = float(np.abs(self.dense.b[:2]).max()) * 60.0 / (problem.horizon.dt * n) ** 3
        variance = np.concatenate(tuple(self.dense.V)) * self.unit**2
        self.variance_unit = float(variance.sum(axis=1).max())
        self.variance = variance / self.variance_unit
        u, q, v = (casadi.SX.sym(name, 2 * n) for name in 'uqv')
        goal_units = np.abs(self.dense.E).max(axis=1)
        equations = casadi.vertcat(
            casadi.DM(self.dense.E / goal_units[:, None]) @ u,
            q - casadi.DM(np.concatenate(tuple(self.dense.S)) * self.unit / LENGTH) @ u,
            v - casadi.DM(self.variance) @ u**2,
        )
        equal = np.concatenate((self.dense.b / goal_units / self.unit, self.dense.free.T.ravel() / LENGTH, np.zeros(2 * n)))
        rows = self._build_constraints(problem, q, v)
        self.lower = np.concatenate((np.zeros(rows.numel()), equal))
        self.upper = np.concatenate((np.full(rows.numel(), np.inf), equal))
        self.lower_variables = np.concatenate((np.full(4 * n, -np.inf), np.zeros(2 * n)))
        program = {'x': casadi.vertcat(u, q, v), 'f': casadi.dot(u, u) / n, 'g': casadi.vertcat(rows, equations)}
        options: Any = OPTIONS | {'ipopt.mu_strategy': barrier}
        self.solver = casadi.nlpsol('peer', 'ipopt', program, options)

    def _build_constraints(self, problem: Problem, q: Any, v: Any) -> Any:
        """Return -(E + k sqrt(Var)) / E[R^2] for each obstacle and step, which has to be >= 0."""
        k, n, rows = compute_wanted_k(problem), problem.horizon.steps, []
        circles = zip(problem.obstacles.centre, problem.obstacles.radius, problem.obstacles.radius_stddev, strict=True)
        for centre, mean, stddev in circles:
            x, y = q[:n] * LENGTH - centre[0], q[n:] * LENGTH - centre[1]
            size, var = mean**2 + stddev**2, 4 * mean**2 * stddev**2 + 2 * stddev**4
            total = var + 4 * self.variance_unit * (x**2 * v[:n] + y**2 * v[n:])
            rows.append((x**2 + y**2 - size - k * casadi.sqrt(total + 1e-16)) / size)
        return casadi.vertcat(*rows)

    def build_start(self, guess: Array) -> Array:
        """Return the variables of a guess (N, 2): the control that follows it best, the guess and the variances."""
        u = self.dense.fit_control(guess) / self.unit
        return np.concatenate((u, guess.T.ravel() / LENGTH, self.variance @ u**2))

    def solve(self, start: Array) -> tuple[bool, float, Array]:
        """Return whether IPOPT converged, the effort and the positions (N, 2)."""
        answer = self.solver(x0=start, lbg=self.lower, ubg=self.upper, lbx=self.lower_variables)
        u = self.unit * np.asarray(answer['x']).ravel()[: len(self.variance)]
        return bool(self.solver.stats()['success']), float(u @ u), self.dense.compute_positions(u)

    @property
    def iterations(self) -> int:
        """Number of iterations of the last solve."""
        return int(self.solver.stats()['iter_count'])


def build_fastest_ipopt(problem: Problem, guess: Array) -> Ipopt:
    """Return the program with the barrier strategy that is fastest from a guess (N, 2), of those that find the least effort."""
    solved = []
    for barrier in BARRIERS:
        peer = Ipopt(problem, barrier)
        start, began = peer.build_start(guess), time.perf_counter()
        converged, effort, _ = peer.solve(start)
        solved.append((effort if converged else np.inf, time.perf_counter() - began, peer))
    least = min(effort for effort, _, _ in solved)
    return min((each for each in solved if each[0] <= 1.02 * least), key=lambda each: each[1])[2]
