"""The seam to QP solvers: PIQP through its own interface, any qpsolvers backend by name for cross-checks."""

from __future__ import annotations

import threading
from dataclasses import dataclass

import numpy as np
import piqp

from foc_ros.core.types import Array

ATTEMPTS = ((1e-10, 0.99, False), (1e-9, 0.9, False), (1e-7, 0.9, True))
"""Accuracy (absolute and relative, on problems scaled to numbers around 1), share of the way to the boundary that a step may go,
and cost scaling asked of PIQP, one after the other. With 0.99 it can step to and fro for ever on three variables."""
INFEASIBLE = 1e-10
"""Accuracy of PIQP's own proofs of infeasibility: with its default, 1e-4, rows that hardly give way pass for a contradiction."""
MAX_ITERATIONS = 100
"""Of one attempt; 5 to 15 are usual."""


@dataclass(frozen=True)
class DenseQP:
    """minimise 1/2 x'Px + c'x subject to A x = b, G x >= g, x >= lower: A, G and lower may be None."""

    P: Array
    c: Array
    A: Array | None = None
    b: Array | None = None
    G: Array | None = None
    g: Array | None = None
    lower: Array | None = None


@dataclass(frozen=True, eq=False)
class Answer:
    """solved, and the minimiser; or not, and the last iterate, which may prove why."""

    solved: bool
    x: Array


def solve_piqp(qp: DenseQP, attempts: int = len(ATTEMPTS)) -> Answer:
    """Solve by PIQP, with other settings if it fails with the first, as often as there are attempts.

    PIQP can call a feasible problem infeasible, or miss an accuracy that rounding does not allow.
    """
    P = np.asfortranarray(qp.P)
    A = None if qp.A is None else np.asfortranarray(qp.A)
    G = None if qp.G is None else np.asfortranarray(qp.G)
    for accuracy, reach, scale_cost in ATTEMPTS[:attempts]:
        solver = _solver(accuracy, reach, scale_cost)
        solver.setup(P, qp.c, A, qp.b, G, qp.g, None, qp.lower, None)
        if solver.solve() == piqp.PIQP_SOLVED:
            return Answer(True, np.array(solver.result.x))
    return Answer(False, np.array(solver.result.x))


class _Made(threading.local):
    """Solvers that this thread has made: each setup begins anew, and only the settings stay."""

    def __init__(self) -> None:
        self.solvers: dict[tuple[float, float, bool], piqp.DenseSolver] = {}


_MADE = _Made()


def _solver(accuracy: float, reach: float, scale_cost: bool) -> piqp.DenseSolver:
    kept = _MADE.solvers
    if (accuracy, reach, scale_cost) not in kept:
        solver = kept[accuracy, reach, scale_cost] = piqp.DenseSolver()
        settings = solver.settings
        settings.eps_abs = settings.eps_rel = settings.eps_duality_gap_abs = settings.eps_duality_gap_rel = accuracy
        settings.tau, settings.preconditioner_scale_cost, settings.max_iter = reach, scale_cost, MAX_ITERATIONS
        if hasattr(settings, 'eps_dual_inf'):  # from 0.7 on
            settings.eps_dual_inf = settings.eps_primal_inf = INFEASIBLE
    return kept[accuracy, reach, scale_cost]


def solve_named(qp: DenseQP, backend: str) -> Answer:
    """Solve by a qpsolvers backend such as `daqp` or `quadprog`."""
    from qpsolvers import Problem, solve_problem

    G, h = (None, None) if qp.G is None or qp.g is None else (-qp.G, -qp.g)
    solution = solve_problem(Problem(qp.P, qp.c, G, h, qp.A, qp.b, qp.lower), solver=backend)
    return Answer(bool(solution.found), np.asarray(solution.x) if solution.found else np.zeros_like(qp.c))
