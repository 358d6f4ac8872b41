# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""IPOPT and Fatrop, through CasADi, on the un-linearised problem: least effort subject to the chance constraint itself.

Time counts in steps and length in tenths of a metre. In these units the dynamics are the same for every duration, so that one
program, built and differentiated beforehand, solves all ticks of a movement. IPOPT gets positions and variances as variables,
tied to the control by equations; Fatrop, whose linear algebra runs stage by stage, gets stages that hold the mean and the
covariance of each axis. Which barrier parameter is fastest depends on the scene; the fastest one is the peer.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import casadi
import numpy as np
from numpy.typing import NDArray

from foc_ros.core.ocp.problem import Problem

Array = NDArray[np.float64]

LENGTH = 0.1
"""Unit of positions [m]."""
A = np.array([[1.0, 1.0, 0.5], [0.0, 1.0, 1.0], [0.0, 0.0, 1.0]])
B = np.array([1.0 / 6.0, 0.5, 1.0])
ROWS, COLUMNS = np.triu_indices(3)
"""Entries of the covariance of one axis that are states."""
TINY = 1e-16
"""Keeps square roots differentiable."""
OPTIONS: dict[str, Any] = {'print_time': False, 'show_eval_warnings': False}


def build_margins(problem: Problem, x: Any, y: Any, variance_x: Any, variance_y: Any) -> Any:
    """Return -(E + k sqrt(Var)) / |p - o| of each circle or box, which has to be >= 0; it is nearly linear in the position."""
    k, obstacles, rows = problem.wanted_k, problem.obstacles, []
    for row, centre in enumerate(obstacles.centre):
        px, py = x * LENGTH - centre[0], y * LENGTH - centre[1]
        from_centre = casadi.sqrt(px**2 + py**2)
        distance, dx, dy = from_centre, px, py
        if obstacles.corners[row] == 4:
            distance, dx, dy = _find_offset(obstacles.vertices[row], px, py)
        mean, stddev = obstacles.radius[row], obstacles.radius_stddev[row]
        size, size_variance = mean**2 + stddev**2, 4 * mean**2 * stddev**2 + 2 * stddev**4
        total = size_variance + 4 * (dx**2 * variance_x + dy**2 * variance_y) * LENGTH**2
        rows.append((distance * casadi.fabs(distance) - size - k * casadi.sqrt(total + TINY)) / from_centre / LENGTH)
    return casadi.vertcat(*rows)


def _find_offset(vertices: Array, x: Any, y: Any) -> tuple[Any, Any, Any]:
    """Return the signed distance from a box around the origin, and the offset from its nearest point [m]."""
    sides = (vertices[:2] - vertices[1:3]) / 2
    halves = [float(np.hypot(*side)) for side in sides]
    axes = [side / half for side, half in zip(sides, halves, strict=True)]
    along = [x * axis[0] + y * axis[1] for axis in axes]
    beyond = [value - casadi.fmax(-half, casadi.fmin(half, value)) for value, half in zip(along, halves, strict=True)]
    inside = casadi.fmin(casadi.fmax(*(casadi.fabs(value) - half for value, half in zip(along, halves, strict=True))), 0)
    distance = casadi.sqrt(beyond[0] ** 2 + beyond[1] ** 2 + TINY) + inside
    return distance, *(beyond[0] * axes[0][i] + beyond[1] * axes[1][i] for i in (0, 1))


def fit_guess(problem: Problem, guess: Array) -> Array:
    """Return the least control (N, 2) [m/s^3] through the middle of a path (N + 1, 2) to the goal."""
    middle = problem.horizon.steps // 2
    goal_rows, goal_targets, _ = problem.goal_rows
    rows = np.concatenate((goal_rows, problem.horizon.response[middle - 1, :2]))
    targets = np.concatenate((goal_targets, guess[middle] - problem.free[middle, :2]))
    control: Array = np.linalg.lstsq(rows, targets, rcond=None)[0].reshape(2, -1).T
    return control


