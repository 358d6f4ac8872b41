"""Solve the QP of one linearisation in the range space of the few obstacle rows that matter.

With the Hessian diagonal, the minimiser that meets only the goal is known in closed form. A working set of obstacle rows M
adds multipliers y >= 0 found from min 1/2 y'Ky - m'y, K = M P M' with P = H^-1 - H^-1 E'(E H^-1 E' + softness)^-1 E H^-1, and
u = u_goal + P M'y. Rows that u violates join the set until there are none: the result is that of the QP with every row.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from .backend import DenseQP, solve_named, solve_piqp
from .qp import ReachingQP
from .records import Array

TOLERANCE = 1e-9
"""Violation of an obstacle row that is not worth another round [m]."""
MAX_ROUNDS = 25
"""Rounds of the working set before the full QP is solved instead; two or three are usual."""
ELASTICITY = 1e-6
"""Softness of elastic rows, as a share of what a unit multiplier moves them: a lone row gives way by a millionth."""


@dataclass(frozen=True, eq=False)
class WorkingSet:
    """Obstacle rows taken into account: obstacle and step index, (k,) each."""

    obstacle: Array = field(default_factory=lambda: np.zeros(0, dtype=np.intp))
    step: Array = field(default_factory=lambda: np.zeros(0, dtype=np.intp))

    def __len__(self) -> int:
        return len(self.obstacle)


@dataclass(frozen=True, eq=False)
class QPSolution:
    """control (2N,); active: the rows with a positive multiplier; multipliers (k,) of those; solves: QPs it took."""

    control: Array
    active: WorkingSet
    multipliers: Array
    solves: int


def solve(qp: ReachingQP, working: WorkingSet, *, elastic: bool = False) -> QPSolution | None:
    """Return the solution, None where no control meets every row.

    working: rows to begin with, say those of the last solve. elastic: rows that contradict each other share the violation
    instead (least squares, each weighted by what its control can move), so that there always is an answer.
    """
    space = _RangeSpace(qp, elastic)
    control, multipliers, solves = space.goal_control, np.zeros(0), 0
    if len(working):
        working = WorkingSet(*_unique(working.obstacle, working.step, qp.limits.shape))
    for _ in range(MAX_ROUNDS):
        if len(working):
            solves += 1
            answer = space.with_rows(working)
            if answer is None:
                return None
            control, multipliers = answer
        worst = _violated(qp.limits - qp.row_values(control), working)
        if worst is None:
            active = multipliers > 0
            return QPSolution(
                control, WorkingSet(working.obstacle[active], working.step[active]), multipliers[active], max(solves, 1)
            )
        keep = multipliers > 0 if len(multipliers) else slice(None)
        working = WorkingSet(
            *_unique(
                np.concatenate((working.obstacle[keep], worst[0])),
                np.concatenate((working.step[keep], worst[1])),
                qp.limits.shape,
            )
        )
    return None if elastic else solve_full(qp)


def _unique(obstacle: Array, step: Array, shape: tuple[int, ...]) -> tuple[Array, Array]:
    return np.unravel_index(np.unique(np.ravel_multi_index((obstacle, step), shape)), shape)  # type: ignore[return-value]


def _violated(violation: Array, working: WorkingSet) -> tuple[Array, Array] | None:
    """Return the worst violated row of each stretch of steps, None where no row outside the working set is violated."""
    violation = violation.copy()
    violation[working.obstacle, working.step] = 0.0
    if violation.max(initial=0.0) <= TOLERANCE:
        return None
    before = np.pad(violation, ((0, 0), (1, 0)), constant_values=-np.inf)[:, :-1]
    after = np.pad(violation, ((0, 0), (0, 1)), constant_values=-np.inf)[:, 1:]
    return np.nonzero((violation > TOLERANCE) & (violation >= before) & (violation > after))  # type: ignore[return-value]


class _RangeSpace:
    """The closed-form part of one QP."""

    def __init__(self, qp: ReachingQP, elastic: bool) -> None:
        self.qp = qp
        self.elastic = elastic
        self.inverse = 1.0 / qp.hessian
        weighted = qp.goal_rows * self.inverse
        gram = weighted @ qp.goal_rows.T
        # unit diagonal: the goal rows mix metres, metres per second and their like
        self.scale = 1.0 / np.sqrt(np.diag(gram))
        gram = gram * self.scale[:, None] * self.scale[None, :] + np.diag(qp.softness * self.scale**2)
        factor = np.linalg.inv(np.linalg.cholesky(gram))
        self.goal = (factor * self.scale) @ weighted  # rows: orthonormalised goal rows times H^-1
        free = self.inverse * qp.linear
        self.goal_control: Array = free + self.goal.T @ (factor @ (self.scale * (qp.goal_targets - qp.goal_rows @ free)))

    def with_rows(self, working: WorkingSet) -> tuple[Array, Array] | None:
        """Return control (2N,) and multipliers (k,) for the rows of the working set alone; None where they contradict."""
        rows = self.qp.rows(working.obstacle, working.step)
        projected = rows * self.inverse - (rows @ self.goal.T) @ self.goal
        missing = self.qp.limits[working.obstacle, working.step] - rows @ self.goal_control
        gram = projected @ rows.T
        scale = 1.0 / np.sqrt(np.maximum(np.diag(gram), 1e-300))
        size = max(float(np.abs(scale * missing).max()), 1e-300)
        gram = gram * scale[:, None] * scale[None, :]
        if self.elastic:
            gram[np.diag_indices_from(gram)] += ELASTICITY
        dual = DenseQP(gram, -scale * missing / size, lower=np.zeros(len(rows)))
        answer = solve_piqp(dual)
        if answer is None:
            return None
        multipliers = _polished(dual, answer) * scale * size
        return self.goal_control + multipliers @ projected, multipliers


def _polished(dual: DenseQP, answer: Array) -> Array:
    """Sharpen an interior-point answer: solve for the multipliers that are not zero, if that keeps their signs."""
    active = answer > 1e-7 * answer.max(initial=0.0)
    gram, missing = dual.P[np.ix_(active, active)], -dual.c[active]
    sharp = np.linalg.lstsq(gram, missing, rcond=1e-13)[0]
    polished = np.zeros_like(answer)
    polished[active] = sharp if sharp.min(initial=0.0) >= 0 else answer[active]
    return polished


def solve_full(qp: ReachingQP, backend: str = 'piqp') -> QPSolution | None:
    """Solve with every row at once, by PIQP or any qpsolvers backend: the slow road, for cross-checks and as a last resort."""
    m, n = qp.limits.shape
    obstacle, step = np.divmod(np.arange(m * n), n)
    hard = qp.softness == 0
    soft = qp.goal_rows[~hard]
    control_unit = np.sqrt(1.0 / qp.hessian)  # makes the Hessian of the scaled control 1
    P = np.eye(len(qp.hessian)) + (control_unit[:, None] * soft.T / qp.softness[~hard]) @ (soft * control_unit)
    c = -(control_unit[:, None] * soft.T / qp.softness[~hard]) @ qp.goal_targets[~hard] - control_unit * qp.linear
    dense = DenseQP(
        P, c, qp.goal_rows[hard] * control_unit, qp.goal_targets[hard], qp.rows(obstacle, step) * control_unit, qp.limits.ravel()
    )
    scaled = solve_piqp(dense) if backend == 'piqp' else solve_named(dense, backend)
    if scaled is None:
        return None
    control = control_unit * scaled
    slack = qp.row_values(control) - qp.limits
    active = np.nonzero(slack < 1e-7)
    return QPSolution(control, WorkingSet(*active), np.full(len(active[0]), np.nan), 1)
