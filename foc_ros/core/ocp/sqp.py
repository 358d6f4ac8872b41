"""Sequential quadratic programming: linearise at a guess, solve, linearise at the solution, until it stays.

Every half-plane lies outside its obstacle, wherever it is linearised, so that every solution is feasible. Between QPs a few
Newton steps on the contacts jump to where the sequence would creep, if that lowers the cost too; where they fail, the next
linearisation is extrapolated further and further.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TypeAlias

import numpy as np

from foc_ros.core.deadline import NEVER, Deadline, OutOfTimeError
from foc_ros.core.kernels import freeze
from foc_ros.core.types import Array

from .contacts.contacts import Contacts
from .contacts.kkt_point import STAYS, KktPoint, solve_at_fixed_times
from .problem import Problem
from .qp import NO_TIMES, Cost, clearance_qp, effort_cost
from .working_set import WorkingSet, solve

NEAR = 0.01
"""Largest move of the mean, relative to the scene, from which Newton steps are tried although the active rows changed."""
MAX_QPS = 60
"""Linearisations after which the sequence counts as unsettled."""
ALIGNED = 0.99
"""Cosine between two consecutive moves that counts as the same direction."""
PATIENCE = 6
"""Moves in the same direction before the sequence is extrapolated."""
LARGEST_STRETCH = 15.0
"""Most moves by which the next linearisation is extrapolated."""


class StoppedError(OutOfTimeError):
    """The deadline stopped a sequence at the control (2N,) and the contacts of its last QP, from which it may continue."""

    def __init__(self, control: Array, contacts: Contacts) -> None:
        super().__init__()
        self.control, self.contacts = control, contacts


Jump: TypeAlias = Callable[[Array, Contacts], KktPoint | None]


@dataclass(frozen=True)
class SqpOptions:
    """How the sequence proceeds.

    verified: end by a QP that stays, not by Newton steps; between (e,): further times at which rows hold, as in `clearance_qp`;
    max_qps: linearisations, at least 1; thorough: as in `working_set.solve`; jump: function that is tried at the solution of each
    QP, with its control and contacts, and whose result ends the sequence.
    """

    verified: bool = True
    between: Array = field(default_factory=lambda: NO_TIMES)
    max_qps: int = MAX_QPS
    thorough: bool = True
    jump: Jump | None = None


@dataclass(frozen=True, eq=False)
class SqpResult:
    """How a sequence of QPs ended.

    control (2N,), its positions (N, 2) at steps 1..N, its active rows and contacts; qp_solves: QPs solved, each round of a
    working set counted; linearisations: how many there were; stays: whether the last one returned its own control; jumped: the
    result of the jump, if that ended the sequence.
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
    options: SqpOptions = SqpOptions(),
) -> SqpResult | None:
    """Solve the reformulated problem at (tau, lambda) by sequential QPs.

    Parameters
    ----------
    problem
        The problem.
    guess
        Positions (N, 2) at steps 1..N to linearise at first [m].
    working
        Rows to begin with.
    tau, lam
        Clearance term [m^2] and weight of the variances [1/s^6].
    deadline
        Checked before each QP and each jump.
    options
        How the sequence proceeds.

    Returns
    -------
    SqpResult | None
        None where the rows of a QP contradict each other.

    Raises
    ------
    OutOfTimeError
        Past the deadline; a `StoppedError` after the first QP.
    """
    times = np.concatenate((np.arange(1.0, problem.horizon.steps + 1.0), options.between))
    cost = effort_cost(problem, lam)
    solves, creep = 0, _Creep()
    reached: tuple[Array, Contacts] | None = None
    previous: tuple[bytes, bytes] | None = None
    for count in range(1, options.max_qps + 1):
        qp = clearance_qp(problem, cost, guess, tau, between=options.between)
        try:
            solution = solve(qp, working, deadline, thorough=options.thorough)
        except OutOfTimeError:
            if reached is None:
                raise
            raise StoppedError(*reached) from None
        if solution is None:
            return None
        solves += solution.solves
        control, working = solution.control, solution.active
        positions = problem.positions(control)
        move = float(np.abs(positions - guess).max()) / problem.extent
        contacts = freeze(Contacts(working.obstacle, times[working.step], solution.multipliers))
        reached = control, contacts
        if move < STAYS or count == options.max_qps:
            return SqpResult(control, positions, working, contacts, solves, count, stays=move < STAYS)
        if options.jump is not None and not deadline.allows():
            raise StoppedError(control, contacts)
        point = options.jump(control, contacts) if options.jump is not None else None
        if point is not None:
            positions = problem.positions(point.control)
            return SqpResult(point.control, positions, working, point.contacts, solves, count, stays=True, jumped=point)
        rows = (working.obstacle.tobytes(), working.step.tobytes())
        better = None
        if len(working) and (rows == previous or move < NEAR):
            better = solve_at_fixed_times(problem, control, contacts, tau, lam)
        if better is not None and _quadratic_cost(cost, better[0]) <= _quadratic_cost(cost, control) * (1 + 1e-12):
            control, contacts = better
            positions = problem.positions(control)
            if not options.verified:
                return SqpResult(control, positions, working, contacts, solves, count, stays=True)
            guess = creep.restart(positions)
        else:
            guess = creep.extrapolate(positions)
        previous = rows
    raise AssertionError('max_qps is at least 1')


def _quadratic_cost(cost: Cost, control: Array) -> float:
    return float(control @ (cost.hessian * control))


class _Creep:
    """Extrapolates a sequence that creeps: after some moves in the same direction, by twice as much each time it goes on."""

    def __init__(self) -> None:
        self.last: Array | None = None
        self.direction: Array | None = None
        self.aligned = 0

    def extrapolate(self, positions: Array) -> Array:
        """Return where to linearise next: at the last solution, an array of any shape, or beyond it."""
        if self.last is None:
            self.last = positions
            return positions
        direction = positions - self.last
        is_aligned = self.direction is not None and _cosine(direction, self.direction) > ALIGNED
        self.aligned = self.aligned + 1 if is_aligned else 0
        self.last, self.direction = positions, direction
        return positions + min(2.0 ** max(self.aligned - PATIENCE, 0) - 1.0, LARGEST_STRETCH) * direction

    def restart(self, positions: Array) -> Array:
        """Return where to linearise next after a jump: at its result."""
        self.last, self.direction, self.aligned = positions, None, 0
        return positions


def _cosine(a: Array, b: Array) -> float:
    return float((a * b).sum() / max(np.linalg.norm(a) * np.linalg.norm(b), 1e-300))
