"""The paper's algorithm 1 word by word: each QP in full, dense, by a general solver of qpsolvers."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from qpsolvers import solve_qp

from foc_ros.core.ocp.problem import Problem

from .dense import Array, Dense, dense

LIMIT = 500
SETTINGS = {'piqp': {'eps_primal_inf': 1e-10, 'eps_dual_inf': 1e-10}}
"""With its default, 1e-4, PIQP from 0.7 on calls the later QPs of the loop infeasible."""


@dataclass(frozen=True, eq=False)
class Stepped:
    """Positions (N, 2), effort, the (tau, lambda) of the last QP, whose linearisation was taken at `guess`; QPs solved."""

    positions: Array
    effort: float
    tau: float
    lam: float
    guess: Array
    qps: int


def stepping(problem: Problem, guess: Array, solver: str, delta: float, growth: float, xi: float) -> Stepped | None:
    """Step tau and lambda until the surrogate holds and the effort changes by less than xi; None where a QP has no answer."""
    made, tau, lam, effort = dense(problem), 0.0, 1.0, np.inf
    wanted = np.sqrt(problem.eta / (1 - problem.eta))
    for count in range(1, LIMIT + 1):
        u = solve_step(problem, made, guess, tau, lam, solver)
        if u is None:
            return None
        positions, before = made.positions(u), effort
        effort = float(u @ u)
        holds = achieved(problem, made, u) >= wanted
        if holds and abs(effort - before) < xi:
            return Stepped(positions, effort, tau, lam, guess, count)
        guess = positions
        if not holds:
            tau, lam = tau + delta, lam * growth
    return None


def solve_step(problem: Problem, made: Dense, guess: Array, tau: float, lam: float, solver: str) -> Array | None:
    """Solve one QP: E[C] + tau <= 0 for each obstacle and step, linearised at a guess (N, 2)."""
    obstacles = problem.obstacles
    P = np.diag(2 * (1 + lam * made.V.sum(axis=(0, 1))))
    offset = guess - obstacles.centre[:, None]
    size = obstacles.radius**2 + obstacles.radius_stddev**2
    G = np.concatenate([-2 * (d[:, 0, None] * made.S[0] + d[:, 1, None] * made.S[1]) for d in offset])
    apart = (offset**2).sum(axis=2) + 2 * (offset * (made.free - guess)).sum(axis=2)
    h = (apart - size[:, None] - tau).ravel()
    unit = 1 / np.sqrt(P.diagonal())  # without this scaling the interior-point solvers fail for large lambda
    scaled = solve_qp(
        np.eye(len(unit)), np.zeros(len(unit)), G * unit, h, made.E * unit, made.b, solver=solver, **SETTINGS.get(solver, {})
    )
    return None if scaled is None else unit * np.asarray(scaled)


def achieved(problem: Problem, made: Dense, u: Array) -> float:
    """Return the smallest k = -E[C] / sqrt(Var[C]) over obstacles and steps, at the control's own mean."""
    obstacles = problem.obstacles
    offset = made.positions(u) - obstacles.centre[:, None]
    spread = made.V @ u**2
    mean, var = obstacles.radius[:, None] ** 2, obstacles.radius_stddev[:, None] ** 2
    surplus = (offset**2).sum(axis=2) - mean - var
    total = 4 * mean * var + 2 * var**2 + 4 * (offset[..., 0] ** 2 * spread[0] + offset[..., 1] ** 2 * spread[1])
    return float((surplus / np.sqrt(total)).min())
