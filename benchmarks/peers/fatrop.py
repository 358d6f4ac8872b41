"""Fatrop, through CasADi, on the un-linearised problem: least effort subject to the chance constraint itself.

Fatrop is an interior-point method for optimal control whose linear algebra runs stage by stage. The problem is therefore given
in stages: the state of one holds the mean and, because the noise depends on the control, the covariance of each axis. Which
barrier parameter it should begin with depends on the scene; the fastest one is the peer.
"""

from __future__ import annotations

import time
from typing import Any

import casadi
import numpy as np

from foc_ros.core.ocp.problem import Problem

from .dense import Array, build_dense, compute_wanted_k

OPTIONS: dict[str, Any] = {'print_time': False, 'expand': True, 'structure_detection': 'auto', 'show_eval_warnings': False}
BARRIERS = (1e-1, 1e-2, 1e-3, 1e-4, 1e-6)
LENGTH = 0.1
"""Unit of positions [m]."""
ROWS, COLUMNS = np.triu_indices(3)
"""Entries of the covariance of one axis that are states."""


class Fatrop:
    """The program of one problem, built and differentiated beforehand for any initial mean. Only :meth:`solve` is to be timed."""

    def __init__(self, problem: Problem, barrier: float = BARRIERS[0]) -> None:
        self.problem, self.dense, self.steps = problem, build_dense(problem), problem.horizon.steps
        dt = problem.horizon.dt
        # in units of LENGTH and of a step, mean and noise propagate with the same matrices for every problem
        self.units = LENGTH / dt ** np.arange(3)
        self.jerk = LENGTH / dt**3
        self.A = np.array([[1.0, 1.0, 0.5], [0.0, 1.0, 1.0], [0.0, 0.0, 1.0]])
        self.b = np.array([1.0 / 6.0, 0.5, 1.0])
        # the largest effort and variance of the plan without obstacles scale control and covariance
        u = np.linalg.lstsq(self.dense.E, self.dense.b, rcond=None)[0]
        self.control_unit = float(np.abs(u).max()) / self.jerk
        self.covariance_unit = np.full(6, (problem.noise.max() * self.control_unit) ** 2)
        for entry, (i, j) in enumerate(zip(ROWS, COLUMNS, strict=True)):
            reach = self.steps ** (0.5 + 2.0 - i) * self.steps ** (0.5 + 2.0 - j)
            self.covariance_unit[entry] *= reach / 10.0
        self._build(barrier)

    def _build(self, barrier: float) -> None:
        size, initial = 18, casadi.SX.sym('initial', 6)
        variables, rows, lower, upper, equality = [], [], [], [], []
        states = [casadi.SX.sym(f'x{t}', size) for t in range(self.steps + 1)]
        controls = [casadi.SX.sym(f'u{t}', 2) for t in range(self.steps)]
        first = casadi.vertcat(initial, np.zeros(12))
        for t, state in enumerate(states):
            is_last = t == self.steps
            variables += [state] if is_last else [state, controls[t]]
            if not is_last:
                rows.append(states[t + 1] - self._advance(state, controls[t]))
                equality += [True] * size
                lower += [0.0] * size
                upper += [0.0] * size
            fixed = state - first if t == 0 else (state[:6] - self._scale(self.problem.goal) if is_last else None)
            if fixed is not None:
                rows.append(fixed)
                equality += [True] * fixed.numel()
                lower += [0.0] * fixed.numel()
                upper += [0.0] * fixed.numel()
            if t:
                kept = self._build_constraints(state)
                rows.append(kept)
                equality += [False] * kept.numel()
                lower += [0.0] * kept.numel()
                upper += [np.inf] * kept.numel()
        effort = sum(casadi.dot(u, u) for u in controls) / self.steps
        program = {'x': casadi.vertcat(*variables), 'f': effort, 'g': casadi.vertcat(*rows), 'p': initial}
        options = OPTIONS | {'equality': equality, 'fatrop': {'print_level': 0, 'max_iter': 200, 'mu_init': barrier}}
        self.lower, self.upper = np.array(lower), np.array(upper)
        self.solver = casadi.nlpsol('peer', 'fatrop', program, options)

    def _scale(self, mean: Array) -> Array:
        """Return a mean state x, y, vx, ... in the units of the program."""
        scaled: Array = mean / np.repeat(self.units, 2)
        return scaled

    def _advance(self, state: Any, control: Any) -> Any:
        """Return the state after a step: mean x, y, vx, ..., then the covariance of x and that of y."""
        u = control * self.control_unit
        mean = casadi.DM(np.kron(self.A, np.eye(2))) @ state[:6] + casadi.DM(np.kron(self.b[:, None], np.eye(2))) @ u
        found = [mean]
        for axis in range(2):
            entries = state[6 + 6 * axis : 12 + 6 * axis] * self.covariance_unit
            P = casadi.SX(3, 3)
            for entry, (i, j) in enumerate(zip(ROWS.tolist(), COLUMNS.tolist(), strict=True)):
                P[i, j] = P[j, i] = entries[entry]
            noise = (float(self.problem.noise[axis]) * u[axis]) ** 2
            moved = casadi.DM(self.A) @ P @ casadi.DM(self.A.T) + noise * casadi.DM(np.outer(self.b, self.b))
            flat = [moved[i, j] for i, j in zip(ROWS.tolist(), COLUMNS.tolist(), strict=True)]
            found.append(casadi.vertcat(*flat) / self.covariance_unit)
        return casadi.vertcat(*found)

    def _build_constraints(self, state: Any) -> Any:
        """Return -(E + k sqrt(Var)) / |p - o| of each obstacle, which has to be >= 0; it is nearly linear in the position."""
        k, rows, obstacles = compute_wanted_k(self.problem), [], self.problem.obstacles
        variance = [state[6 + 6 * axis] * self.covariance_unit[0] * LENGTH**2 for axis in range(2)]
        for centre, mean, stddev in zip(obstacles.centre, obstacles.radius, obstacles.radius_stddev, strict=True):
            x, y = state[0] * LENGTH - centre[0], state[1] * LENGTH - centre[1]
            size, var = mean**2 + stddev**2, 4 * mean**2 * stddev**2 + 2 * stddev**4
            total = var + 4 * (x**2 * variance[0] + y**2 * variance[1])
            rows.append((x**2 + y**2 - size - k * casadi.sqrt(total + 1e-16)) / casadi.sqrt(x**2 + y**2) / LENGTH)
        return casadi.vertcat(*rows)

    def build_start(self, guess: Array) -> Array:
        """Return the variables of a guess (N, 2): the least control through its middle, and the states that it leads to."""
        middle = self.steps // 2
        rows = np.concatenate((self.dense.E, self.dense.S[:, middle]))
        targets = np.concatenate((self.dense.b, guess[middle] - self.dense.free[middle]))
        u = np.linalg.lstsq(rows, targets, rcond=None)[0].reshape(2, -1).T / self.jerk / self.control_unit
        step = casadi.Function('step', [x := casadi.SX.sym('x', 18), c := casadi.SX.sym('c', 2)], [self._advance(x, c)])
        state, found = np.concatenate((self._scale(self.problem.initial_mean), np.zeros(12))), []
        for control in u:
            found += [state, control]
            state = np.asarray(step(state, control)).ravel()
        return np.concatenate((*found, state))

    def solve(self, start: Array, initial_mean: Array | None = None) -> tuple[bool, float, Array]:
        """Return whether Fatrop converged, the effort, and its variables, from which a next solve may start."""
        mean = self.problem.initial_mean if initial_mean is None else initial_mean
        answer = self.solver(x0=start, lbg=self.lower, ubg=self.upper, p=self._scale(mean))
        found = np.asarray(answer['x']).ravel()
        u = np.stack([found[20 * t + 18 : 20 * t + 20] for t in range(self.steps)]) * self.control_unit * self.jerk
        return bool(self.solver.stats()['success']), float((u**2).sum()), found

    @property
    def iterations(self) -> int:
        """Number of iterations of the last solve."""
        return int(self.solver.stats()['iter_count'])


def build_fastest_fatrop(problem: Problem, start: Array, initial_mean: Array) -> Fatrop:
    """Return the program with the first barrier parameter that is fastest from a start, of those that find the least effort."""
    solved = []
    for barrier in BARRIERS:
        peer = Fatrop(problem, barrier)
        began = time.perf_counter()
        converged, effort, _ = peer.solve(start, initial_mean)
        solved.append((effort if converged else np.inf, time.perf_counter() - began, peer))
    least = min(effort for effort, _, _ in solved)
    return min((each for each in solved if each[0] <= 1.02 * least), key=lambda each: each[1])[2]
