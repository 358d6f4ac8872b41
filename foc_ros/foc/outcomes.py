"""From candidates to outcomes: each solved, judged by the class it is really in, told apart, and weighed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from .chance import centres
from .config import FocConfig, LikelihoodConfig
from .forward import forward
from .homotopy import path_sides
from .likelihood import likelihoods, shared_cost
from .partings import partings
from .problem import Problem
from .records import Candidate, Obstacles, Outcome, Solution, Status, make_obstacles
from .start import cold, warm


def solve_candidates(
    candidates: Sequence[Candidate],
    problems: Sequence[Problem],
    settings: FocConfig,
    likelihood: LikelihoodConfig,
    effort_spent: float = 0.0,
    earlier: Mapping[str, Solution] | None = None,
) -> list[Outcome]:
    """Solve each candidate and rank them.

    problems: one for every candidate; effort_spent: since movement onset [m^2/s^5]; earlier: solutions to start from where there
    is one of the same label. Returns the solved ones first, most likely first.
    """
    shared, found = shared_cost(effort_spent, likelihood), earlier or {}
    judged = [
        _solved(each, problem, settings, shared, found.get(each.label))
        for each, problem in zip(candidates, problems, strict=True)
    ]
    return ranked(distinct(judged), likelihood, problems[0].obstacles if problems else make_obstacles())


def _solved(candidate: Candidate, problem: Problem, settings: FocConfig, shared: float, previous: Solution | None) -> Outcome:
    """Solve from the earlier solution; if that gets into what the earlier one was not, from the candidate's own guess."""
    if previous is not None:
        again = forward(problem, warm(previous, problem), settings)
        outcome = _judged(candidate, problem, again, shared)
        if outcome.solved or outcome.solution.status is previous.status:
            return outcome
    return _judged(candidate, problem, forward(problem, cold(candidate.guess), settings), shared)


def _judged(candidate: Candidate, problem: Problem, solution: Solution, shared: float) -> Outcome:
    """Find the class it is really in; costs are integrals of squared jerk, shared and to go, so that durations compare."""
    moved = centres(problem.obstacles, solution.dt, problem.horizon.steps)
    where = np.concatenate((problem.obstacles.centre[:, None], moved), axis=1).swapaxes(0, 1)
    sides = path_sides(solution.path, problem.obstacles, where)
    if solution.status is Status.SOLVED and any(sides.get(identity, side) != side for identity, side in candidate.sides):
        solution = replace(solution, status=Status.LEFT_CLASS, message='the solution slid into another class')
    return Outcome(candidate, solution, sides, shared + solution.effort * solution.dt, 0.0)


def distinct(outcomes: Sequence[Outcome]) -> list[Outcome]:
    """Drop what slid into a class that another outcome solved: the same way round is never counted twice."""
    held = {_class(outcome) for outcome in outcomes if outcome.solved}
    return [outcome for outcome in outcomes if outcome.solution.status is not Status.LEFT_CLASS or _class(outcome) not in held]


def _class(outcome: Outcome) -> tuple[int, frozenset[tuple[str, int]]]:
    return outcome.candidate.goal, frozenset(outcome.sides.items())


def ranked(outcomes: Sequence[Outcome], likelihood: LikelihoodConfig, obstacles: Obstacles) -> list[Outcome]:
    """Give the solved ones their likelihoods and put the most likely first; the others follow in their order, at 0."""
    solved = [outcome for outcome in outcomes if outcome.solved]
    parted = partings(solved, obstacles) if likelihood.lookahead_s > 0.0 else None
    shares = likelihoods(np.array([outcome.cost for outcome in solved]), likelihood, parted)
    weighed = [replace(outcome, likelihood=float(share)) for outcome, share in zip(solved, shares, strict=True)]
    weighed.sort(key=lambda outcome: (-outcome.likelihood, outcome.candidate.label))
    return weighed + [outcome for outcome in outcomes if not outcome.solved]
