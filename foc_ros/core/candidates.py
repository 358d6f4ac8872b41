"""From candidates to likelihoods: each is solved, its real class is found, duplicates are dropped, the rest is ranked."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from .config import FocConfig, LikelihoodConfig
from .deadline import NEVER, Deadline
from .homotopy import find_path_sides
from .homotopy.branch_times import compute_branch_times
from .likelihood import CostModel, compute_likelihoods
from .ocp.problem import Problem
from .ocp.solve import solve_problem
from .ocp.warm_start import cold_start, warm_start
from .types import Candidate, Obstacles, PredictedCandidate, Solution, Status

EFFORT_ONLY = CostModel()


@dataclass(frozen=True)
class EarlierSolutions:
    """Results of earlier predictions by label: solutions to start from, and likelihoods, which give the order of solving."""

    solutions: Mapping[str, Solution] = field(default_factory=dict)
    likelihoods: Mapping[str, float] = field(default_factory=dict)


NOTHING = EarlierSolutions()


def solve_candidates(
    candidates: Sequence[Candidate],
    problems: Sequence[Problem],
    settings: FocConfig,
    costs: CostModel = EFFORT_ONLY,
    earlier: EarlierSolutions = NOTHING,
    deadline: Deadline = NEVER,
) -> list[PredictedCandidate]:
    """Solve every candidate, those that were most likely before first; return them in their own order, with likelihoods 0.

    problems: one for each candidate; costs: parts of the cost besides the effort to go; earlier: results of the prediction
    before, to start from. Candidates that are not solved before the deadline get the status DEADLINE.
    """
    solved = {}
    for row in sorted(range(len(candidates)), key=lambda row: -earlier.likelihoods.get(candidates[row].label, 0.0)):
        previous = earlier.solutions.get(candidates[row].label)
        solved[row] = _solve_candidate(candidates[row], problems[row], settings, costs, previous, deadline)
    return [solved[row] for row in range(len(candidates))]


def _solve_candidate(
    candidate: Candidate, problem: Problem, settings: FocConfig, costs: CostModel, previous: Solution | None, deadline: Deadline
) -> PredictedCandidate:
    """Solve from the previous solution; if the status changes, also from the candidate's own guess.

    A candidate that was unreachable and is solved now may have come from far beyond the least effort: the cheaper result counts.
    """
    warm = None
    if previous is not None:
        solution = solve_problem(problem, warm_start(previous, problem), settings, deadline)
        warm = _check_class(candidate, problem, solution, costs)
        # a solution that continues one stopped by the deadline has skipped nothing
        is_continued = previous.status is Status.DEADLINE and warm.is_solved
        if warm.status in (previous.status, Status.DEADLINE) or is_continued:
            return warm
    cold = _check_class(candidate, problem, solve_problem(problem, cold_start(candidate.guess), settings, deadline), costs)
    return warm if warm is not None and warm.is_solved and not (cold.is_solved and cold.cost < warm.cost) else cold


def _check_class(candidate: Candidate, problem: Problem, solution: Solution, costs: CostModel) -> PredictedCandidate:
    """Find the homotopy class in which a solution really is, and its cost; the status says if it left the candidate's class."""
    sides = find_path_sides(solution.path, problem.obstacles, problem.centre_trajectories)
    if solution.status is Status.SOLVED and any(sides.get(identity, side) != side for identity, side in candidate.sides):
        solution = replace(solution, status=Status.LEFT_CLASS, message='the solution moved into another homotopy class')
    return PredictedCandidate(candidate, solution, sides, costs.compute_cost(solution), 0.0)


def drop_duplicates(candidates: Sequence[PredictedCandidate]) -> list[PredictedCandidate]:
    """Drop candidates that moved into a class that another candidate solved, so that no class is counted twice."""
    if all(each.status is not Status.LEFT_CLASS for each in candidates):
        return list(candidates)
    solved = {_identify_class(each) for each in candidates if each.is_solved}
    return [each for each in candidates if each.status is not Status.LEFT_CLASS or _identify_class(each) not in solved]


def _identify_class(candidate: PredictedCandidate) -> tuple[int, frozenset[tuple[str, int]]]:
    return candidate.candidate.goal, frozenset(candidate.sides.items())


def rank_candidates(
    candidates: Sequence[PredictedCandidate], likelihood: LikelihoodConfig, obstacles: Obstacles
) -> list[PredictedCandidate]:
    """Return the distinct candidates with their likelihoods: solved ones, most likely first, then the others, at 0."""
    candidates = drop_duplicates(candidates)
    solved = [each for each in candidates if each.is_solved]
    branch_times = compute_branch_times(solved, obstacles) if likelihood.lookahead_s > 0.0 else None
    likelihoods = compute_likelihoods(np.array([each.cost for each in solved]), likelihood, branch_times).tolist()
    pairs = zip(solved, likelihoods, strict=True)
    ranked = [PredictedCandidate(each.candidate, each.solution, each.sides, each.cost, share) for each, share in pairs]
    ranked.sort(key=lambda each: (-each.likelihood, each.label))
    return ranked + [each for each in candidates if not each.is_solved]
