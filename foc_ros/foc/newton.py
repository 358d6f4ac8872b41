"""Newton steps on the Karush-Kuhn-Tucker equations, with the active rows held as touching their circles.

Where sequential QPs would creep along a circle, these jump: they know its curvature. What they end at is a solution as much as
what the QPs end at: multipliers positive, a minimum, every circle clear, and so the solution of the QP linearised there.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .compiled import Indices, Matrix, Tensor, Vector, compiled
from .dense import cholesky, combined, lower_solved, upper_solved
from .problem import Problem, moved
from .qp import Cost, compliance, depths, wanted_distance
from .records import Array
from .solver import Row, WorkingSet, forces_of, peaks, rows_of

SETTLED = 1e-5
"""Largest move of a contact at which the steps end, relative to the scene: they converge quadratically, so 1e-9 is left."""
CLEAR = 3e-8
"""Depth in a circle that is rounding; relative."""
MAX_STEPS = 8
WAVERING = 2.0
"""Growth of the moves from one step to the next at which they are given up."""
SLIGHT = 1e-3
"""Least force of a contact that bends the way round its circle, relative to the largest: a negative one would not hold."""
SHARED = 1e-13
"""Softness of a contact relative to what it moves itself: contacts that say the same twice share the force."""


@dataclass(frozen=True, eq=False)
class Touching:
    """Where the given rows touch: control (2N,), positions (N, 2) at steps 1..N, active rows, their multipliers (k,)."""

    control: Array
    positions: Array
    active: WorkingSet
    multipliers: Array


def newton(
    problem: Problem, cost: Cost, near: Array, active: WorkingSet, multipliers: Array, tau: float, changes: int = 0
) -> Touching | None:
    """Find the solution near positions (N, 2); None where the steps leave what they assume.

    active, multipliers (k,): rows to begin with. changes: how often rows whose multiplier turns negative may be let go, or rows
    whose circle is entered taken in.
    """
    near, multipliers = np.ascontiguousarray(near, dtype=float), np.ascontiguousarray(multipliers, dtype=float)
    wanted, let_go = wanted_distance(problem, tau), set[Row]()
    for _ in range(changes + 1):
        found = _settled(problem, cost, near, active, multipliers, wanted)
        if found is None:
            beside = _straddling(active, multipliers, depths(near, problem.centres, wanted), let_go)
            if beside is None:
                return None
            active, multipliers = beside
            continue
        pressing = found.multipliers > 0
        if pressing.all():
            entered = _entered(problem, found, wanted)
            if not len(entered):
                return found
            # a new row begins without curvature, so with hardly a multiplier
            slight = 1e-6 * float(found.multipliers.max(initial=1.0))
            active = WorkingSet(*(np.concatenate(pair) for pair in zip(found.active.rows, entered.rows, strict=True)))
            multipliers = np.concatenate((found.multipliers, np.full(len(entered), slight)))
        else:
            active, multipliers = _rolled(found, let_go, problem.horizon.steps)
    return None


def _rolled(found: Touching, let_go: set[Row], steps: int) -> tuple[WorkingSet, Array]:
    """Let go rows whose multiplier is negative; where one of two neighbours lets go, the contact rolls on to the step after.

    The two share what the one that stays had: alone it would seldom hold, since the mean cuts the corner between two steps. A
    row that was let go, and is added to let_go, never comes back.
    """
    given = forces_of(found.active, found.multipliers)
    let_go |= {row for row, value in given.items() if value <= 0}
    kept = {row: value for row, value in given.items() if row not in let_go}
    for obstacle, step in sorted(let_go & given.keys()):
        for ahead in (1, -1):
            stays, after = (obstacle, step + ahead), (obstacle, step + 2 * ahead)
            if stays in kept and after not in kept and after not in let_go and 0 <= after[1] < steps:
                kept[stays] = kept[after] = kept[stays] / 2
    return rows_of(kept)


def _straddling(active: WorkingSet, multipliers: Array, depth: Array, let_go: set[Row]) -> tuple[WorkingSet, Array] | None:
    """Let contacts at a single step share their force with the neighbour that is nearer to the circle; None where there is none.

    What cannot hold at one step holds at two, with the circle bulging between them. depth (m, N): how far circles are entered.
    """
    given = forces_of(active, multipliers)
    kept = dict(given)
    for obstacle, step in given:
        beside = [(obstacle, step + ahead) for ahead in (-1, 1) if 0 <= step + ahead < depth.shape[1]]
        if given.keys().isdisjoint(beside) and (free := [row for row in beside if row not in let_go]):
            nearer = max(free, key=lambda row: depth[row])
            kept[obstacle, step] = kept[nearer] = given[obstacle, step] / 2
    return rows_of(kept) if kept.keys() != given.keys() else None


def _entered(problem: Problem, found: Touching, wanted: Array) -> WorkingSet:
    """Return the rows, not yet active, at which a circle is entered deepest."""
    depth = depths(found.positions, problem.centres, wanted)
    return WorkingSet(*peaks(depth, *found.active.rows, CLEAR * problem.extent))


def _settled(
    problem: Problem, cost: Cost, positions: Array, active: WorkingSet, multipliers: Array, wanted: Array
) -> Touching | None:
    """Repeat the step until it moves little; None where it leads to no minimum, or away."""
    if not len(active):
        return Touching(cost.goal_control, problem.positions(cost.goal_control), active, multipliers)
    inverse, _, factor = cost.factors
    found, control, positions, multipliers = touching(
        problem.horizon.position,
        problem.free_position,
        inverse,
        factor,
        cost.goal_control,
        problem.centres,
        wanted,
        active.obstacle,
        active.step,
        positions,
        multipliers,
        SETTLED * problem.extent,
    )
    return Touching(control, positions, active, multipliers) if found else None


@compiled
def _between(give: Matrix, axes: Tensor, one: int, other: int) -> Matrix:
    """Return how far contacts move along one of their axes under a force along another of each, (k, k)."""
    k = axes.shape[1]
    moved = np.empty((k, k))
    for i in range(k):
        for j in range(k):
            total = 0.0
            for a in range(2):
                for b in range(2):
                    total += axes[one, i, a] * give[2 * i + a, 2 * j + b] * axes[other, j, b]
            moved[i, j] = total
    return moved


@compiled
def _pushed(
    give: Matrix,
    rest: Matrix,
    centres: Tensor,
    wanted: Matrix,
    obstacle: Indices,
    step: Indices,
    at: Matrix,
    multipliers: Vector,
) -> tuple[bool, Matrix, Vector]:
    """One step of `touching` from contacts at (k, 2): whether it has an answer, forces (1, 2k) in x and y in turn, y (k,)."""
    k = len(step)
    axes, distance = np.empty((2, k, 2)), np.empty(k)  # normals, then tangents
    missing_along, missing_across = np.empty((k, 1)), np.empty(k)
    for i in range(k):
        j, t = obstacle[i], step[i]
        x, y = at[i, 0] - centres[j, t, 0], at[i, 1] - centres[j, t, 1]
        distance[i] = np.hypot(x, y)
        x, y = x / distance[i], y / distance[i]
        axes[0, i, 0], axes[0, i, 1], axes[1, i, 0], axes[1, i, 1] = x, y, -y, x
        away_x, away_y = centres[j, t, 0] - rest[t, 0], centres[j, t, 1] - rest[t, 1]
        missing_along[i, 0] = x * away_x + y * away_y + wanted[j, t if wanted.shape[1] > 1 else 0]
        missing_across[i] = x * away_y - y * away_x
    A, B, D = _between(give, axes, 0, 0), _between(give, axes, 0, 1), _between(give, axes, 1, 1)
    unit = np.empty(k)
    for i in range(k):
        unit[i] = 1.0 / np.sqrt(A[i, i])
    for i in range(k):
        for j in range(k):
            A[i, j] *= unit[i] * unit[j]
        A[i, i] += SHARED
        missing_along[i] *= unit[i]
        B[i] *= unit[i]
    normal = cholesky(A, 0.0)
    eased, along = lower_solved(normal, B), lower_solved(normal, missing_along)[:, 0].copy()
    stiffness, pull = np.empty((k, k)), np.empty((k, 1))
    for i in range(k):
        pull[i, 0] = -missing_across[i]
        for q in range(k):
            pull[i, 0] += eased[q, i] * along[q]
        for j in range(k):
            stiffness[i, j] = -D[i, j]
            for q in range(k):
                stiffness[i, j] += eased[q, i] * eased[q, j]
        stiffness[i, i] += distance[i] / multipliers[i]
    for i in range(k):
        unit_tangent = np.sqrt(multipliers[i] / distance[i])
        pull[i] *= unit_tangent
        for j in range(k):
            stiffness[i, j] *= unit_tangent * np.sqrt(multipliers[j] / distance[j])
    tangent = cholesky(stiffness, 0.0)
    across = upper_solved(tangent, lower_solved(tangent, pull)[:, 0].copy())
    for i in range(k):
        across[i] *= np.sqrt(multipliers[i] / distance[i])
        for q in range(k):
            along[q] -= eased[q, i] * across[i]
    along = upper_solved(normal, along)
    forces = np.empty((1, 2 * k))
    for i in range(k):
        along[i] *= unit[i]
        for axis in range(2):
            forces[0, 2 * i + axis] = axes[0, i, axis] * along[i] + axes[1, i, axis] * across[i]
    return bool(np.isfinite(forces).all()), forces, along


@compiled
def touching(
    position: Tensor,
    free: Matrix,
    inverse: Vector,
    factor: Matrix,
    goal_control: Vector,
    centres: Tensor,
    wanted: Matrix,
    obstacle: Indices,
    step: Indices,
    near: Matrix,
    multipliers: Vector,
    settled: float,
) -> tuple[bool, Vector, Matrix, Vector]:
    """Press the mean against circles until it touches them at the given pairs of obstacle and step.

    The mean gives way like a beam: forces F at the contacts move them by C F, C = S P S' at their steps. A contact at distance d
    with force y along its normal n turns by f d / y under a force f along its tangent t, so with A = n'Cn, B = n'Ct, D = t'Ct
        A y + B f = n.(o - rest) + d_wanted,    B' y + (D - d / y_last) f = t.(o - rest).
    That is a minimum if d / y_last - D + B' A^-1 B > 0: pressed any harder, the mean would slip round the circle.

    free (N, 2): the mean without control; goal_control (2N,): the control without contacts; near (N, 2), multipliers (k,): where
    to begin; settled [m]: a move of the contacts that ends the steps. Returns whether there is such a minimum, the control, the
    mean (N, 2) and y (k,).
    """
    k = len(step)
    rows = np.empty((2 * k, len(inverse)))
    for i in range(k):
        rows[2 * i], rows[2 * i + 1] = position[0, step[i]], position[1, step[i]]
    pressed, give = compliance(rows, inverse, factor)
    rest = moved(position, goal_control, free)
    at, forces, pressing, last = np.empty((k, 2)), np.zeros((1, 2 * k)), multipliers.copy(), np.inf
    for i in range(k):
        at[i] = near[step[i]]
    for _ in range(MAX_STEPS):
        pressed_at_least = np.maximum(pressing, SLIGHT * pressing.max())
        found, forces, pressing = _pushed(give, rest, centres, wanted, obstacle, step, at, pressed_at_least)
        if not found:
            break
        move = 0.0
        for i in range(k):
            for axis in range(2):
                place = rest[step[i], axis]
                for j in range(2 * k):
                    place += give[2 * i + axis, j] * forces[0, j]
                move = max(move, abs(place - at[i, axis]))
                at[i, axis] = place
        if move < settled:
            for i in range(k):  # round to the other side of a circle is another way
                x, y = centres[obstacle[i], step[i], 0], centres[obstacle[i], step[i], 1]
                if (at[i, 0] - x) * (near[step[i], 0] - x) + (at[i, 1] - y) * (near[step[i], 1] - y) < 0:
                    return False, goal_control.copy(), rest, pressing
            control = goal_control + combined(forces, pressed)[0]
            return True, control, moved(position, control, free), pressing
        if move > WAVERING * last:
            break
        last = move
    return False, goal_control.copy(), rest, pressing
