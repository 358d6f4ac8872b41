"""Solve the QP of one linearisation in the range space of the few obstacle rows that matter.

A working set of rows M adds multipliers y >= 0 found from min 1/2 y'Ky - m'y, K = M P M', m what the goal's control u_goal leaves
missing, and u = u_goal + P M'y (P: `qp.Cost`). Rows that u violates join the set until there are none: the result is that of the
QP with every row.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import Enum
from typing import Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from foc_ros.core.kernels import Indices, Matrix, Tensor, Vector, compiled
from foc_ros.core.linear_algebra import factorise_cholesky, multiply, multiply_vector, solve_lower, solve_lower_transposed
from foc_ros.core.types import Array

from .backend import DenseQP, solve_named, solve_piqp
from .qp import Cost, ReachingQP, collect_rows, find_violated, schur_complement

Index = NDArray[np.intp]

TOLERANCE = 1e-9
"""Violation of an obstacle row that is not worth another round [m]."""
MAX_ROUNDS = 25
"""Rounds of the working set before the full QP is solved instead; two or three are usual."""
ELASTICITY = 1e-6
"""Softness of elastic rows, as a share of what a unit multiplier moves them: a lone row gives way by a millionth."""
MOST_ELASTIC = 150
"""Elastic rows beyond which no more are taken in: what they ask for is out of reach by far."""
IMMOVABLE = 1e-12
"""Share of a row's freedom that the goal leaves it, below which the goal fixes it: the last step's, above all."""
RESIDUAL = 1e-6
"""What rows may miss, and rows with a multiplier may have to spare, before the full QP is solved instead; relative."""
FARKAS = 1e-4
"""How little, relative to what is missing, the combination of rows may move that proves a contradiction."""
NEGLIGIBLE = 1e-7
"""Multiplier that counts as zero, relative to the largest, in units in which every row moves itself by one."""
SHARP = 1e-10
"""What the equations of the multipliers that are not zero may be off by when solved for directly."""


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

    def within(self, steps: int) -> WorkingSet:
        """Return the rows at the first so many steps."""
        return self.only(self.step < steps)

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


def solve(qp: ReachingQP, working: WorkingSet, *, elastic: bool = False, thorough: bool = True) -> QPSolution | None:
    """Return the solution, None where no control meets every row.

    working: rows to begin with, say those of the last solve. elastic: rows that contradict each other share the violation
    instead (least squares, each weighted by what its control can move; the first `MOST_ELASTIC` of many), so that there always is
    an answer. thorough: where the working set comes to no end, solve with every row at once, which can take a hundred times as
    long.
    """
    goal_control, (inverse, _, factor) = qp.cost.goal_control, qp.cost.factors
    control, multipliers = goal_control, np.zeros(0)
    for solves in range(1, MAX_ROUNDS + 1):
        if len(working):
            softness = ELASTICITY if elastic else 0.0
            space = reduce_to_range_space(*qp.terms, *working.rows, inverse, factor, goal_control, softness)
            pressing = multipliers_of(*space[1:], elastic=elastic)
            if pressing is DualStatus.CONTRADICTION:
                return None
            if pressing is DualStatus.UNSOLVED:
                break
            multipliers, control = pressing, apply_multipliers(pressing, space[0], goal_control)
        # rows just solved for are met but for rounding; an elastic row may stay violated
        obstacle, step = find_violated(*qp.terms, control, *working.rows, TOLERANCE)
        if not len(obstacle) or (elastic and len(working) > MOST_ELASTIC):
            active = multipliers > 0
            return QPSolution(control, working.only(active), multipliers[active], solves)
        kept = working if elastic else working.only(multipliers > 0)
        working = WorkingSet(*unite_rows(*kept.rows, obstacle, step, qp.limits.shape[1]))
    return solve_full(qp) if thorough and not elastic else None


@compiled
def unite_rows(
    obstacle: Indices, step: Indices, other_obstacle: Indices, other_step: Indices, steps: int
) -> tuple[Indices, Indices]:
    """Return the rows of two sets, each once, in order of obstacle and step (0..steps - 1)."""
    flat = np.unique(np.concatenate((obstacle * steps + step, other_obstacle * steps + other_step)))
    return flat // steps, flat % steps


class DualStatus(Enum):
    """Why there is no control for a working set: its rows contradict each other, or the solver failed."""

    CONTRADICTION = 'contradiction'
    UNSOLVED = 'unsolved'


Failed: TypeAlias = Literal[DualStatus.CONTRADICTION, DualStatus.UNSOLVED]


def solve_with_rows(cost: Cost, rows: Array, limits: Array) -> Array | Failed:
    """Return the control (2N,) of the least cost with rows (k, 2N) u >= limits (k,)."""
    inverse, _, factor = cost.factors
    space = range_space(rows, inverse, factor, limits, cost.goal_control, 0.0)
    pressing = multipliers_of(*space[1:], elastic=False)
    return pressing if isinstance(pressing, DualStatus) else apply_multipliers(pressing, space[0], cost.goal_control)


def multipliers_of(gram: Array, missing: Array, unit: Array, stuck: float, *, elastic: bool) -> Array | Failed:
    """Return the multipliers y (k,) >= 0 of least 1/2 y'Ky - m'y, given as of `range_space`."""
    if stuck > TOLERANCE and not elastic:
        return DualStatus.CONTRADICTION
    answer = solve_piqp(DenseQP(gram.T, -missing, lower=np.zeros(len(missing))))
    if not answer.solved:
        # Farkas: a combination y >= 0 of the rows that moves nothing and yet is missing something
        ray = answer.x / max(float(answer.x.max()), 1e-300)
        return DualStatus.CONTRADICTION if np.abs(gram @ ray).max() < FARKAS * float(missing @ ray) else DualStatus.UNSOLVED
    multipliers, largest, short, slack = refine_multipliers(gram, missing, unit, answer.x)
    if short > RESIDUAL * (largest if elastic else 1.0) or slack > RESIDUAL * largest**2:
        return DualStatus.UNSOLVED
    return multipliers


@compiled
def range_space(
    rows: Matrix, inverse: Vector, factor: Matrix, limits: Vector, goal_control: Vector, softness: float
) -> tuple[Matrix, Matrix, Vector, Vector, float]:
    """Return what the rows' multipliers do, in units in which each row moves itself by one, and the most that is missing is one.

    M P (k, 2N); K (k, k), softness added to its diagonal; what the goal's control misses (k,); the unit of each multiplier (k,);
    and the most that is missing in a row which the goal alone decides [m]: such a row has no part in the rest.
    """
    pressed, gram = schur_complement(rows, inverse, factor)
    k, stuck = len(limits), -np.inf
    scaled, scale = limits - multiply_vector(rows, goal_control), np.ones(k)
    for i in range(k):
        wanted = 0.0
        for u in range(rows.shape[1]):
            wanted += rows[i, u] * rows[i, u] * inverse[u]
        if gram[i, i] < IMMOVABLE * wanted:
            stuck = max(stuck, scaled[i])
            gram[i], gram[:, i], scaled[i] = 0.0, 0.0, 0.0
            gram[i, i] = 1.0
    for i in range(k):
        scale[i] = 1.0 / np.sqrt(gram[i, i])
        scaled[i] *= scale[i]
    for i in range(k):
        for j in range(k):
            gram[i, j] *= scale[i] * scale[j]
        gram[i, i] += softness
    size = max(np.abs(scaled).max(), 1e-300)
    return pressed, gram, scaled / size, scale * size, stuck


@compiled
def reduce_to_range_space(
    responses: Tensor,
    further: Tensor,
    weights: Matrix,
    coefficients: Tensor,
    limits: Matrix,
    obstacle: Indices,
    step: Indices,
    inverse: Vector,
    factor: Matrix,
    goal_control: Vector,
    softness: float,
) -> tuple[Matrix, Matrix, Vector, Vector, float]:
    """Return the `range_space` of the rows of k pairs of obstacle and step."""
    wanted = np.empty(len(step))
    for i in range(len(step)):
        wanted[i] = limits[obstacle[i], step[i]]
    rows = collect_rows(responses, further, weights, coefficients, obstacle, step)
    return range_space(rows, inverse, factor, wanted, goal_control, softness)


@compiled
def refine_multipliers(gram: Matrix, missing: Vector, unit: Vector, answer: Vector) -> tuple[Vector, float, float, float]:
    """Sharpen an interior-point answer: solve for the multipliers that are not zero, if that keeps their signs.

    Returns them (k,) without their units, the largest in its unit, but at least 1, the most that a row misses, and the largest
    product of a multiplier and what its row has to spare.
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
    sharp = solve_lower_transposed(factor, solve_lower(factor, wanted)[:, 0].copy())
    off = 0.0  # infinite where a sign is lost, or the rows are not independent: then the answer stays as it is
    for i in range(n):
        left = -wanted[i, 0]
        for j in range(n):
            left += inner[i, j] * sharp[j]
        off = max(off, abs(left)) if sharp[i] > 0 else np.inf
    if off < SHARP:
        for i in range(n):
            multipliers[active[i]] = sharp[i]
    short, slack = 0.0, 0.0
    for i in range(len(answer)):
        left = -missing[i]
        for j in range(len(answer)):
            left += gram[i, j] * multipliers[j]
        short, slack = max(short, -left), max(slack, abs(left * multipliers[i]))
    return multipliers * unit, max(multipliers.max(), 1.0), short, slack


@compiled
def apply_multipliers(multipliers: Vector, pressed: Matrix, goal_control: Vector) -> Vector:
    """Return the control (2N,) that multipliers (k,) of rows make of the goal's: u_goal + P M'y, for M P (k, 2N)."""
    control: Vector = goal_control + multiply(np.expand_dims(multipliers, 0), pressed)[0]
    return control


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
    scaled = solve_piqp(dense, attempts=1) if backend == 'piqp' else solve_named(dense, backend)
    if not scaled.solved:
        return None
    control = unit * scaled.x
    active = WorkingSet(*np.nonzero(qp.row_values(control) - qp.limits < 1e-7))
    return QPSolution(control, active, np.full(len(active), np.nan), 1)
