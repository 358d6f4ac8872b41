"""Solution of the QP of one linearisation in the range space of the few obstacle rows that matter.

A working set of rows M has multipliers y >= 0, which minimise 1/2 y'Ky - m'y with K = M P M' and m what the goal's control u_goal
leaves missing, and u = u_goal + P M'y (P: `qp.GoalSolution`). Rows that u violates are added until there are none: the result is
that of the QP with every row.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import Enum
from typing import Literal, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from foc_ros.core.deadline import NEVER, Deadline
from foc_ros.core.kernels import Indices, Matrix, Vector, compiled, compiled_with_caller
from foc_ros.core.kernels.linear_algebra import factorise_cholesky, multiply_vector, solve_lower, solve_lower_transposed
from foc_ros.core.registry import QP_BACKENDS
from foc_ros.core.types import Array

from .backend import DenseQP, estimate_time, solve_piqp
from .qp import GoalSolution, ObstacleRows, ReachingQP, collect_rows, find_violated, schur_complement

Index = NDArray[np.intp]

TOLERANCE = 1e-9
"""Violation of an obstacle row that does not need another round [m]."""
MAX_ROUNDS = 25
"""Rounds of the working set before the full QP is solved instead; two or three are usual."""
ELASTICITY = 1e-6
"""Softness of elastic rows, as a share of the effect of a unit multiplier on its own row: a lone row gives way by a millionth."""
MOST_ELASTIC = 150
"""Number of elastic rows beyond which no more are added: such rows are out of reach by far."""
IMMOVABLE = 1e-12
"""Share of a row's freedom that the goal leaves, below which the goal decides the row: above all at the last step."""
RESIDUAL = 1e-6
"""Relative violation of rows, and slack of rows with a multiplier, beyond which the full QP is solved instead."""
FARKAS = 1e-4
"""Largest effect of a combination of rows, relative to what is missing in it, that proves a contradiction."""
NEGLIGIBLE = 1e-7
"""Multiplier that counts as zero, relative to the largest, in units in which each row's multiplier changes it by one."""
EXACT = 1e-10
"""Largest residual of the equations of the multipliers that are not zero, when they are solved directly."""


@dataclass(frozen=True, eq=False)
class WorkingSet:
    """Obstacle rows taken into account: obstacle and step index (0..N-1), (k,) each, contiguous."""

    obstacle: Index = field(default_factory=lambda: np.zeros(0, dtype=np.intp))
    step: Index = field(default_factory=lambda: np.zeros(0, dtype=np.intp))

    def __len__(self) -> int:
        return len(self.obstacle)

    @property
    def rows(self) -> tuple[Index, Index]:
        """Obstacle and step index, as an index into arrays (m, N)."""
        return self.obstacle, self.step

    def within(self, steps: int) -> WorkingSet:
        """Return the rows at the first so many steps."""
        return self.only(self.step < steps)

    def only(self, keep: NDArray[np.bool_]) -> WorkingSet:
        """Return the set of the rows to keep (k,)."""
        return WorkingSet(self.obstacle[keep], self.step[keep])

    def unite(self, obstacle: Index, step: Index, steps: int) -> WorkingSet:
        """Return these rows and others, each once, in order of obstacle and step (0..steps - 1)."""
        flat = np.union1d(self.obstacle * steps + self.step, obstacle * steps + step)
        return WorkingSet(*np.divmod(flat, steps))


@dataclass(frozen=True, eq=False)
class QPSolution:
    """The control (2N,); the active rows, which have a positive multiplier; these multipliers (k,); number of QPs solved."""

    control: Array
    active: WorkingSet
    multipliers: Array
    solves: int = 0


class DualStatus(Enum):
    """Why there are no multipliers for a working set: its rows contradict each other, or the solver failed."""

    CONTRADICTION = 'contradiction'
    UNSOLVED = 'unsolved'


Failed: TypeAlias = Literal[DualStatus.CONTRADICTION, DualStatus.UNSOLVED]


