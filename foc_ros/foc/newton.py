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
from .solver import WorkingSet

EXACT = 1e-9
"""Largest move of the mean at which the steps end [m]."""
MAX_STEPS = 6


@dataclass(frozen=True, eq=False)
class Touching:
    """A solution with the given rows active: control (2N,), positions (N, 2) at steps 1..N, multipliers (k,) > 0."""

    control: Array
    positions: Array
    multipliers: Array


def newton(problem: Problem, cost: Cost, positions: Array, active: WorkingSet, multipliers: Array, tau: float) -> Touching | None:
    """Find the solution near positions (N, 2) with these rows active; None where the steps leave what they assume."""
    last = np.inf
    for _ in range(MAX_STEPS):
        step = _step(problem, positions, active, multipliers, tau, cost)
        if step is None:
            return None
        control, multipliers = step
        moved = problem.positions(control)
        move, positions = float(np.abs(moved - positions).max()), moved
        if move > last or multipliers.min(initial=1.0) <= 0:
            return None
        last = move
        if move < EXACT:
            break
    offset = positions[None] - problem.centres
    clear = (np.hypot(offset[..., 0], offset[..., 1]) - wanted_distance(problem, tau)).min(initial=0.0) > -10 * EXACT
    return Touching(control, positions, multipliers) if clear and last < 100 * EXACT else None


def _step(
    problem: Problem, positions: Array, active: WorkingSet, multipliers: Array, tau: float, cost: Cost
) -> tuple[Array, Array] | None:
    """One step: control (2N,) and multipliers (k,) of the active rows; None where it leads to no minimum.

    A multiplier y at distance d adds the circle's curvature, -y / d along the tangent, to the Hessian: a row of negative softness
    -d / y beside the normal's row. It is a minimum if there are as many negative eigenvalues as curvature rows.
    """
    k, steps = len(active), active.step
    offset = positions[steps] - problem.centres[active.obstacle, steps]
    distance = np.hypot(offset[:, 0], offset[:, 1])
    normal = offset / distance[:, None]
    axes = np.concatenate((normal, np.stack((-normal[:, 1], normal[:, 0]), axis=1)))
    both = np.concatenate((steps, steps))
    rows = axes[:, 0, None] * problem.position_map[0, both] + axes[:, 1, None] * problem.position_map[1, both]
    wanted = np.broadcast_to(wanted_distance(problem, tau), problem.centres.shape[:2])[active.obstacle, steps]
    aim = np.concatenate((problem.centres_from_free[active.obstacle, steps], positions[steps] - problem.free[1:][steps, :2]))
    targets = np.einsum('ki,ki->k', axes, aim)
    targets[:k] += wanted
    pressed = cost.pressed(rows)
    gram = pressed @ rows.T
    gram.flat[k * (2 * k + 1) :: 2 * k + 1] -= distance / multipliers
    scale = 1.0 / np.sqrt(np.abs(gram.diagonal()))
    values, vectors = np.linalg.eigh(gram * scale[:, None] * scale)
    # rows that say the same twice leave an eigenvalue of zero: they share their multiplier
    told = np.abs(values) > 1e-11 * np.abs(values).max(initial=0.0)
    if np.count_nonzero(values[told] < 0) != k:
        return None
    missing = scale * (targets - rows @ cost.goal_control)
    forces = scale * (vectors[:, told] @ ((vectors[:, told].T @ missing) / values[told]))
    return cost.goal_control + forces @ pressed, forces[:k]
