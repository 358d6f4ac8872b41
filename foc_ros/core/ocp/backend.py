"""Solvers of quadratic programmes: PIQP through its own interface, any other that qpsolvers knows by its name.

A solver is a function from `DenseQP` to `Answer`. It never raises for a problem that it cannot solve.
"""

from __future__ import annotations

import threading
import warnings
from typing import NamedTuple

import numpy as np
import piqp

from foc_ros.core.types import Array

ATTEMPTS = ((1e-10, 0.99, False), (1e-9, 0.9, False), (1e-7, 0.9, True))
"""Settings of PIQP that are tried in this order: accuracy (absolute and relative, for problems scaled to numbers around 1), share
of the way to the boundary that a step may take, cost scaling. With 0.99 PIQP can oscillate for ever on three variables."""
INFEASIBLE = 1e-10
"""Accuracy of PIQP's proofs of infeasibility. With its default, 1e-4, it takes rows that hardly give way for a contradiction."""
MAX_ITERATIONS = 100
"""Of one attempt; 5 to 15 are usual."""
LARGEST_WORK = 1_000_000_000
"""Bound on variables^2 (variables + rows) times the iterations of an attempt: 0.1 s, during which Python runs no other thread."""
WORK_PER_S = 1e10
"""The same work in one second."""
USUAL_ITERATIONS = 15
FEWEST_ITERATIONS = 10
"""A problem for which the bound does not allow so many iterations is not tried."""


class DenseQP(NamedTuple):
    """minimise 1/2 x'Px + c'x subject to A x = b, G x >= g, x >= lower; A, G and lower may be None."""

    P: Array
    c: Array
    A: Array | None = None
    b: Array | None = None
    G: Array | None = None
    g: Array | None = None
    lower: Array | None = None


class Answer(NamedTuple):
    """Whether the problem was solved, and the minimiser; if not, the last iterate, which may prove that there is none."""

    solved: bool
    x: Array


def solve_piqp(qp: DenseQP, attempts: int = len(ATTEMPTS)) -> Answer:
    """Solve by PIQP, and if it fails again with other settings, up to a number of attempts.

    PIQP can call a feasible problem infeasible, or miss an accuracy that rounding does not allow. A problem too large for
    `LARGEST_WORK` counts as not solved.
    """
    variables, rows = len(qp.c), 0 if qp.g is None else len(qp.g)
    iterations = min(MAX_ITERATIONS, LARGEST_WORK // max(variables**2 * (variables + rows), 1))
    if iterations < FEWEST_ITERATIONS:
        return Answer(False, np.zeros(variables))
    P = np.asfortranarray(qp.P)
    A = None if qp.A is None else np.asfortranarray(qp.A)
    G = None if qp.G is None else np.asfortranarray(qp.G)
    for accuracy, share, scale_cost in ATTEMPTS[:attempts]:
        solver = _get_piqp(accuracy, share, scale_cost)
        solver.settings.max_iter = iterations
        solver.setup(P, qp.c, A, qp.b, G, qp.g, None, qp.lower, None)
        if solver.solve() == piqp.PIQP_SOLVED:
            return Answer(True, np.array(solver.result.x))
    return Answer(False, np.array(solver.result.x))


def estimate_time(variables: int, rows: int = 0) -> float:
    """Return the time that PIQP usually takes at most [s]."""
    return USUAL_ITERATIONS * variables**2 * (variables + rows) / WORK_PER_S


class _SolversOfThread(threading.local):
    """PIQP solvers that this thread has made. Each setup starts afresh; only the settings are kept."""

    def __init__(self) -> None:
        self.solvers: dict[tuple[float, float, bool], piqp.DenseSolver] = {}


_SOLVERS = _SolversOfThread()


def _get_piqp(accuracy: float, share: float, scale_cost: bool) -> piqp.DenseSolver:
    kept = _SOLVERS.solvers
    if (accuracy, share, scale_cost) not in kept:
        solver = kept[accuracy, share, scale_cost] = piqp.DenseSolver()
        settings = solver.settings
        settings.eps_abs = settings.eps_rel = settings.eps_duality_gap_abs = settings.eps_duality_gap_rel = accuracy
        settings.tau, settings.preconditioner_scale_cost = share, scale_cost
        if hasattr(settings, 'eps_dual_inf'):  # from 0.7 on
            settings.eps_dual_inf = settings.eps_primal_inf = INFEASIBLE
    return kept[accuracy, share, scale_cost]


def solve_named(qp: DenseQP, backend: str) -> Answer:
    """Solve by a qpsolvers backend such as `daqp` or `quadprog`. Its last iterate is not known: zeros stand for it."""
    from qpsolvers import Problem, ProblemError, solve_problem

    G, h = (None, None) if qp.G is None or qp.g is None else (-qp.G, -qp.g)
    try:
        with warnings.catch_warnings(action='ignore'):
            solution = solve_problem(Problem(qp.P, qp.c, G, h, qp.A, qp.b, qp.lower), solver=backend)
    except ProblemError:  # say a matrix that this solver finds indefinite
        return Answer(False, np.zeros_like(qp.c))
    return Answer(bool(solution.found), np.asarray(solution.x) if solution.found else np.zeros_like(qp.c))
