"""The seam to QP solvers: PIQP through its own interface, any qpsolvers backend by name for cross-checks."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import piqp

from .records import Array

ACCURACY = 1e-11
"""Absolute and relative accuracy asked of PIQP, on problems scaled to numbers around 1."""


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


def _settings(solver: Any, scale_cost: bool) -> None:
    solver.settings.eps_abs = ACCURACY
    solver.settings.eps_rel = ACCURACY
    solver.settings.check_duality_gap = False
    solver.settings.compute_timings = False
    solver.settings.preconditioner_scale_cost = scale_cost


def solve_piqp(qp: DenseQP) -> Array | None:
    """Return the minimiser, or None where PIQP finds none with any of its settings.

    PIQP can call a feasible problem infeasible, so a refusal is believed only after a second try with the cost scaled.
    """
    G, g = (None, None) if qp.G is None or qp.g is None else (np.asfortranarray(qp.G), qp.g)
    for scale_cost in (False, True):
        solver = piqp.DenseSolver()
        _settings(solver, scale_cost)
        solver.setup(np.asfortranarray(qp.P), qp.c, qp.A, qp.b, G, g, None, qp.lower, None)
        if solver.solve() == piqp.PIQP_SOLVED:
            return np.array(solver.result.x)
    return None


def solve_named(qp: DenseQP, backend: str) -> Array | None:
    """Return the minimiser found by a qpsolvers backend such as `daqp` or `quadprog`, None where it finds none."""
    from qpsolvers import Problem, solve_problem

    G, h = (None, None) if qp.G is None or qp.g is None else (-qp.G, -qp.g)
    solution = solve_problem(Problem(qp.P, qp.c, G, h, qp.A, qp.b, qp.lower), solver=backend)
    return np.asarray(solution.x) if solution.found else None
