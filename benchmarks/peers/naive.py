"""The paper's algorithm 1 as printed: each QP has all its rows, dense, and is solved by a general solver of qpsolvers."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from qpsolvers import solve_qp

from foc_ros.core.ocp.problem import Problem

from .dense import Array, DenseProblem, build_dense, compute_k, compute_wanted_k

MAX_QPS = 500
SETTINGS = {'piqp': {'eps_primal_inf': 1e-10, 'eps_dual_inf': 1e-10}}
"""With the default 1e-4, PIQP from 0.7 on reports the later QPs of the loop as infeasible."""


@dataclass(frozen=True, eq=False)
class NaiveSolution:
    """Positions (N, 2), effort, tau and lambda of the last QP, its linearisation path (N, 2), number of QPs."""

    positions: Array
    effort: float
    tau: float
    lam: float
    guess: Array
    qps: int


def run_algorithm1(problem: Problem, guess: Array, solver: str, settings: tuple[float, float, float]) -> NaiveSolution | None:
    """Increase tau and lambda until the chance constraint holds and the effort converges.

    `settings` are delta [m^2], Delta and xi: the step of tau, the factor of lambda, and the change of effort that counts as none.
    The result is None if a QP is infeasible or `MAX_QPS` do not suffice.
    """
    delta, growth, xi = settings
    dense, tau, lam, effort = build_dense(problem), 0.0, 1.0, np.inf
    wanted_k = compute_wanted_k(problem)
    for count in range(1, MAX_QPS + 1):
        u = solve_linearised(problem, dense, guess, (tau, lam), solver)
        if u is None:
            return None
        positions, previous = dense.compute_positions(u), effort
        effort = float(u @ u)
        holds = compute_k(problem, dense, u) >= wanted_k
        if holds and abs(effort - previous) < xi:
            return NaiveSolution(positions, effort, tau, lam, guess, count)
        guess = positions
        if not holds:
            tau, lam = tau + delta, lam * growth
    return None


def solve_linearised(
    problem: Problem, dense: DenseProblem, guess: Array, weights: tuple[float, float], solver: str
) -> Array | None:
    """Solve one QP at `weights` (tau, lambda): E[C] + tau <= 0 for each obstacle and step, linearised at a guess (N, 2)."""
    (tau, lam), obstacles = weights, problem.obstacles
    P = np.diag(2 * (1 + lam * dense.V.sum(axis=(0, 1))))
    offset = guess - obstacles.centre[:, None]
    size = obstacles.radius**2 + obstacles.radius_stddev**2
    G = np.concatenate([-2 * (d[:, 0, None] * dense.S[0] + d[:, 1, None] * dense.S[1]) for d in offset])
    squared_distance = (offset**2).sum(axis=2) + 2 * (offset * (dense.free - guess)).sum(axis=2)
    h = (squared_distance - size[:, None] - tau).ravel()
    unit = 1 / np.sqrt(P.diagonal())  # without this scaling the interior-point solvers fail for large lambda
    scaled = solve_qp(
        np.eye(len(unit)), np.zeros(len(unit)), G * unit, h, dense.E * unit, dense.b, solver=solver, **SETTINGS.get(solver, {})
    )
    return None if scaled is None else unit * np.asarray(scaled)
