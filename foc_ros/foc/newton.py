"""Newton steps on the Karush-Kuhn-Tucker equations, with the active rows held as touching their circles.

Where sequential QPs would creep along a circle, these jump: they know its curvature. What they end at is a solution as much as
what the QPs end at: multipliers positive, a minimum, every circle clear, and so the solution of the QP linearised there.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .problem import Problem
from .qp import Cost, wanted_distance
from .records import Array
from .solver import WorkingSet, peaks

SETTLED = 3e-5
"""Largest move of the mean at which the steps end, relative to the scene: they converge quadratically, so 1e-9 is left."""
CLEAR = 3e-8
"""Depth in a circle that is rounding; relative."""
MAX_STEPS = 6


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
    for _ in range(changes + 1):
        found = _settled(problem, cost, near, active, multipliers, tau)
        if found is None:
            return None
        pressing = found.multipliers > 0
        if pressing.all():
            entered = _entered(problem, found, tau)
            if not len(entered):
                return found
            # a new row begins without curvature, so with hardly a multiplier
            slight = 1e-6 * float(found.multipliers.max(initial=1.0))
            active = WorkingSet(*(np.concatenate(pair) for pair in zip(found.active.rows, entered.rows, strict=True)))
            multipliers = np.concatenate((found.multipliers, np.full(len(entered), slight)))
        else:
            active, multipliers = found.active.only(pressing), found.multipliers[pressing]
    return None


def _entered(problem: Problem, found: Touching, tau: float) -> WorkingSet:
    """Return the rows, not yet active, at which a circle is entered deepest."""
    offset = found.positions[None] - problem.centres
    depth = wanted_distance(problem, tau) - np.hypot(offset[..., 0], offset[..., 1])
    depth[found.active.rows] = 0.0
    rounding = CLEAR * problem.extent
    return WorkingSet(*peaks(depth, rounding)) if depth.max(initial=0.0) > rounding else WorkingSet()


def _settled(
    problem: Problem, cost: Cost, positions: Array, active: WorkingSet, multipliers: Array, tau: float
) -> Touching | None:
    """Repeat the step until it moves little, or a multiplier turns negative; None where it leads to no minimum, or away."""
    last = np.inf
    for _ in range(MAX_STEPS):
        step = _step(problem, positions, active, multipliers, tau, cost)
        if step is None:
            return None
        control, multipliers = step
        moved = problem.positions(control)
        move, positions = float(np.abs(moved - positions).max()) / problem.extent, moved
        if move < SETTLED or multipliers.min(initial=1.0) <= 0:
            return Touching(control, positions, active, multipliers)
        if move > last:
            return None
        last = move
    return None


def _step(
    problem: Problem, positions: Array, active: WorkingSet, multipliers: Array, tau: float, cost: Cost
) -> tuple[Array, Array] | None:
    """One step: control (2N,) and multipliers (k,) of the active rows; None where it leads to no minimum.

    A multiplier y at distance d adds the circle's curvature, -y / d along the tangent, to the Hessian: a row of negative softness
    -d / y beside the normal's row. It is a minimum if there are as many negative eigenvalues as curvature rows.
    """
    k, here = len(active), active.rows
    if k == 0:
        return cost.goal_control, multipliers
    offset = positions[active.step] - problem.centres[here]
    distance = np.hypot(offset[:, 0], offset[:, 1])
    axes = np.empty((k, 2, 2))  # normal and tangent of each row
    axes[:, 0] = offset / distance[:, None]
    axes[:, 1, 0], axes[:, 1, 1] = -axes[:, 0, 1], axes[:, 0, 0]
    rows = (axes @ problem.horizon.response[active.step, :2]).reshape(2 * k, len(cost.hessian))
    wanted = wanted_distance(problem, tau)
    targets = (axes @ problem.centres_from_free[here][..., None]).reshape(2 * k)
    targets[::2] += wanted[active.obstacle, 0] if wanted.shape[1] == 1 else wanted[here]
    pressed = cost.pressed(rows)
    gram = pressed @ rows.T
    gram.flat[2 * k + 1 :: 4 * k + 2] -= distance / multipliers
    scale = 1.0 / np.sqrt(np.abs(gram.diagonal()))
    values, vectors = np.linalg.eigh(gram * scale[:, None] * scale)
    # rows that say the same twice leave an eigenvalue of zero: they share their multiplier
    told = np.abs(values) > 1e-11 * np.abs(values).max(initial=0.0)
    if np.count_nonzero(values[told] < 0) != k:
        return None
    missing = scale * (targets - rows @ cost.goal_control)
    forces = scale * (vectors[:, told] @ ((vectors[:, told].T @ missing) / values[told]))
    return cost.goal_control + forces @ pressed, forces[::2]