class DualQP(NamedTuple):
    """The QP for the multipliers of k rows M, in units in which a row's multiplier changes it by one, and at most one is missing.

    effects: M P (k, 2N), without these units; gram: K (k, k); missing (k,): what the goal's control leaves missing; unit (k,): of
    each multiplier; immovable: the most that is missing in a row which the goal alone decides [m]. Such a row takes no part in K.
    """

    effects: Matrix
    gram: Matrix
    missing: Vector
    unit: Vector
    immovable: float


def solve(
    qp: ReachingQP, working: WorkingSet, deadline: Deadline = NEVER, *, elastic: bool = False, thorough: bool = True
) -> QPSolution | None:
    """Solve a QP by its working set.

    Parameters
    ----------
    qp
        The QP, which names its solver.
    working
        Rows to begin with, for instance those of the last solution.
    deadline
        Checked before each round, which is not begun if it is likely to last longer.
    elastic
        Whether rows that contradict each other share the violation (least squares, each weighted by the effect of its control;
        the first `MOST_ELASTIC` of many), so that there always is a solution.
    thorough
        Whether to solve with every row at once where the working set does not end, which can take a hundred times as long.

    Returns
    -------
    QPSolution | None
        None where no control meets every row.

    Raises
    ------
    OutOfTimeError
        Past the deadline.
    """
    goal = qp.cost.goal_solution
    control, multipliers = goal.control, np.zeros(0)
    for solves in range(1, MAX_ROUNDS + 1):
        deadline.check(estimate_time(len(working)))
        if len(working):
            dual = reduce_to_range_space(qp.obstacle_rows, *working.rows, goal, ELASTICITY if elastic else 0.0)
            found = solve_dual(dual, qp.backend, elastic=elastic)
            if found is DualStatus.CONTRADICTION:
                return None
            if found is DualStatus.UNSOLVED:
                break
            multipliers, control = found, goal.control + found @ dual.effects
        # rows just solved for are met but for rounding; an elastic row may stay violated
        obstacle, step = find_violated(qp.obstacle_rows, control, *working.rows, TOLERANCE)
        if not len(obstacle) or (elastic and len(working) > MOST_ELASTIC):
            active = multipliers > 0
            return QPSolution(control, working.only(active), multipliers[active], solves)
        kept = working if elastic else working.only(multipliers > 0)
        working = kept.unite(obstacle, step, qp.limits.shape[1])
    if elastic or not thorough:
        return None
    deadline.check(estimate_time(len(goal.control), qp.limits.size))
    return solve_full(qp)


def solve_dual(dual: DualQP, backend: str, *, elastic: bool = False) -> Array | Failed:
    """Return the multipliers y (k,) >= 0 of least 1/2 y'Ky - m'y."""
    gram, missing = dual.gram, dual.missing
    if dual.immovable > TOLERANCE and not elastic:
        return DualStatus.CONTRADICTION
    answer = QP_BACKENDS.get(backend)(DenseQP(gram.T, -missing, lower=np.zeros(len(missing))))
    if not answer.solved:
        # Farkas: a combination y >= 0 of the rows that changes nothing although something is missing
        ray = answer.x / max(float(answer.x.max()), 1e-300)
        return DualStatus.CONTRADICTION if np.abs(gram @ ray).max() < FARKAS * float(missing @ ray) else DualStatus.UNSOLVED
    multipliers, largest, short, slack = refine_multipliers(gram, missing, dual.unit, answer.x)
    if short > RESIDUAL * (largest if elastic else 1.0) or slack > RESIDUAL * largest**2:
        return DualStatus.UNSOLVED
    return multipliers


@compiled_with_caller
def range_space(rows: Matrix, limits: Vector, goal: GoalSolution, softness: float) -> DualQP:
    """Return the dual QP of k rows (k, 2N) with limits (k,); softness is added to the diagonal of K."""
    effects, gram = schur_complement(rows, goal.inverse, goal.factor)
    k, immovable = len(limits), -np.inf
    missing, unit = limits - multiply_vector(rows, goal.control), np.ones(k)
    for i in range(k):
        alone = 0.0
        for u in range(rows.shape[1]):
            alone += rows[i, u] * rows[i, u] * goal.inverse[u]
        if gram[i, i] < IMMOVABLE * alone:
            immovable = max(immovable, missing[i])
            gram[i], gram[:, i], missing[i] = 0.0, 0.0, 0.0
            gram[i, i] = 1.0
    for i in range(k):
        unit[i] = 1.0 / np.sqrt(gram[i, i])
        missing[i] *= unit[i]
    for i in range(k):
        for j in range(k):
            gram[i, j] *= unit[i] * unit[j]
        gram[i, i] += softness
    size = max(np.abs(missing).max(), 1e-300)
    return DualQP(effects, gram, missing / size, unit * size, immovable)


