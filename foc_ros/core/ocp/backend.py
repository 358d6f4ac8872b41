# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
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


def solve_piqp(qp: DenseQP) -> Answer:
    """Solve by PIQP, and if it fails again with other settings: it can miss an accuracy that rounding does not allow."""
    P = np.asfortranarray(qp.P)
    A = None if qp.A is None else np.asfortranarray(qp.A)
    G = None if qp.G is None else np.asfortranarray(qp.G)
    for accuracy, share, scale_cost in ATTEMPTS:
        solver = _get_piqp(accuracy, share, scale_cost)
        solver.setup(P, qp.c, A, qp.b, G, qp.g, None, qp.lower, None)
        if solver.solve() == piqp.PIQP_SOLVED:
            return Answer(True, np.array(solver.result.x))
    return Answer(False, np.array(solver.result.x))


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
        settings.tau, settings.preconditioner_scale_cost, settings.max_iter = share, scale_cost, MAX_ITERATIONS
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
