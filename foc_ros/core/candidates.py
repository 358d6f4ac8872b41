"""From candidates to outcomes: each solved, judged by the class it is really in, told apart, and weighed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from .config import FocConfig, LikelihoodConfig
from .deadline import NEVER, Deadline
from .homotopy import path_sides
from .homotopy.branch_times import compute_branch_times
from .likelihood import compute_likelihoods, compute_shared_cost
from .ocp.problem import Problem
from .ocp.solve import solve_problem
from .ocp.warm_start import cold_start, warm_start
from .types import Candidate, Obstacles, PredictedCandidate, Solution, Status


@dataclass(frozen=True)
class EarlierSolutions:
    """What was found before, by label: solutions to start from, and likelihoods, by which what comes first is chosen."""

    solutions: Mapping[str, Solution] = field(default_factory=dict)
    likelihoods: Mapping[str, float] = field(default_factory=dict)


NOTHING = EarlierSolutions()


def solve_candidates(
    candidates: Sequence[Candidate],
    problems: Sequence[Problem],
    settings: FocConfig,
    likelihood: LikelihoodConfig,
    effort_spent: float = 0.0,
    earlier: EarlierSolutions = NOTHING,
    deadline: Deadline = NEVER,
) -> list[PredictedCandidate]:
    """Solve each candidate, the likeliest of last time first, until the deadline; those that had no time have that status.

    problems: one for every candidate; effort_spent: since movement onset [m^2/s^5]. Returns them in the order of the candidates.
    """
    shared, found = compute_shared_cost(effort_spent, likelihood), {}
    for row in sorted(range(len(candidates)), key=lambda row: -earlier.likelihoods.get(candidates[row].label, 0.0)):
        previous = earlier.solutions.get(candidates[row].label)
        found[row] = _solved(candidates[row], problems[row], settings, shared, previous, deadline)
    return [found[row] for row in range(len(candidates))]


def _solved(
    candidate: Candidate, problem: Problem, settings: FocConfig, shared: float, previous: Solution | None, deadline: Deadline
) -> PredictedCandidate:
    """Solve from the earlier solution; if that gets into what the earlier one was not, from the candidate's own guess.

    A way that was out of reach and is solved may have come from far beyond the least effort: then the cheaper of both counts.
    """
    outcome = None
    if previous is not None:
        again = solve_problem(problem, warm_start(previous, problem), settings, deadline)
        outcome = _judged(candidate, problem, again, shared)
        # what ran out of time on its way goes on from there, and has left nothing out
        stopped = previous.status is Status.DEADLINE and outcome.is_solved
        if outcome.solution.status in (previous.status, Status.DEADLINE) or stopped:
            return outcome
    fresh = _judged(candidate, problem, solve_problem(problem, cold_start(candidate.guess), settings, deadline), shared)
    return outcome if outcome is not None and outcome.is_solved and not (fresh.is_solved and fresh.cost < outcome.cost) else fresh


def _judged(candidate: Candidate, problem: Problem, solution: Solution, shared: float) -> PredictedCandidate:
    """Find the class it is really in; costs are integrals of squared jerk, shared and to go, so that durations compare."""
    sides = path_sides(solution.path, problem.obstacles, problem.courses)
    if solution.status is Status.SOLVED and any(sides.get(identity, side) != side for identity, side in candidate.sides):
        solution = replace(solution, status=Status.LEFT_CLASS, message='the solution slid into another class')
    return PredictedCandidate(candidate, solution, sides, shared + solution.effort * solution.dt, 0.0)


def distinct(outcomes: Sequence[PredictedCandidate]) -> list[PredictedCandidate]:
    """Drop what slid into a class that another outcome solved: the same way round is never counted twice."""
    if all(outcome.solution.status is not Status.LEFT_CLASS for outcome in outcomes):
        return list(outcomes)
    held = {_class(outcome) for outcome in outcomes if outcome.is_solved}
    return [outcome for outcome in outcomes if outcome.solution.status is not Status.LEFT_CLASS or _class(outcome) not in held]


def _class(outcome: PredictedCandidate) -> tuple[int, frozenset[tuple[str, int]]]:
    return outcome.candidate.goal, frozenset(outcome.sides.items())


def rank_candidates(
    outcomes: Sequence[PredictedCandidate], likelihood: LikelihoodConfig, obstacles: Obstacles
) -> list[PredictedCandidate]:
    """Give the solved ones, each way once, their likelihoods, the most likely first; the others follow in their order, at 0."""
    outcomes = distinct(outcomes)
    solved = [outcome for outcome in outcomes if outcome.is_solved]
    parted = compute_branch_times(solved, obstacles) if likelihood.lookahead_s > 0.0 else None
    shares = compute_likelihoods(np.array([outcome.cost for outcome in solved]), likelihood, parted).tolist()
    pairs = zip(solved, shares, strict=True)
    weighed = [PredictedCandidate(one.candidate, one.solution, one.sides, one.cost, share) for one, share in pairs]
    weighed.sort(key=lambda outcome: (-outcome.likelihood, outcome.candidate.label))
    return weighed + [outcome for outcome in outcomes if not outcome.is_solved]