@compiled
def reduce_to_range_space(rows: ObstacleRows, obstacle: Indices, step: Indices, goal: GoalSolution, softness: float) -> DualQP:
    """Return the dual QP of k pairs of obstacle and step."""
    limits = np.empty(len(step))
    for i in range(len(step)):
        limits[i] = rows.limits[obstacle[i], step[i]]
    return range_space(collect_rows(rows, obstacle, step), limits, goal, softness)


@compiled
def refine_multipliers(gram: Matrix, missing: Vector, unit: Vector, answer: Vector) -> tuple[Vector, float, float, float]:
    """Refine an interior-point solution: solve directly for the multipliers that are not zero, if that keeps their signs.

    Returns them (k,) without their units, the largest in its unit, but at least 1, the most that a row misses, and the largest
    product of a multiplier and the slack of its row.
    """
    active = np.flatnonzero(answer > NEGLIGIBLE * max(0.0, answer.max()))
    n = len(active)
    inner, wanted = np.empty((n, n)), np.empty((n, 1))
    multipliers = np.zeros(len(answer))
    for i in range(n):
        multipliers[active[i]], wanted[i, 0] = answer[active[i]], missing[active[i]]
        for j in range(n):
            inner[i, j] = gram[active[i], active[j]]
    factor = factorise_cholesky(inner, 0.0)
    exact = solve_lower_transposed(factor, solve_lower(factor, wanted)[:, 0].copy())
    residual = 0.0  # infinite where a sign is lost, or the rows are not independent: then the answer stays as it is
    for i in range(n):
        left = -wanted[i, 0]
        for j in range(n):
            left += inner[i, j] * exact[j]
        residual = max(residual, abs(left)) if exact[i] > 0 else np.inf
    if residual < EXACT:
        for i in range(n):
            multipliers[active[i]] = exact[i]
    short, slack = 0.0, 0.0
    for i in range(len(answer)):
        left = -missing[i]
        for j in range(len(answer)):
            left += gram[i, j] * multipliers[j]
        short, slack = max(short, -left), max(slack, abs(left * multipliers[i]))
    return multipliers * unit, max(multipliers.max(), 1.0), short, slack


def solve_full(qp: ReachingQP, backend: str | None = None) -> QPSolution | None:
    """Solve with every row at once, by the solver of the QP or another one: slow, for cross-checks and as a last resort.

    The active rows are those met with less than 1e-7 m to spare; their multipliers are not known (NaN).
    """
    cost, backend = qp.cost, backend or qp.backend
    obstacle, step = np.divmod(np.arange(qp.limits.size), qp.limits.shape[1])
    hard = cost.softness == 0
    unit = np.sqrt(1.0 / cost.hessian)  # makes the Hessian of the scaled control 1
    soft = cost.goal_rows[~hard] * unit
    pull = soft.T / cost.softness[~hard]
    dense = DenseQP(
        np.eye(len(unit)) + pull @ soft,
        -pull @ cost.goal_targets[~hard] - unit * cost.linear,
        cost.goal_rows[hard] * unit,
        cost.goal_targets[hard],
        qp.rows(obstacle, step) * unit,
        qp.limits.ravel(),
    )
    scaled = solve_piqp(dense, attempts=1) if backend == 'piqp' else QP_BACKENDS.get(backend)(dense)
    if not scaled.solved:
        return None
    control = unit * scaled.x
    active = WorkingSet(*map(np.ascontiguousarray, np.nonzero(qp.row_values(control) - qp.limits < 1e-7)))
    return QPSolution(control, active, np.full(len(active), np.nan), 1)
