"""Strategy `algorithm1`: the paper's algorithm as printed, its loop condition the right way round, for the record.

tau = 0, lambda = 1. Solve the QP, linearise at its mean; while the surrogate is violated tau += delta, lambda *= Delta; end
when it holds and the cost changes by less than xi. Both grow in leaps, so it overshoots, or leaps over what is feasible.
"""

from __future__ import annotations

from dataclasses import dataclass

from foc_ros.core.deadline import NEVER, Deadline
from foc_ros.core.obstacles.chance_constraint import k_of_eta
from foc_ros.core.ocp.chance_evaluation import evaluate_chance_constraint
from foc_ros.core.ocp.problem import Problem
from foc_ros.core.ocp.qp import clearance_qp, effort_cost
from foc_ros.core.ocp.working_set import QPSolution, WorkingSet, solve
from foc_ros.core.types import Array, Status

MAX_ITERATIONS = 500
LARGEST_LAMBDA = 1e150
"""Where the loop ends: with a large growth, lambda leaves the range of double precision before tau is large enough."""


@dataclass(frozen=True, eq=False)
class Stepped:
    """How the loop ended: status, words, the last solution (None: not even the first QP has one), its tau, lambda.

    iterations: of the loop, each one QP of the paper; qp_solves: how many of its own the range-space solver needed for them.
    """

    status: Status
    message: str
    solution: QPSolution | None
    tau: float
    lam: float
    iterations: int
    qp_solves: int


def algorithm1(problem: Problem, guess: Array, delta: float, growth: float, xi: float, deadline: Deadline = NEVER) -> Stepped:
    """Run algorithm 1 from a guess (N, 2) [m] at steps 1..N: delta [m^2], growth Delta, xi [m^2/s^6] on the effort."""
    tau, lam, wanted = 0.0, 1.0, k_of_eta(problem.eta)
    solution: QPSolution | None = None
    solves = 0
    for iteration in range(1, MAX_ITERATIONS + 1):
        before, last = (tau, lam), solution
        if last is not None and evaluate_chance_constraint(problem, last.control).smallest_k < wanted:
            tau, lam = tau + delta, lam * growth
        if lam > LARGEST_LAMBDA:
            message = f'lambda = {lam:.3g} after {iteration - 1} QPs, and the surrogate is still violated'
            return Stepped(Status.ITERATION_LIMIT, message, last, *before, iteration - 1, solves)
        deadline.check()
        qp = clearance_qp(problem, effort_cost(problem, lam), guess, tau, literal=True)
        solution = solve(qp, last.active if last else WorkingSet())
        if solution is None:
            message = f'QP {iteration} is infeasible at tau = {tau:.3g}, lambda = {lam:.3g}'
            return Stepped(Status.INFEASIBLE, message, last, *before, iteration, solves)
        solves += solution.solves
        guess = problem.positions(solution.control)
        change = abs(solution.control @ solution.control - last.control @ last.control) if last else float('inf')
        if change < xi and evaluate_chance_constraint(problem, solution.control).smallest_k >= wanted:
            return Stepped(Status.SOLVED, 'solved', solution, tau, lam, iteration, solves)
    message = f'not settled after {MAX_ITERATIONS} QPs at tau = {tau:.3g}, lambda = {lam:.3g}'
    return Stepped(Status.ITERATION_LIMIT, message, solution, tau, lam, MAX_ITERATIONS, solves)
