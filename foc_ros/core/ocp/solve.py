"""The forward optimal control of one candidate: a strategy applied to a problem from a guess, and its result in full."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from foc_ros.core.config import FocConfig
from foc_ros.core.deadline import NEVER, Deadline, OutOfTimeError
from foc_ros.core.dynamics.impulse_response import apply_impulse_response
from foc_ros.core.dynamics.noise import propagate_covariance
from foc_ros.core.types import Array, Solution, Status, as_readonly

from .chance_evaluation import Assessment, evaluate_chance_constraint
from .contacts.contacts import Contacts
from .cost_terms import compute_cost_terms, compute_violation, equivalent_weights
from .minimum_k import MinimumSafetyFactor, assess_between
from .problem import Problem
from .qp import clearance_qp, effort_cost
from .sqp import converge
from .strategies.algorithm1 import algorithm1
from .strategies.lv_hc import follow_path
from .strategies.optimal import optimise
from .strategies.penalty_path import PenaltyPath
from .warm_start import Start
from .working_set import WorkingSet, solve

SHORT_OF_ETA = 1e-5
"""What a solved one may be short of eta by rounding."""


@dataclass(frozen=True)
class _Ended:
    """How a strategy ended: a control with the (tau, lambda) it belongs to, its contacts, its smallest k if known."""

    status: Status
    message: str
    control: Array
    tau: float
    lam: float
    qp_solves: int
    contacts: Contacts
    iterations: int | None = None
    slope: float = 0.0
    least: MinimumSafetyFactor | None = None


def solve_problem(problem: Problem, start: Start, settings: FocConfig, deadline: Deadline = NEVER) -> Solution:
    """Solve one problem in the class in which it starts.

    deadline: looked at before each QP. Never raises for a problem that has no solution: the status
    says so, and the mean is then the best effort (the largest eta that the strategy reached, or the smallest violation).
    """
    began = time.perf_counter()
    try:
        ended = _STRATEGIES[settings.strategy](problem, start, settings, deadline)
    except OutOfTimeError:
        control, message = effort_cost(problem, 0.0).goal_control, 'out of time: the movement shown looks at no obstacle'
        ended = _Ended(Status.DEADLINE, message, control, 0.0, 0.0, 0, Contacts())
    continuous = _STRATEGIES[settings.strategy] is _continuous
    assessment = (
        assess_between(problem, ended.control, ended.least) if continuous else evaluate_chance_constraint(problem, ended.control)
    )
    if ended.status is Status.SOLVED and settings.strategy != 'fixed' and assessment.eta < problem.eta - SHORT_OF_ETA:
        message = f'the solution achieves eta {assessment.eta:.6g} only'
        ended = replace(ended, status=Status.ITERATION_LIMIT, message=message)
    return _solution(problem, ended, assessment, time.perf_counter() - began, optimal=settings.strategy == 'optimal')


def _continuous(problem: Problem, start: Start, settings: FocConfig, deadline: Deadline) -> _Ended:
    delta = settings.lv_delta if settings.strategy == 'lv' else settings.hc_delta
    curve = PenaltyPath(delta, settings.growth, settings.lam)
    walked = follow_path(problem, start, curve, deadline)
    if walked.status is Status.DEADLINE and walked.point is None:
        raise OutOfTimeError
    if walked.point is None:
        return _best_effort(problem, start, *curve.at(0.0), walked.qp_solves)
    point = walked.point
    reached = *curve.at(point.s), walked.qp_solves
    return _Ended(walked.status, walked.message, point.control, *reached, point.contacts, slope=walked.slope, least=point.least)


def _optimal(problem: Problem, start: Start, _: FocConfig, deadline: Deadline) -> _Ended:
    optimum = optimise(problem, start, deadline)
    if optimum is None:
        return _best_effort(problem, start, 0.0, 0.0, 0)
    contacts = Contacts.at_steps(optimum.active, optimum.multipliers)
    return _Ended(optimum.status, optimum.message, optimum.control, 0.0, 0.0, optimum.qp_solves, contacts)


def _algorithm1(problem: Problem, start: Start, settings: FocConfig, deadline: Deadline) -> _Ended:
    rates = settings.algorithm1_delta, settings.algorithm1_growth, settings.algorithm1_xi
    stepped = algorithm1(problem, start.positions, *rates, deadline)
    last = stepped.solution
    if last is None:
        return _best_effort(problem, start, stepped.tau, stepped.lam, stepped.qp_solves)
    reached = stepped.tau, stepped.lam, stepped.qp_solves
    contacts = Contacts.at_steps(last.active, last.multipliers)
    return _Ended(stepped.status, stepped.message, last.control, *reached, contacts, stepped.iterations)


def _fixed(problem: Problem, start: Start, settings: FocConfig, deadline: Deadline) -> _Ended:
    working, _ = start.contacts.rows(problem.horizon.steps)
    converged = converge(problem, start.positions, working, settings.tau, settings.lam, deadline)
    if converged is None:
        return _best_effort(problem, start, settings.tau, settings.lam, 0)
    status = Status.SOLVED if converged.stays else Status.ITERATION_LIMIT
    message = 'solved' if converged.stays else 'the linearisation had not settled when its QPs ran out'
    return _Ended(status, message, converged.control, settings.tau, settings.lam, converged.qp_solves, converged.contacts)


def _best_effort(problem: Problem, start: Start, tau: float, lam: float, qp_solves: int) -> _Ended:
    """Let the contradicting rows share the violation, at the start: what the hand can do where nothing meets them all."""
    elastic = solve(clearance_qp(problem, effort_cost(problem, lam), start.positions, tau), WorkingSet(), elastic=True)
    if elastic is None:
        control, contacts = np.zeros(2 * problem.horizon.steps), Contacts()
    else:
        control, contacts = elastic.control, Contacts.at_steps(elastic.active, elastic.multipliers)
        qp_solves += elastic.solves
    message = 'no way between the obstacles of this class meets the goal: the path shown violates them least'
    return _Ended(Status.INFEASIBLE, message, control, tau, lam, qp_solves, contacts)


_STRATEGIES = {'lv': _continuous, 'hc': _continuous, 'optimal': _optimal, 'algorithm1': _algorithm1, 'fixed': _fixed}


def _solution(problem: Problem, ended: _Ended, assessment: Assessment, seconds: float, *, optimal: bool) -> Solution:
    horizon, ids = problem.horizon, problem.obstacles.ids
    mean = problem.free + apply_impulse_response(horizon.states, ended.control).T
    covariance = propagate_covariance(horizon, problem.free_covariance, problem.noise_variance, ended.control)
    violation, violated = compute_violation(problem, mean, ended.tau)
    held = [(ended.tau, ended.lam)] * len(ended.contacts)
    if optimal:
        held = equivalent_weights(problem, ended.control, ended.contacts, max(assessment.smallest_k, 0.0))
    return Solution(
        status=ended.status,
        message=_words(problem, ended, assessment, violation),
        dt=horizon.dt,
        mean=as_readonly(mean),
        covariance=as_readonly(covariance),
        control=ended.control.reshape(2, -1).T,
        effort=float(ended.control @ ended.control),
        costs=compute_cost_terms(problem, ended.control, mean, covariance, ended.lam),
        tau=ended.tau,
        lam=ended.lam,
        eta=assessment.eta,
        eta_at=_named(ids, assessment.place),
        eta_reachable=assessment.eta if ended.status is Status.ETA_UNREACHABLE else None,
        violation=violation,
        violation_at=_named(ids, violated),
        multipliers=tuple(
            (ids[row], time, force) for row, time, force in zip(*(each.tolist() for each in ended.contacts.columns), strict=True)
        ),
        held=tuple(held),
        slope=ended.slope,
        qp_solves=ended.qp_solves,
        iterations=ended.iterations,
        solve_s=seconds,
    )


def _named(ids: Sequence[str], place: tuple[int, float] | None) -> tuple[str, float] | None:
    return None if place is None else (ids[place[0]], place[1])


def _words(problem: Problem, ended: _Ended, assessment: Assessment, violation: float) -> str:
    message = ended.message
    if ended.status is Status.INFEASIBLE and violation > 0:
        message += f', by up to {violation:.3g} m'
    if assessment.relaxed:
        message += f'; inside the margin of {", ".join(assessment.relaxed)} now: eta holds from {problem.recovery_s:g} s on'
    return message
