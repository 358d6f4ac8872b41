"""Strategies: a problem and a start enter; a control that trades effort against risk leaves. There is one file for each strategy.

May import everything in `foc_ros.core.ocp`. A strategy from outside the package is registered by name, and then used like the
built-in ones: ``foc_ros.core.registry.STRATEGIES.register('mine', solve_mine)``, with `FocConfig(strategy='mine')`.
"""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass
from typing import Protocol

from foc_ros.core.config import FocConfig
from foc_ros.core.deadline import NEVER, Deadline, OutOfTimeError
from foc_ros.core.ocp.contacts.contacts import NO_CONTACTS, Contacts
from foc_ros.core.ocp.minimum_safety_factor import MinimumSafetyFactor
from foc_ros.core.ocp.problem import Problem
from foc_ros.core.ocp.qp import clearance_qp, effort_cost
from foc_ros.core.ocp.sqp import StoppedError
from foc_ros.core.ocp.warm_start import Start
from foc_ros.core.ocp.working_set import WorkingSet, solve
from foc_ros.core.types import Array, Status


@dataclass(frozen=True, eq=False)
class StrategyResult:
    """How a strategy ended.

    Parameters
    ----------
    status, message
        The outcome, in words and numbers.
    control
        The stacked control, (2N,) [m/s^3 for the triple integrator].
    contacts
        Where obstacles hold the mean off, with multipliers.
    tau, lam
        Clearance term [m^2] and weight of the variances lambda [1/s^6] that the control belongs to.
    qp_solves, iterations
        QPs solved; iterations of a loop that the strategy counts besides, None if there is none.
    safety_factor_slope
        dk/ds on the penalty path at the control, 0 where not known.
    minimum
        The minimum safety factor over all times, for a strategy that keeps clear between the steps too. None: it is evaluated at
        the steps.
    equivalent_weights
        (tau, lambda) of each contact, None if these are tau and lam for all.
    aims_at_eta
        Whether a control with less than the wanted eta is no solution.
    is_complete
        Whether larger safety factors were looked for.
    """

    status: Status
    message: str
    control: Array
    contacts: Contacts = NO_CONTACTS
    tau: float = 0.0
    lam: float = 0.0
    qp_solves: int = 0
    iterations: int | None = None
    safety_factor_slope: float = 0.0
    minimum: MinimumSafetyFactor | None = None
    equivalent_weights: list[tuple[float, float]] | None = None
    aims_at_eta: bool = True
    is_complete: bool = True


class Strategy(Protocol):
    """A function that solves a problem from a start.

    It checks the deadline before each QP, and may let OutOfTimeError pass. For a problem that has no solution it raises nothing,
    but returns the best that it found (`find_best_effort`) with a status.
    """

    def __call__(self, problem: Problem, start: Start, settings: FocConfig, deadline: Deadline, /) -> StrategyResult:
        """Return the result for a problem, from a start, with the parameters of the settings."""


def find_best_effort(
    problem: Problem, start: Start, tau: float = 0.0, lam: float = 0.0, qp_solves: int = 0, deadline: Deadline = NEVER
) -> StrategyResult:
    """Let rows that contradict each other at the start share the violation: what the hand can do where no control meets them all.

    qp_solves: QPs that were solved before. Where the deadline leaves no time for that, the path ignores the obstacles.
    """
    cost, contacts, shown = effort_cost(problem, lam), NO_CONTACTS, 'ignores them'
    control = cost.goal_solution.control
    with suppress(OutOfTimeError):
        elastic = solve(clearance_qp(problem, cost, start.positions, tau), WorkingSet(), deadline, elastic=True)
        if elastic is not None:
            control, contacts = elastic.control, Contacts.at_steps(elastic.active, elastic.multipliers)
            qp_solves, shown = qp_solves + elastic.solves, 'violates them least'
    message = f'no path between the obstacles in this homotopy class meets the goal: the path shown {shown}'
    return StrategyResult(Status.INFEASIBLE, message, control, contacts, tau, lam, qp_solves)


def give_up_out_of_time(problem: Problem, error: OutOfTimeError) -> StrategyResult:
    """Return the last of a sequence that was stopped; if there is none, the movement that ignores all obstacles."""
    if isinstance(error, StoppedError):
        return StrategyResult(Status.DEADLINE, 'out of time', error.control, error.contacts)
    message = 'out of time: the movement shown ignores all obstacles'
    return StrategyResult(Status.DEADLINE, message, effort_cost(problem, 0.0).goal_solution.control)
