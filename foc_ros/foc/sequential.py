"""Sequential QPs: linearise at a guess, solve, linearise at the answer, until it stays.

Each QP cuts off more than the circles do, so every answer is feasible and the cost never rises. Between QPs a few Newton steps
on the rows that were active jump to where the sequence would creep; they are kept only if they lower the cost too, and the
sequence ends only by a QP that stays where it was linearised.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .problem import Problem
from .qp import Cost, clearance_qp, effort_cost, half_planes, wanted_distance
from .records import Array
from .solver import QPSolution, WorkingSet, solve

STAYS = 1e-7
"""Largest move of the mean that counts as staying [m]."""
NEAR = 3e-3
"""Largest move of the mean from which Newton steps are tried even if the active rows changed [m]."""
MAX_QPS = 60
NEWTON_STEPS = 6


@dataclass(frozen=True, eq=False)
class Converged:
    """A control that its own linearisation returns: stacked control (2N,), positions (N, 2) at steps 1..N, active rows."""

    control: Array
    positions: Array
    solution: QPSolution
    qp_solves: int
    stays: bool


def converge(problem: Problem, guess: Array, working: WorkingSet, tau: float, lam: float) -> Converged | None:
    """Solve the reformulated problem at (tau, lambda) from a guess (N, 2); None where its rows contradict each other."""
    cost = effort_cost(problem, lam)
    solves, previous = 0, None
    for _ in range(MAX_QPS):
        solution = solve(clearance_qp(problem, cost, guess, tau), working)
        if solution is None:
            return None
        solves += solution.solves
        working, positions = solution.active, problem.positions(solution.control)
        move = float(np.abs(positions - guess).max())
        if move < STAYS:
            return Converged(solution.control, positions, solution, solves, stays=True)
        rows = (working.obstacle.tobytes(), working.step.tobytes())
        guess = positions
        if len(working) and (rows == previous or move < NEAR):
            better = _newton(problem, positions, solution, tau, cost)
            guess = positions if better is None else better
        previous = rows
    return Converged(solution.control, positions, solution, solves, stays=False)


def _newton(problem: Problem, positions: Array, solution: QPSolution, tau: float, cost: Cost) -> Array | None:
    """Newton steps on the Karush-Kuhn-Tucker equations with the active rows held as touching their circles.

    A multiplier y at distance d adds the circle's curvature, -y / d along the tangent, to the Hessian: a goal row of negative
    softness -d / y. Returns positions (N, 2), or None where the steps leave what they assume: multipliers positive, a minimum
    (as many negative eigenvalues as curvature rows), all circles clear, cost not above that of `solution`.
    """
    weights, bound = cost.hessian, float(solution.control @ (cost.hessian * solution.control))
    multipliers, last = solution.multipliers, np.inf
    for _ in range(NEWTON_STEPS):
        step = _newton_step(problem, positions, solution.active, multipliers, tau, weights)
        if step is None:
            return None
        control, multipliers = step
        moved = problem.positions(control)
        move, positions = float(np.abs(moved - positions).max()), moved
        if move > last or multipliers.min() <= 0:
            return None
        last = move
        if move < 0.01 * STAYS:
            break
    offset = positions[None] - problem.centres
    clear = (np.hypot(offset[..., 0], offset[..., 1]) - wanted_distance(problem, tau)).min() > -0.1 * STAYS
    return positions if clear and float(control @ (weights * control)) <= bound * (1 + 1e-12) else None


def _newton_step(
    problem: Problem, positions: Array, active: WorkingSet, multipliers: Array, tau: float, weights: Array
) -> tuple[Array, Array] | None:
    """One step: control (2N,) and multipliers (k,) of the active rows; None where it leads to no minimum."""
    normals, limits = half_planes(problem, positions, tau)
    normal = normals[active.obstacle, active.step]
    tangent = np.stack((-normal[:, 1], normal[:, 0]), axis=1)
    offset = positions[active.step] - problem.centres[active.obstacle, active.step]
    maps, free = problem.position_map[:, active.step], problem.free[1:][active.step, :2]
    goal_rows, goal_targets, softness = problem.goal_rows
    rows = np.concatenate((goal_rows, *(np.einsum('ki,iku->ku', axis, maps) for axis in (normal, tangent))))
    targets = np.concatenate(
        (
            goal_targets,
            limits[active.obstacle, active.step],
            np.einsum('ki,ki->k', tangent, positions[active.step] - free),
        )
    )
    k = len(active)
    soft = np.concatenate((softness, np.zeros(k), -np.hypot(offset[:, 0], offset[:, 1]) / multipliers))
    weighted = rows / weights
    gram = weighted @ rows.T
    scale = 1.0 / np.sqrt(np.diag(gram))
    values, vectors = np.linalg.eigh(gram * scale[:, None] * scale[None, :] + np.diag(soft * scale**2))
    if np.count_nonzero(values < 0) != k:
        return None
    forces = scale * (vectors @ ((vectors.T @ (scale * targets)) / values))
    return forces @ weighted, forces[len(goal_rows) : len(goal_rows) + k]
