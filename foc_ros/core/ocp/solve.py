# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The forward optimal control of candidates: a strategy is applied to their problems, and its results evaluated in full."""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from foc_ros.core.config import FocConfig
from foc_ros.core.deadline import NEVER, Deadline
from foc_ros.core.errors import InputError
from foc_ros.core.obstacles.geometry import find_offset
from foc_ros.core.plant.covariance import propagate_covariance
from foc_ros.core.plant.response import sample_curve
from foc_ros.core.registry import STRATEGIES
from foc_ros.core.solution import Solution, Status
from foc_ros.core.types import Array, as_readonly

from .margin import Margins
from .minima import find_least_factors
from .problem import Problem, group_by_response
from .start import Start
from .strategies import StrategyResult

ETA_TOLERANCE = 1e-5
"""How far a solution may fall short of eta by rounding."""
FINE, MOST_PARTS = 5e-4, 2000
"""Distance between the points at which an infeasible path is measured, relative to the scene, as far as so many points of each
step have it: it may leap over an obstacle between two steps."""
NO_VIOLATION = 1e-7
"""Shortfall of a distance that counts as rounding [m]."""


def solve_problem(problem: Problem, start: Start, settings: FocConfig, deadline: Deadline = NEVER) -> Solution:
    """Solve one problem in the homotopy class in which it starts: see `solve_problems`."""
    return solve_problems([problem], [start], settings, deadline)[0]


def solve_problems(
    problems: Sequence[Problem], starts: Sequence[Start], settings: FocConfig, deadline: Deadline = NEVER
) -> list[Solution]:
    """Solve problems, each in the homotopy class in which it starts, by the strategy of the settings.

    Parameters
    ----------
    problems
        The problems. Those with the same response of the position to the control advance together.
    starts
        Where the strategy begins, for each.
    settings
        The strategy, its parameters, and the QP backend.
    deadline
        Looked at once an iteration of all problems.

    Returns
    -------
    list[Solution]
        If a problem has no solution, its status says so, and its mean is the best that was found: the largest eta that the
        strategy reached, or the smallest violation. No exception is raised for that.
    """
    strategy = STRATEGIES.get(settings.strategy)
    solved: dict[int, Solution] = {}
    for rows in group_by_response(problems):
        group = [
            each if each.qp_backend == settings.qp_backend else replace(each, qp_backend=settings.qp_backend)
            for each in (problems[row] for row in rows)
        ]
        began = time.perf_counter()
        results = strategy(group, [starts[row] for row in rows], settings, deadline)
        is_list = isinstance(results, list) and len(results) == len(group)
        if not is_list or not all(isinstance(each, StrategyResult) for each in results):
            raise InputError(f'strategy {settings.strategy}', 'a list of StrategyResult, one for each problem', repr(results))
        share_s = (time.perf_counter() - began) / len(rows)
        solved |= zip(rows, _evaluate(group, results, share_s), strict=True)
    return [solved[row] for row in range(len(problems))]


def find_least_safety_factor(problem: Problem, control: Array) -> tuple[float, int, float]:
    """Return the least safety factor of a stacked control (2N,) over all obstacles and times, and where it is.

    Returns
    -------
    float, int, float
        k, `CERTAIN_K` without obstacles; the row of the obstacle; the time in steps, from the end of the first step on.
    """
    margins = Margins([problem], np.zeros(1), is_chance=True)
    k, obstacle, moment = find_least_factors(margins, np.asarray(control, dtype=float)[None] * problem.horizon.gain)
    return float(k[0]), int(obstacle[0]), float(moment[0])


def _evaluate(problems: Sequence[Problem], results: Sequence[StrategyResult], solve_s: float) -> list[Solution]:
    """Return the solutions of problems with the same response, with the least safety factors over all times; solve_s [s]."""
    minima: Sequence[tuple[float, int, float] | None] = [each.minimum for each in results]
    if None in minima:
        margins = Margins(problems, np.zeros(len(problems)), is_chance=True)
        control = np.stack([each.control * problem.horizon.gain for problem, each in zip(problems, results, strict=True)])
        minima = list(zip(*(each.tolist() for each in find_least_factors(margins, control)), strict=True))
    return [_evaluate_one(*each, solve_s) for each in zip(problems, results, minima, strict=True)]  # type: ignore[arg-type]