class Peer:
    """A program for one scene, for any hand state and time to go. Only :meth:`solve` is to be timed."""

    def __init__(self, problem: Problem) -> None:
        self.steps = problem.horizon.steps
        rows, targets, _ = problem.goal_rows
        least = np.linalg.lstsq(rows, targets, rcond=None)[0]
        self.control_unit = float(np.abs(least).max()) * problem.horizon.dt**3 / LENGTH
        """Largest control of the plan without obstacles."""
        self.lower, self.upper = np.zeros(0), np.zeros(0)
        self.lower_variables = np.zeros(0)
        self.solver: Any = None

    def scale_control(self, problem: Problem, control: Array) -> Array:
        """Return a control (N, 2) [m/s^3] in LENGTH and steps."""
        return control * (problem.horizon.dt**3 / LENGTH)

    def scale_state(self, problem: Problem, state: Array) -> Array:
        """Return a mean state x, y, vx, ... in LENGTH and steps."""
        scaled: Array = state * np.repeat(problem.horizon.dt ** np.arange(3), 2) / LENGTH
        return scaled

    def prepare(self, problem: Problem, control: Array) -> dict[str, Array]:
        """Return the arguments of a solve that starts from a control (N, 2) [m/s^3]."""
        parameters = (self.scale_state(problem, problem.initial_mean), self.scale_state(problem, problem.goal), problem.noise)
        bounds = {'lbg': self.lower, 'ubg': self.upper, 'lbx': self.lower_variables}
        start = self._build_start(problem, self.scale_control(problem, control) / self.control_unit)
        return bounds | {'x0': start, 'p': np.concatenate(parameters)}

    def solve(self, arguments: dict[str, Array]) -> Array:
        """Return the variables."""
        return np.asarray(self.solver(**arguments)['x']).ravel()

    def read_control(self, problem: Problem, variables: Array) -> Array:
        """Return the control (N, 2) [m/s^3] of a solution."""
        return self._find_control(variables) * (self.control_unit * LENGTH / problem.horizon.dt**3)

    @property
    def converged(self) -> bool:
        """Whether the last solve converged."""
        return bool(self.solver.stats()['success'])

    @property
    def iterations(self) -> int:
        """Number of iterations of the last solve."""
        return int(self.solver.stats()['iter_count'])

    def _build_start(self, problem: Problem, u: Array) -> Array:
        raise NotImplementedError

    def _find_control(self, variables: Array) -> Array:
        raise NotImplementedError


class Ipopt(Peer):
    """Variables: control, positions and variances of all steps, axis by axis."""

    barriers = ('adaptive', 'monotone')

    def __init__(self, problem: Problem, barrier: Any) -> None:
        super().__init__(problem)
        n = self.steps
        lag = np.arange(n)[:, None] - np.arange(n)
        self.position = np.where(lag >= 0, ((lag + 1.0) ** 3 - lag**3.0) / 6.0, 0.0) * self.control_unit
        self.square = self.position**2
        self.variance_unit = float(self.square.sum(axis=1).max()) * float(problem.noise.max()) ** 2
        response = np.stack([np.linalg.matrix_power(A, n - 1 - k) @ B for k in range(n)], axis=1) * self.control_unit
        u, q, v, p = casadi.SX.sym('u', 2 * n), casadi.SX.sym('q', 2 * n), casadi.SX.sym('v', 2 * n), casadi.SX.sym('p', 14)
        equations, units = [], np.abs(response).max(axis=1)
        powers = np.stack([np.linalg.matrix_power(A, t + 1) for t in range(n)])
        for axis in range(2):
            mine, initial, goal = slice(axis * n, axis * n + n), p[axis:6:2], p[6 + axis : 12 : 2]
            equations += [
                (casadi.DM(response) @ u[mine] + casadi.DM(powers[-1]) @ initial - goal) / units,
                q[mine] - casadi.DM(self.position) @ u[mine] - casadi.DM(powers[:, 0]) @ initial,
                v[mine] - p[12 + axis] ** 2 / self.variance_unit * (casadi.DM(self.square) @ u[mine] ** 2),
            ]
        equal = casadi.vertcat(*equations)
        steps = [build_margins(problem, q[t], q[n + t], *(self.variance_unit * v[i] for i in (t, n + t))) for t in range(n)]
        margins = casadi.vertcat(*steps)
        self.lower = np.zeros(margins.numel() + equal.numel())
        self.upper = np.concatenate((np.full(margins.numel(), np.inf), np.zeros(equal.numel())))
        self.lower_variables = np.concatenate((np.full(4 * n, -np.inf), np.zeros(2 * n)))
        program = {'x': casadi.vertcat(u, q, v), 'f': casadi.dot(u, u) / n, 'g': casadi.vertcat(margins, equal), 'p': p}
        options = OPTIONS | {'ipopt.print_level': 0, 'ipopt.sb': 'yes', 'ipopt.mu_strategy': barrier, 'ipopt.max_iter': 500}
        self.solver = casadi.nlpsol('peer', 'ipopt', program, options)

    def _build_start(self, problem: Problem, u: Array) -> Array:
        initial = self.scale_state(problem, problem.initial_mean).reshape(3, 2)
        free = np.stack([np.linalg.matrix_power(A, t + 1)[0] @ initial for t in range(self.steps)])
        variance = self.square @ u**2 * problem.noise**2 / self.variance_unit
        return np.concatenate([each.T.ravel() for each in (u, free + self.position @ u, variance)])

    def _find_control(self, variables: Array) -> Array:
        return variables[: 2 * self.steps].reshape(2, -1).T


