"""The forward optimal control of one candidate: a strategy is applied to a problem, and its result evaluated in full."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from foc_ros.core.config import FocConfig
from foc_ros.core.deadline import NEVER, Deadline, OutOfTimeError
from foc_ros.core.dynamics.impulse_response import apply_impulse_response
from foc_ros.core.dynamics.noise import propagate_covariance
from foc_ros.core.errors import InputError
from foc_ros.core.kernels import Matrix, Tensor, Vector, compiled
from foc_ros.core.registry import STRATEGIES
from foc_ros.core.types import Array, Solution, Status, as_readonly

from .clearance import find_deepest
from .minimum_safety_factor import MinimumSafetyFactor, find_minimum_safety_factor
from .problem import Problem
from .strategies import StrategyResult, give_up_out_of_time
from .warm_start import Start

ETA_TOLERANCE = 1e-5
"""How far a solution may fall short of eta by rounding."""
NO_VIOLATION = 1e-7
"""Shortfall of a distance that counts as rounding [m]."""


def solve_problem(problem: Problem, start: Start, settings: FocConfig, deadline: Deadline = NEVER) -> Solution:
    """Solve one problem in the homotopy class in which it starts, by the strategy of the settings.

    Parameters
    ----------
    problem
        The problem.
    start
        Where the strategy begins.
    settings
        The strategy, its parameters, and the QP backend.
    deadline
        Checked before each QP.

    Returns
    -------
    Solution
        If the problem has no solution, its status says so, and its mean is the best that was found: the largest eta that the
        strategy reached, or the smallest violation. No exception is raised for that.
    """
    strategy = STRATEGIES.get(settings.strategy)  # the first call imports it, which is no part of the time of a solve
    began = time.perf_counter()
    if settings.qp_backend != problem.qp_backend:
        problem = replace(problem, qp_backend=settings.qp_backend)
    try:
        result = strategy(problem, start, settings, deadline)
    except OutOfTimeError as error:
        result = give_up_out_of_time(problem, error)
    if not isinstance(result, StrategyResult):
        raise InputError(f'strategy {settings.strategy}', 'a StrategyResult as its result', repr(result))
    minimum = result.minimum
    if minimum is None:
        minimum = find_minimum_safety_factor(problem, result.control, between_steps=False)
    eta = problem.risk.find_probability(minimum.k)
    if result.status is Status.SOLVED and result.aims_at_eta and eta < problem.eta - ETA_TOLERANCE:
        result = replace(result, status=Status.ITERATION_LIMIT, message=f'the solution achieves eta {eta:.6g} only')
    if result.status is Status.ETA_UNREACHABLE and not problem.preference.is_hard:
        result = replace(result, status=Status.COMPROMISED)
    return _evaluate(problem, result, minimum, began)


def _evaluate(problem: Problem, result: StrategyResult, minimum: MinimumSafetyFactor, began: float) -> Solution:
    """Return the solution of a result that began at a time of `time.perf_counter` [s]."""
    horizon, control, contacts = problem.horizon, result.control, result.contacts
    mean = problem.free + apply_impulse_response(horizon.states, control).T
    covariance = propagate_covariance(horizon, problem.free_covariance, problem.noise_variance, control)
    violation, violated = compute_violation(problem, mean, result.tau)
    weights, eta = result.equivalent_weights, problem.risk.find_probability(minimum.k)
    names = [problem.obstacles.ids[row] for row in contacts.obstacle.tolist()]
    return Solution(
        status=result.status,
        message=_complete_message(problem, result, violation),
        dt=horizon.dt,
        mean=as_readonly(mean),
        covariance=as_readonly(covariance),
        control=control.reshape(2, -1).T,
        effort=float(control @ control),
        costs=compute_cost_terms(problem, control, mean, covariance, result.lam),
        tau=result.tau,
        lam=result.lam,
        eta=eta,
        eta_at=_name(problem.obstacles.ids, (minimum.obstacle, minimum.time)) if len(problem.obstacles) else None,
        eta_reachable=eta if result.status is Status.ETA_UNREACHABLE else None,
        safety_factor=minimum.k,
        safety_shortfall=0.0 if result.status is Status.SOLVED else max(problem.wanted_k - minimum.k, 0.0),
        violation=violation,
        violation_at=_name(problem.obstacles.ids, violated),
        multipliers=tuple(zip(names, contacts.time.tolist(), contacts.multiplier.tolist(), strict=True)),
        equivalent_weights=((result.tau, result.lam),) * len(names) if weights is None else tuple(weights),
        safety_factor_slope=result.safety_factor_slope,
        is_complete=result.is_complete,
        qp_solves=result.qp_solves,
        iterations=result.iterations,
        solve_s=time.perf_counter() - began,
    )


def _name(ids: Sequence[str], place: tuple[int, float] | None) -> tuple[str, float] | None:
    return None if place is None else (ids[place[0]], place[1])


def _complete_message(problem: Problem, result: StrategyResult, violation: float) -> str:
    """Return the message of a result with the size of its violation and the obstacles whose margins do not count yet."""
    message = result.message
    if result.status is Status.INFEASIBLE and violation > 0:
        message += f', by up to {violation:.3g} m'
    left = [name for name, is_inside in zip(problem.obstacles.ids, problem.inside_margin.tolist(), strict=True) if is_inside]
    if left:
        message += f'; the hand is inside the margin of {", ".join(left)} now: eta holds from {problem.recovery_s:g} s on'
    return message


def compute_cost_terms(problem: Problem, control: Array, mean: Array, covariance: Array, lam: float) -> dict[str, float]:
    """Return every term of J_aug by name [m^2/s^6]: effort, weighted mean errors and variances, and the lambda term.

    control (2N,); mean (N + 1, n) and covariance (N + 1, n, n) that follow from it; lam: lambda [1/s^6].
    """
    weights = problem.terminal_weights, problem.stage_weights
    mean_error, variance, summed = sum_errors(mean, covariance, problem.goal, *weights)
    effort = float(control @ control)
    return {'effort': effort, 'mean_error': mean_error, 'variance': variance, 'lambda_variance': lam * summed}


@compiled
def sum_errors(mean: Matrix, covariance: Tensor, goal: Vector, terminal: Vector, stage: Vector) -> tuple[float, float, float]:
    """Return weighted squared errors of a mean (N + 1, n), weighted variances, and the sum of the variances of x and y."""
    times, n = mean.shape
    squared, variance, summed = 0.0, 0.0, 0.0
    for t in range(1, times):
        for i in range(n):
            weight = terminal[i] if t == times - 1 else stage[i]
            squared += weight * (mean[t, i] - goal[i]) ** 2
            variance += weight * covariance[t, i, i]
        summed += covariance[t, 0, 0] + covariance[t, 1, 1]
    return squared, variance, summed


def compute_violation(problem: Problem, mean: Array, tau: float) -> tuple[float, tuple[int, int] | None]:
    """Return by how much a mean (N + 1, n) comes nearer than required [m], and where: row of the obstacle and step 1..N.

    0 and None where it never does. What is required is `Problem.obstacles`.
    """
    missing, row, step = find_deepest(np.ascontiguousarray(mean[1:, :2]), problem.obstacles_with_reach(tau))
    return (missing, (row, step)) if missing > NO_VIOLATION else (0.0, None)
