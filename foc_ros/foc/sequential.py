"""Sequential QPs: linearise at a guess, solve, linearise at the answer, until it stays.

Each QP cuts off more than the circles do, wherever it is linearised, so every answer is feasible. Between QPs a few Newton steps
on the rows that were active jump to where the sequence would creep, if that lowers the cost too; where they fail, the next
linearisation is taken further and further ahead. The sequence ends only by a QP that stays where it was linearised.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .deadline import NEVER, Deadline
from .problem import Problem
from .qp import Cost, clearance_qp, effort_cost, wanted_distance
from .records import Array
from .solver import QPSolution, WorkingSet, solve

STAYS = 1e-7
"""Largest move of the mean that counts as staying [m]."""
NEAR = 3e-3
"""Largest move of the mean from which Newton steps are tried even if the active rows changed [m]."""
MAX_QPS = 60
NEWTON_STEPS = 6
ALIGNED = 0.99
"""Cosine between two moves in a row that counts as the same direction."""
PATIENCE = 6
"""Moves in the same direction before the sequence is helped on."""
LARGEST_STRETCH = 15.0
"""Most moves that the next linearisation is taken ahead."""


@dataclass(frozen=True, eq=False)
class Converged:
    """A control that its own linearisation returns: stacked control (2N,), positions (N, 2) at steps 1..N, active rows."""

    control: Array
    positions: Array
    solution: QPSolution
    qp_solves: int
    stays: bool


def converge(
    problem: Problem, guess: Array, working: WorkingSet, tau: float, lam: float, deadline: Deadline = NEVER
) -> Converged | None:
    """Solve the reformulated problem at (tau, lambda) from a guess (N, 2); None where its rows contradict each other.

    Raises OutOfTimeError past the deadline.
    """
    cost = effort_cost(problem, lam)
    solves, creep = 0, _Creep()
    previous: tuple[bytes, bytes] | None = None
    for count in range(1, MAX_QPS + 1):
        deadline.check()
        solution = solve(clearance_qp(problem, cost, guess, tau), working)
        if solution is None:
            return None
        solves += solution.solves
        working, positions = solution.active, problem.positions(solution.control)
        move = float(np.abs(positions - guess).max())
        if move < STAYS or count == MAX_QPS:
            return Converged(solution.control, positions, solution, solves, stays=move < STAYS)
        rows = (working.obstacle.tobytes(), working.step.tobytes())
        better = None
        if len(working) and (rows == previous or move < NEAR):
            better = _newton(problem, positions, solution, tau, cost)
        guess = creep.ahead(positions) if better is None else creep.jumped(better)
        previous = rows
    raise AssertionError('MAX_QPS is at least 1')


class _Creep:
    """Steps ahead of a sequence that creeps: after some moves in the same direction, twice as far each time it goes on."""

    def __init__(self) -> None:
        self.last: Array | None = None
        self.direction: Array | None = None
        self.aligned = 0

    def ahead(self, positions: Array) -> Array:
        """Return where to linearise next: at the last answer (N, 2), or beyond it."""
        if self.last is None:
            self.last = positions
            return positions
        direction = positions - self.last
        aligned = self.direction is not None and _cosine(direction, self.direction) > ALIGNED
        self.aligned = self.aligned + 1 if aligned else 0
        self.last, self.direction = positions, direction
        return positions + min(2.0 ** max(self.aligned - PATIENCE, 0) - 1.0, LARGEST_STRETCH) * direction

    def jumped(self, positions: Array) -> Array:
        """Forget the creep: the sequence goes on from somewhere else."""
        self.last, self.direction, self.aligned = positions, None, 0
        return positions


def _cosine(a: Array, b: Array) -> float:
    return float((a * b).sum() / max(np.linalg.norm(a) * np.linalg.norm(b), 1e-300))


def _newton(problem: Problem, positions: Array, solution: QPSolution, tau: float, cost: Cost) -> Array | None:
    """Newton steps on the Karush-Kuhn-Tucker equations with the active rows held as touching their circles.

    Returns positions (N, 2), or None where the steps leave what they assume: multipliers positive, a minimum, all circles clear,
    cost not above that of `solution`.
    """
    bound = float(solution.control @ (cost.hessian * solution.control))
    multipliers, last = solution.multipliers, np.inf
    for _ in range(NEWTON_STEPS):
        step = _newton_step(problem, positions, solution.active, multipliers, tau, cost)
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
    return positions if clear and float(control @ (cost.hessian * control)) <= bound * (1 + 1e-12) else None


def _newton_step(
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
    told = np.abs(values) > 1e-11 * np.abs(values).max()
    if np.count_nonzero(values[told] < 0) != k:
        return None
    missing = scale * (targets - rows @ cost.goal_control)
    forces = scale * (vectors[:, told] @ ((vectors[:, told].T @ missing) / values[told]))
    return cost.goal_control + forces @ pressed, forces[:k]
