"""IPOPT, through CasADi, on the un-linearised problem: least effort subject to the surrogate itself.

Positions and variances are variables of their own, tied to the control by equations: derivatives are then sparse, and it took a
third of the time of the program in the control alone. Which barrier strategy is the faster depends on the scene: the better one
is the peer.
"""

from __future__ import annotations

import time
from typing import Any

import casadi
import numpy as np

from foc_ros.core.ocp.problem import Problem

from .dense import Array, control_along, dense

OPTIONS = {'print_time': False, 'ipopt.print_level': 0, 'ipopt.sb': 'yes'}
BARRIERS = ('adaptive', 'monotone')
LENGTH = 0.1
"""Unit of positions [m]."""


class Ipopt:
    """The program of one problem, built and differentiated beforehand; only :meth:`solve` is to be timed."""

    def __init__(self, problem: Problem, barrier: str) -> None:
        self.made, n = dense(problem), problem.horizon.steps
        self.unit = float(np.abs(self.made.b[:2]).max()) * 60.0 / (problem.horizon.dt * n) ** 3
        spread = np.concatenate(tuple(self.made.V)) * self.unit**2
        self.spread_unit = float(spread.sum(axis=1).max())
        self.spread = spread / self.spread_unit
        u, q, v = (casadi.SX.sym(name, 2 * n) for name in 'uqv')
        ends = np.abs(self.made.E).max(axis=1)
        equations = casadi.vertcat(
            casadi.DM(self.made.E / ends[:, None]) @ u,
            q - casadi.DM(np.concatenate(tuple(self.made.S)) * self.unit / LENGTH) @ u,
            v - casadi.DM(self.spread) @ u**2,
        )
        equal = np.concatenate((self.made.b / ends / self.unit, self.made.free.T.ravel() / LENGTH, np.zeros(2 * n)))
        rows = self._clear(problem, q, v)
        self.low = np.concatenate((np.zeros(rows.numel()), equal))
        self.high = np.concatenate((np.full(rows.numel(), np.inf), equal))
        self.smallest = np.concatenate((np.full(4 * n, -np.inf), np.zeros(2 * n)))
        program = {'x': casadi.vertcat(u, q, v), 'f': casadi.dot(u, u) / n, 'g': casadi.vertcat(rows, equations)}
        options: Any = OPTIONS | {'ipopt.mu_strategy': barrier}
        self.solver = casadi.nlpsol('peer', 'ipopt', program, options)

    def _clear(self, problem: Problem, q: Any, v: Any) -> Any:
        """-(E + k sqrt(Var)), in units of the obstacle's E[R^2], for every obstacle and step: to be >= 0."""
        k, n, rows = np.sqrt(problem.eta / (1 - problem.eta)), problem.horizon.steps, []
        circles = zip(problem.obstacles.centre, problem.obstacles.radius, problem.obstacles.radius_stddev, strict=True)
        for centre, mean, stddev in circles:
            x, y = q[:n] * LENGTH - centre[0], q[n:] * LENGTH - centre[1]
            size, var = mean**2 + stddev**2, 4 * mean**2 * stddev**2 + 2 * stddev**4
            total = var + 4 * self.spread_unit * (x**2 * v[:n] + y**2 * v[n:])
            rows.append((x**2 + y**2 - size - k * casadi.sqrt(total + 1e-16)) / size)
        return casadi.vertcat(*rows)

    def start(self, guess: Array) -> Array:
        """Return the variables of a guess (N, 2): the control that follows it best, and what that leads to."""
        u = control_along(self.made, guess) / self.unit
        return np.concatenate((u, guess.T.ravel() / LENGTH, self.spread @ u**2))

    def solve(self, start: Array) -> tuple[bool, float, Array]:
        """Return whether it converged, the effort and the positions (N, 2)."""
        answer = self.solver(x0=start, lbg=self.low, ubg=self.high, lbx=self.smallest)
        u = self.unit * np.asarray(answer['x']).ravel()[: len(self.spread)]
        return bool(self.solver.stats()['success']), float(u @ u), self.made.positions(u)

    @property
    def iterations(self) -> int:
        """How many the last solve took."""
        return int(self.solver.stats()['iter_count'])


def best_ipopt(problem: Problem, guess: Array) -> Ipopt:
    """Return the program with the barrier strategy that is fastest from a guess (N, 2), of those that end at the least effort."""
    tried = []
    for barrier in BARRIERS:
        peer = Ipopt(problem, barrier)
        start, began = peer.start(guess), time.perf_counter()
        converged, effort, _ = peer.solve(start)
        tried.append((effort if converged else np.inf, time.perf_counter() - began, peer))
    least = min(effort for effort, _, _ in tried)
    return min((each for each in tried if each[0] <= 1.02 * least), key=lambda each: each[1])[2]