def _evaluate_one(problem: Problem, result: StrategyResult, minimum: tuple[float, int, float], solve_s: float) -> Solution:
    (k, row, moment), risk, control = minimum, problem.risk, result.control
    eta, status, message = risk.find_probability(k), result.status, result.message
    if status is Status.SOLVED and result.aims_at_eta and eta < problem.eta - ETA_TOLERANCE:
        status, message = Status.ITERATION_LIMIT, f'the solution achieves eta {eta:.6g} only'
    if status is Status.ETA_UNREACHABLE and not problem.preference.is_hard:
        status = Status.COMPROMISED
    mean = problem.states(control)
    covariance = propagate_covariance(problem.horizon, problem.free_covariance, problem.noise_variance, control)
    violation, violated = 0.0, None
    if status is Status.INFEASIBLE or result.tau:
        longest = float(np.abs(np.diff(mean[:, :2], axis=0)).max()) / (FINE * problem.extent)
        parts = min(max(math.ceil(longest), 1), MOST_PARTS) if status is Status.INFEASIBLE else 1
        violation, violated = compute_violation(problem, mean, result.tau, parts)
    effort, names = float(control @ control), problem.obstacles.ids
    # of a class that had no time to meet a condition, it is not known whether it misses it
    is_unknown = status.is_estimate and problem.preference.is_hard
    shortfall = 0.0 if status is Status.SOLVED or is_unknown else max(problem.wanted_k - k, 0.0)
    obstacles, times, pushes = (each.tolist() for each in result.forces)
    return Solution(
        status=status,
        message=_complete_message(problem, status, message, violation),
        dt=problem.horizon.dt,
        mean=as_readonly(mean),
        covariance=as_readonly(covariance),
        control=as_readonly(np.ascontiguousarray(control.reshape(2, -1).T)),
        effort=effort,
        costs=compute_cost_terms(problem, control, mean, covariance, result.lam),
        tau=result.tau,
        lam=result.lam,
        eta=eta,
        eta_at=(names[row], moment) if len(problem.obstacles) else None,
        eta_reachable=eta if status is Status.ETA_UNREACHABLE else None,
        safety_factor=k,
        safety_shortfall=shortfall,
        violation=violation,
        violation_at=None if violated is None else (names[violated[0]], violated[1]),
        multipliers=tuple((names[j], t, y * effort) for j, t, y in zip(obstacles, times, pushes, strict=True)),
        equivalent_weights=((result.tau, result.lam),) * len(times) if result.weights is None else result.weights,
        qp_solves=result.qp_solves,
        iterations=result.iterations,
        solve_s=solve_s,
    )


def _complete_message(problem: Problem, status: Status, message: str, violation: float) -> str:
    """Return a message with the size of the violation and the obstacles whose margins do not count yet."""
    if status is Status.INFEASIBLE and violation > 0:
        message += f', by up to {violation:.3g} m'
    left = [name for name, is_inside in zip(problem.obstacles.ids, problem.inside_margin.tolist(), strict=True) if is_inside]
    if left:
        message += f'; the hand is inside the margin of {", ".join(left)} now: eta holds there from {problem.recovery_s:g} s on'
    return message


def compute_cost_terms(problem: Problem, control: Array, mean: Array, covariance: Array, lam: float) -> dict[str, float]:
    """Return every term of J_aug by name [m^2/s^6]: effort, weighted mean errors and variances, and the lambda term.

    control (2N,); mean (N + 1, n) and covariance (N + 1, n, n) that follow from it; lam: lambda [1/s^6].
    """
    weights = np.tile(problem.stage_weights, (len(mean) - 1, 1))
    weights[-1] = problem.terminal_weights
    variance = np.einsum('tii->ti', covariance[1:])
    return {
        'effort': float(control @ control),
        'mean_error': float((weights * (mean[1:] - problem.goal) ** 2).sum()),
        'variance': float((weights * variance).sum()),
        'lambda_variance': lam * float(variance[:, :2].sum()),
    }


def compute_violation(problem: Problem, mean: Array, tau: float, parts: int) -> tuple[float, tuple[int, float] | None]:
    """Return by how much a mean (N + 1, n) comes nearer than sqrt(E[R^2] + tau) [m], and where: obstacle and step.

    Each step is measured at equal parts; one part means its end only. 0 and None where the mean keeps its distance.
    """
    if not len(problem.obstacles):
        return 0.0, None
    times = np.arange(1, parts * problem.horizon.steps + 1) / parts
    path = sample_curve(mean[:, :2], mean[:, 2:4], problem.horizon.dt, parts)[1:]
    relative = path[:, None] - problem.obstacles.centre - times[:, None, None] * problem.drift
    missing = np.sqrt(problem.size[0] + tau) - find_offset(relative[..., 0], relative[..., 1], problem.obstacles.edges).distance
    moment, row = np.unravel_index(int(missing.argmax()), missing.shape)
    deepest = float(missing[moment, row])
    return (deepest, (int(row), float(times[moment]))) if deepest > NO_VIOLATION else (0.0, None)
