"""Strategy `fixed`: the reformulated problem at a given tau and lambda. It promises the eta that it reports, and aims at none."""

from __future__ import annotations

from foc_ros.core.config import FocConfig
from foc_ros.core.deadline import NEVER, Deadline
from foc_ros.core.ocp.problem import Problem
from foc_ros.core.ocp.sqp import converge
from foc_ros.core.ocp.warm_start import Start
from foc_ros.core.types import Status

from . import StrategyResult, find_best_effort


def solve_fixed(problem: Problem, start: Start, settings: FocConfig, deadline: Deadline = NEVER) -> StrategyResult:
    """Solve a problem at the tau [m^2] and lambda [1/s^6] of the settings."""
    weights = settings.tau, settings.lam
    working, _ = start.contacts.rows(problem.horizon.steps)
    found = converge(problem, start.positions, working, *weights, deadline)
    if found is None:
        return find_best_effort(problem, start, *weights)
    status = Status.SOLVED if found.stays else Status.ITERATION_LIMIT
    message = 'solved' if found.stays else 'the linearisation had not settled when its QPs ran out'
    return StrategyResult(status, message, found.control, found.contacts, *weights, found.qp_solves, aims_at_eta=False)
