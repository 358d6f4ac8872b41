"""Solve the QP of one linearisation in the range space of the few obstacle rows that matter.

A working set of rows M adds multipliers y >= 0 found from min 1/2 y'Ky - m'y, K = M P M', m what the goal's control u_goal leaves
missing, and u = u_goal + P M'y (P: `qp.Cost`). Rows that u violates join the set until there are none: the result is that of the
QP with every row.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import Enum
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from .backend import DenseQP, solve_named, solve_piqp
from .qp import ReachingQP
from .records import Array

Index = NDArray[np.intp]

TOLERANCE = 1e-9
"""Violation of an obstacle row that is not worth another round [m]."""
MAX_ROUNDS = 25
"""Rounds of the working set before the full QP is solved instead; two or three are usual."""
ELASTICITY = 1e-6
"""Softness of elastic rows, as a share of what a unit multiplier moves them: a lone row gives way by a millionth."""
IMMOVABLE = 1e-12
"""Share of a row's freedom that the goal leaves it, below which the goal fixes it: the last step's, above all."""
RESIDUAL = 1e-6
"""What rows may miss, and rows with a multiplier may have to spare, before the full QP is solved instead; relative."""
FARKAS = 1e-4
"""How little, relative to what is missing, the combination of rows may move that proves a contradiction."""
NEGLIGIBLE = 1e-7
"""Multiplier that counts as zero, relative to the largest, in units in which every row moves itself by one."""


@dataclass(frozen=True, eq=False)
class WorkingSet:
    """Obstacle rows taken into account: obstacle and step index (0..N-1), (k,) each."""

    obstacle: Index = field(default_factory=lambda: np.zeros(0, dtype=np.intp))
    step: Index = field(default_factory=lambda: np.zeros(0, dtype=np.intp))

    def __len__(self) -> int:
        return len(self.obstacle)

    @property
    def rows(self) -> tuple[Index, Index]:
        """Obstacle and step index, as an index into arrays (m, N)."""
        return self.obstacle, self.step

    def joined(self, obstacle: Index, step: Index, steps: int) -> WorkingSet:
        """Return the set with more rows, each once, in order."""
        flat = np.unique(np.concatenate((self.obstacle * steps + self.step, obstacle * steps + step)))
        return WorkingSet(*np.divmod(flat, steps))

    def only(self, keep: NDArray[np.bool_]) -> WorkingSet:
        """Return the set of the rows to keep (k,)."""
        return WorkingSet(self.obstacle[keep], self.step[keep])


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
    control, multipliers = qp.cost.goal_control, np.zeros(0)
    for solves in range(1, MAX_ROUNDS + 1):
        if len(working):
            answer = _with_rows(qp, working, elastic)
            if answer is Verdict.CONTRADICTION:
                return None
            if answer is Verdict.UNSOLVED:
                break
            control, multipliers = answer
        violation = qp.limits - qp.row_values(control)
        # rows just solved for are met but for rounding; an elastic row may stay violated
        violation[working.obstacle, working.step] = 0.0
        if violation.max(initial=0.0) <= TOLERANCE:
            active = multipliers > 0
            return QPSolution(control, working.only(active), multipliers[active], solves)
        if not elastic:
            working = working.only(multipliers > 0)
        working = working.joined(*peaks(violation, TOLERANCE), violation.shape[1])
    return None if elastic else solve_full(qp)


def peaks(violation: Array, tolerance: float) -> tuple[Index, Index]:
    """Return the worst row of every stretch of violated steps (m, N), as obstacle and step index."""
    peak = violation > tolerance
    peak[:, 1:] &= violation[:, 1:] >= violation[:, :-1]
    peak[:, :-1] &= violation[:, :-1] > violation[:, 1:]
    obstacle, step = np.nonzero(peak)
    return obstacle, step


class Verdict(Enum):
    """Why there is no control for a working set: its rows contradict each other, or the solver failed."""

    CONTRADICTION = 'contradiction'
    UNSOLVED = 'unsolved'


def _with_rows(
    qp: ReachingQP, working: WorkingSet, elastic: bool
) -> tuple[Array, Array] | Literal[Verdict.CONTRADICTION, Verdict.UNSOLVED]:
    """Return control (2N,) and multipliers (k,) for the rows of the working set alone."""
    rows = qp.rows(working.obstacle, working.step)
    pressed = qp.cost.pressed(rows)
    missing = qp.limits[working.obstacle, working.step] - rows @ qp.cost.goal_control
    gram = pressed @ rows.T
    moved, wanted = gram.diagonal(), (rows**2) @ (1.0 / qp.cost.hessian)
    fixed = moved < IMMOVABLE * wanted
    if fixed.any():
        if not elastic and (missing[fixed] > TOLERANCE).any():
            return Verdict.CONTRADICTION
        gram[fixed], gram[:, fixed], missing[fixed] = 0.0, 0.0, 0.0
        gram[fixed, fixed] = 1.0
    scale = 1.0 / np.sqrt(gram.diagonal())
    missing = scale * missing
    size = max(-float(missing.min()), float(missing.max()), 1e-300)
    gram *= scale[:, None] * scale
    if elastic:
        gram.flat[:: len(gram) + 1] += ELASTICITY
    answer = solve_piqp(DenseQP(gram, missing / -size, lower=np.zeros(len(rows))))
    if not answer.solved:
        # Farkas: a combination y >= 0 of the rows that moves nothing and yet is missing something
        ray = answer.x / max(float(answer.x.max()), 1e-300)
        return Verdict.CONTRADICTION if np.abs(gram @ ray).max() < FARKAS * float(missing @ ray) / size else Verdict.UNSOLVED
    multipliers = _polished(gram, missing / size, answer.x)
    left, largest = gram @ multipliers - missing / size, max(float(multipliers.max()), 1.0)
    if left.min() < -RESIDUAL * (largest if elastic else 1.0) or np.abs(left * multipliers).max() > RESIDUAL * largest**2:
        return Verdict.UNSOLVED
    multipliers *= scale * size
    return qp.cost.goal_control + multipliers @ pressed, multipliers


def _polished(gram: Array, missing: Array, answer: Array) -> Array:
    """Sharpen an interior-point answer: solve for the multipliers that are not zero, if that keeps their signs."""
    active = np.flatnonzero(answer > NEGLIGIBLE * answer.max(initial=0.0))
    inner, wanted = gram[active[:, None], active], missing[active]
    polished = np.zeros_like(answer)
    polished[active] = answer[active]
    try:
        sharp = np.linalg.solve(inner, wanted)
    except np.linalg.LinAlgError:
        return polished
    if len(sharp) and sharp.min() > 0 and np.abs(inner @ sharp - wanted).max() < 1e-10:
        polished[active] = sharp
    return polished


def solve_full(qp: ReachingQP, backend: str = 'piqp') -> QPSolution | None:
    """Solve with every row at once, by PIQP or any qpsolvers backend: the slow road, for cross-checks and as a last resort.

    Its active rows are those met with less than 1e-7 m to spare; their multipliers are not returned (NaN).
    """
    cost = qp.cost
    obstacle, step = np.divmod(np.arange(qp.limits.size), qp.limits.shape[1])
    hard = cost.softness == 0
    unit = np.sqrt(1.0 / cost.hessian)  # makes the Hessian of the scaled control 1
    soft = cost.goal_rows[~hard] * unit
    pull = soft.T / cost.softness[~hard]
    c = -pull @ cost.goal_targets[~hard] - (0.0 if cost.linear is None else unit * cost.linear)
    dense = DenseQP(
        np.eye(len(unit)) + pull @ soft,
        c,
        cost.goal_rows[hard] * unit,
        cost.goal_targets[hard],
        qp.rows(obstacle, step) * unit,
        qp.limits.ravel(),
    )
    scaled = solve_piqp(dense) if backend == 'piqp' else solve_named(dense, backend)
    if not scaled.solved:
        return None
    control = unit * scaled.x
    active = WorkingSet(*np.nonzero(qp.row_values(control) - qp.limits < 1e-7))
    return QPSolution(control, active, np.full(len(active), np.nan), 1)
