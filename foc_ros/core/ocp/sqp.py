"""Sequential QPs: linearise at a guess, solve, linearise at the answer, until it stays.

Each QP cuts off more than the circles do, wherever it is linearised, so every answer is feasible. Between QPs a few Newton steps
jump to where the sequence would creep, if that lowers the cost too; where they fail, the next linearisation is taken further and
further ahead.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from foc_ros.core.deadline import NEVER, Deadline
from foc_ros.core.types import Array

from .contacts.checks import STAYS, newton_at_fixed_times
from .contacts.contacts import Contacts
from .contacts.kkt_point import KktPoint
from .problem import Problem
from .qp import NO_TIMES, Cost, clearance_qp, effort_cost
from .working_set import WorkingSet, solve

NEAR = 0.01
"""Largest move of the mean from which Newton steps are tried even if the active rows changed; relative."""
MAX_QPS = 60
"""Linearisations after which it counts as unsettled."""
ALIGNED = 0.99
"""Cosine between two moves in a row that counts as the same direction."""
PATIENCE = 6
"""Moves in the same direction before the sequence is helped on."""
LARGEST_STRETCH = 15.0
"""Most moves that the next linearisation is taken ahead."""


Jump: TypeAlias = Callable[[Array, Contacts], KktPoint | None]


@dataclass(frozen=True, eq=False)
class Converged:
    """A control that its own linearisation returns: stacked control (2N,), positions (N, 2) at steps 1..N, active rows.

    qp_solves: QPs solved, rounds of the working set counted each; linearisations: how many there were; stays: whether it settled;
    jumped: what `converge`'s jump found, if that ended it.
    """

    control: Array
    positions: Array
    active: WorkingSet
    contacts: Contacts
    qp_solves: int
    linearisations: int
    stays: bool
    jumped: KktPoint | None = None


def converge(
    problem: Problem,
    guess: Array,
    working: WorkingSet,
    tau: float,
    lam: float,
    deadline: Deadline = NEVER,
    *,
    verified: bool = True,
    between: Array = NO_TIMES,
    most: int = MAX_QPS,
    thorough: bool = True,
    jump: Jump | None = None,
) -> Converged | None:
    """Solve the reformulated problem at (tau, lambda) from a guess (N, 2); None where its rows contradict each other.

    verified: end by a QP that stays, not by Newton steps. between (e,): `clearance_qp`. most: linearisations, at least 1;
    thorough: `solve`. jump: tried at the solution of each QP, its control and contacts; what it finds ends the sequence. Raises
    OutOfTimeError past the deadline.
    """
    times = np.concatenate((np.arange(1.0, problem.horizon.steps + 1.0), between))
    cost = effort_cost(problem, lam)
    solves, creep = 0, _Creep()
    previous: tuple[bytes, bytes] | None = None
    for count in range(1, most + 1):
        deadline.check()
        solution = solve(clearance_qp(problem, cost, guess, tau, between=between), working, thorough=thorough)
        if solution is None:
            return None
        solves += solution.solves
        working, positions = solution.active, problem.positions(solution.control)
        move = float(np.abs(positions - guess).max()) / problem.extent
        contacts = Contacts(working.obstacle, times[working.step], solution.multipliers)
        if move < STAYS or count == most:
            return Converged(solution.control, positions, working, contacts, solves, count, stays=move < STAYS)
        found = jump(solution.control, contacts) if jump is not None else None
        if found is not None:
            positions = problem.positions(found.control)
            return Converged(found.control, positions, working, found.contacts, solves, count, stays=True, jumped=found)
        rows = (working.obstacle.tobytes(), working.step.tobytes())
        better = None
        if len(working) and (rows == previous or move < NEAR):
            better = newton_at_fixed_times(problem, cost, solution.control, contacts, tau)
        if better is not None and _cost(cost, better[0]) <= _cost(cost, solution.control) * (1 + 1e-12):
            control, contacts = better
            positions = problem.positions(control)
            if not verified:
                return Converged(control, positions, working, contacts, solves, count, stays=True)
            guess = creep.jumped(positions)
        else:
            guess = creep.ahead(positions)
        previous = rows
    raise AssertionError('most is at least 1')


def _cost(cost: Cost, control: Array) -> float:
    return float(control @ (cost.hessian * control))


class _Creep:
    """Steps ahead of a sequence that creeps: after some moves in the same direction, twice as far each time it goes on."""

    def __init__(self) -> None:
        self.last: Array | None = None
        self.direction: Array | None = None
        self.aligned = 0

    def ahead(self, positions: Array) -> Array:
        """Return where to linearise next: at the last answer, an array of any shape, or beyond it."""
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
