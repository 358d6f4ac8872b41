"""Strategy `algorithm1`: the paper's algorithm as printed, but for its loop condition, which is corrected; for comparison.

tau = 0, lambda = 1. Solve the QP, linearise at its mean; while the surrogate is violated tau += delta, lambda *= Delta; end
when it holds and the cost changes by less than xi. Both grow in large steps, so that the loop overshoots, or steps over what is
feasible.
"""

from __future__ import annotations

from foc_ros.core.config import FocConfig
from foc_ros.core.deadline import NEVER, Deadline
from foc_ros.core.ocp.contacts.contacts import Contacts
from foc_ros.core.ocp.minimum_safety_factor import find_minimum_safety_factor
from foc_ros.core.ocp.problem import Problem
from foc_ros.core.ocp.qp import clearance_qp, effort_cost
from foc_ros.core.ocp.warm_start import Start
from foc_ros.core.ocp.working_set import QPSolution, WorkingSet, solve
from foc_ros.core.types import Status

from . import StrategyResult, find_best_effort

MAX_ITERATIONS = 500
LARGEST_LAMBDA = 1e150
"""Lambda at which the loop ends: with a large growth it leaves the range of double precision before tau is large enough."""


def solve_algorithm1(problem: Problem, start: Start, settings: FocConfig, deadline: Deadline = NEVER) -> StrategyResult:
    """Run the loop from the positions of a start; its parameters are delta [m^2], Delta, and xi [m^2/s^6] on the effort."""
    tau, lam, wanted, guess = 0.0, 1.0, problem.wanted_k, start.positions
    last: QPSolution | None = None
    solves = 0

    def end(status: Status, message: str, weights: tuple[float, float], iterations: int) -> StrategyResult:
        if last is None:
            return find_best_effort(problem, start, *weights, solves)
        contacts = Contacts.at_steps(last.active, last.multipliers)
        return StrategyResult(status, message, last.control, contacts, *weights, solves, iterations)

    for iteration in range(1, MAX_ITERATIONS + 1):
        before = tau, lam
        if last is not None and not _meets(problem, last, wanted):
            tau, lam = tau + settings.algorithm1_delta, lam * settings.algorithm1_growth
        if lam > LARGEST_LAMBDA:
            message = f'lambda = {lam:.3g} after {iteration - 1} QPs, and the surrogate is still violated'
            return end(Status.ITERATION_LIMIT, message, before, iteration - 1)
        deadline.check()
        qp = clearance_qp(problem, effort_cost(problem, lam), guess, tau, literal=True)
        solution = solve(qp, last.active if last else WorkingSet())
        if solution is None:
            message = f'QP {iteration} is infeasible at tau = {tau:.3g}, lambda = {lam:.3g}'
            return end(Status.INFEASIBLE, message, before, iteration)
        solves += solution.solves
        guess = problem.positions(solution.control)
        change = abs(solution.control @ solution.control - last.control @ last.control) if last else float('inf')
        last = solution
        if change < settings.algorithm1_xi and _meets(problem, solution, wanted):
            return end(Status.SOLVED, 'solved', (tau, lam), iteration)
    message = f'not settled after {MAX_ITERATIONS} QPs at tau = {tau:.3g}, lambda = {lam:.3g}'
    return end(Status.ITERATION_LIMIT, message, (tau, lam), MAX_ITERATIONS)


def _meets(problem: Problem, solution: QPSolution, wanted: float) -> bool:
    return find_minimum_safety_factor(problem, solution.control, between_steps=False).k >= wanted