class Fatrop(Peer):
    """Variables: 18 states and 2 controls of each stage."""

    barriers = (1.0, 1e-1)
    """With smaller ones it is faster among circles by up to a quarter, and may not end among boxes."""

    def __init__(self, problem: Problem, barrier: Any) -> None:
        super().__init__(problem)
        n, p = self.steps, casadi.SX.sym('p', 14)
        self.covariance_unit = np.full(6, (problem.noise.max() * self.control_unit) ** 2)
        for entry, (i, j) in enumerate(zip(ROWS, COLUMNS, strict=True)):
            self.covariance_unit[entry] *= n ** (5.0 - i - j) / 10.0
        states, controls = [casadi.SX.sym(f'x{t}', 18) for t in range(n + 1)], [casadi.SX.sym(f'u{t}', 2) for t in range(n)]
        first, rows, equality = casadi.vertcat(p[:6], np.zeros(12)), [], []
        for t, state in enumerate(states):
            if t < n:
                rows.append((states[t + 1] - self._advance(state, controls[t], p[12:]), True))
            if t == 0 or t == n:
                rows.append((state - first if t == 0 else state[:6] - p[6:12], True))
            if t:
                variances = (state[6 + 6 * axis] * self.covariance_unit[0] for axis in range(2))
                rows.append((build_margins(problem, state[0], state[1], *variances), False))
        equality = [is_equal for each, is_equal in rows for _ in range(each.numel())]
        self.lower = np.zeros(len(equality))
        self.upper = np.where(equality, 0.0, np.inf)
        stages = [each for pair in zip(states[:-1], controls, strict=True) for each in pair]
        variables = casadi.vertcat(*stages, states[-1])
        self.lower_variables = np.full(variables.numel(), -np.inf)
        effort = sum(casadi.dot(u, u) for u in controls) / n
        program = {'x': variables, 'f': effort, 'g': casadi.vertcat(*(each for each, _ in rows)), 'p': p}
        fatrop = {'print_level': 0, 'max_iter': 200, 'mu_init': barrier}
        options = OPTIONS | {'expand': True, 'structure_detection': 'auto', 'equality': equality, 'fatrop': fatrop}
        self.solver = casadi.nlpsol('peer', 'fatrop', program, options)
        x, u, c = casadi.SX.sym('x', 18), casadi.SX.sym('u', 2), casadi.SX.sym('c', 2)
        self.step = casadi.Function('step', [x, u, c], [self._advance(x, u, c)])

    def _advance(self, state: Any, control: Any, noise: Any) -> Any:
        """Return the state after a step: mean x, y, vx, ..., then the covariance of x and that of y."""
        u = control * self.control_unit
        found = [casadi.DM(np.kron(A, np.eye(2))) @ state[:6] + casadi.DM(np.kron(B[:, None], np.eye(2))) @ u]
        for axis in range(2):
            entries = state[6 + 6 * axis : 12 + 6 * axis] * self.covariance_unit
            P = casadi.SX(3, 3)
            for entry, (i, j) in enumerate(zip(ROWS.tolist(), COLUMNS.tolist(), strict=True)):
                P[i, j] = P[j, i] = entries[entry]
            moved = casadi.DM(A) @ P @ casadi.DM(A.T) + (noise[axis] * u[axis]) ** 2 * casadi.DM(np.outer(B, B))
            flat = [moved[i, j] for i, j in zip(ROWS.tolist(), COLUMNS.tolist(), strict=True)]
            found.append(casadi.vertcat(*flat) / self.covariance_unit)
        return casadi.vertcat(*found)

    def _build_start(self, problem: Problem, u: Array) -> Array:
        state, found = np.concatenate((self.scale_state(problem, problem.initial_mean), np.zeros(12))), []
        for control in u:
            found += [state, control]
            state = np.asarray(self.step(state, control, problem.noise)).ravel()
        return np.concatenate((*found, state))

    def _find_control(self, variables: Array) -> Array:
        return variables[:-18].reshape(self.steps, 20)[:, 18:]


PEERS: dict[str, Callable[..., Peer]] = {'IPOPT': Ipopt, 'Fatrop': Fatrop}


def build_fastest(name: str, problem: Problem, control: Array) -> Peer:
    """Return a program with the barrier that is fastest from a control (N, 2), of those that find the least effort."""
    kind: Any = PEERS[name]
    solved: list[tuple[float, float, Peer]] = []
    for barrier in kind.barriers:
        peer = kind(problem, barrier)
        arguments = peer.prepare(problem, control)
        began = time.perf_counter()
        found = peer.solve(arguments)
        seconds = time.perf_counter() - began
        effort = float((peer.read_control(problem, found) ** 2).sum()) if peer.converged else np.inf
        solved.append((effort, seconds, peer))
    least = min(effort for effort, _, _ in solved)
    return min((each for each in solved if each[0] <= 1.02 * least), key=lambda each: each[1])[2]
