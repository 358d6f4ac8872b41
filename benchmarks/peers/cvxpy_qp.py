"""One QP of the reformulated problem in CVXPY. It has parameters, so that only the data change between solves."""

from __future__ import annotations

import cvxpy
import numpy as np

from foc_ros.core.ocp.qp import ReachingQP

from .dense import Array


class CvxpyQP:
    """The program for QPs of one size: m obstacle rows, r goal rows, 2N controls scaled to a unit Hessian."""

    def __init__(self, qp: ReachingQP, solver: str = 'CLARABEL') -> None:
        rows, columns, goals = qp.limits.size, len(qp.cost.hessian), len(qp.cost.goal_targets)
        self.solver = solver
        self.u = cvxpy.Variable(columns)
        self.G, self.h = cvxpy.Parameter((rows, columns)), cvxpy.Parameter(rows)
        self.E, self.b = cvxpy.Parameter((goals, columns)), cvxpy.Parameter(goals)
        objective = cvxpy.Minimize(cvxpy.sum_squares(self.u))
        self.program = cvxpy.Problem(objective, [self.G @ self.u >= self.h, self.E @ self.u == self.b])

    def solve(self, qp: ReachingQP) -> Array:
        """Return the control (2N,)."""
        obstacle, step = np.divmod(np.arange(qp.limits.size), qp.limits.shape[1])
        unit = np.sqrt(1 / qp.cost.hessian)
        self.G.value, self.h.value = qp.rows(obstacle, step) * unit, qp.limits.ravel()
        self.E.value, self.b.value = qp.cost.goal_rows * unit, qp.cost.goal_targets
        self.program.solve(solver=self.solver)
        return np.asarray(unit * self.u.value)
