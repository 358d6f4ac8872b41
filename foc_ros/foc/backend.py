"""The seam to QP solvers: PIQP through its own interface, any qpsolvers backend by name for cross-checks."""

from __future__ import annotations

from dataclasses import dataclass
import numpy as np
import piqp

from .records import Array

ATTEMPTS = ((1e-10, False), (1e-8, True), (1e-6, True))
"""Accuracy (absolute and relative, on problems scaled to numbers around 1) and cost scaling asked of PIQP, one after the other."""


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


def solve_piqp(qp: DenseQP) -> Array | None:
    """Return the minimiser, or None where PIQP finds none with any of its settings.

    PIQP can call a feasible problem infeasible, or miss an accuracy that rounding does not allow, so a refusal is believed only
    after further attempts.
    """
    P = np.asfortranarray(qp.P)
    A = None if qp.A is None else np.asfortranarray(qp.A)
    G = None if qp.G is None else np.asfortranarray(qp.G)
    for accuracy, scale_cost in ATTEMPTS:
        solver = piqp.DenseSolver()
        solver.settings.eps_abs = solver.settings.eps_rel = accuracy
        solver.settings.eps_duality_gap_abs = solver.settings.eps_duality_gap_rel = accuracy
        solver.settings.preconditioner_scale_cost = scale_cost
        solver.setup(P, qp.c, A, qp.b, G, qp.g, None, qp.lower, None)
        if solver.solve() == piqp.PIQP_SOLVED:
            return np.array(solver.result.x)
    return None


def solve_named(qp: DenseQP, backend: str) -> Array | None:
    """Return the minimiser found by a qpsolvers backend such as `daqp` or `quadprog`, None where it finds none."""
    from qpsolvers import Problem, solve_problem

    G, h = (None, None) if qp.G is None or qp.g is None else (-qp.G, -qp.g)
    solution = solve_problem(Problem(qp.P, qp.c, G, h, qp.A, qp.b, qp.lower), solver=backend)
    return np.asarray(solution.x) if solution.found else None
