"""From candidates to likelihoods: each is solved, its real class is found, duplicates are dropped, the rest is ranked."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType
from typing import Protocol

import numpy as np

from .classes import find_path_sides
from .classes.rows import find_decisions, tabulate_sides
from .classes.sides import compute_branch_times
from .config import FocConfig, LikelihoodConfig
from .deadline import NEVER, Deadline
from .likelihood import BETWEEN_OPERATORS, compute_likelihoods, compute_lookahead_share
from .ocp.problem import Problem
from .ocp.solve import solve_problems
from .ocp.start import Start, cold_start, warm_start
from .types import Array, Candidate, HandState, Obstacles, PredictedCandidate, Solution, Status


class ProblemTable(Protocol):
    """The problems of candidates by row: a list, or what builds each when it is asked for."""

    def __getitem__(self, row: int, /) -> Problem:
        """Return the problem of the candidate in a row."""


def solve_candidates(
    candidates: Sequence[Candidate],
    problems: ProblemTable,
    settings: FocConfig,
    earlier: Mapping[str, Solution] = MappingProxyType({}),
    deadline: Deadline = NEVER,
) -> list[PredictedCandidate]:
    """Solve all candidates together, each from its earlier solution or its guess; return them with likelihoods 0.

    Parameters
    ----------
    candidates
        The homotopy classes.
    problems
        One for each.
    settings
        The strategy and its parameters.
    earlier
        Solutions of the prediction before, by label, from which their classes are followed.
    deadline
        When the solutions have to be ready. A class that is not ready then has an estimate, and says so.
    """
    needed = [problems[row] for row in range(len(candidates))]
    starts = [_begin(each, problem, earlier.get(each.label)) for each, problem in zip(candidates, needed, strict=True)]
    solutions = solve_problems(needed, starts, settings, deadline)
    return [_classify(*each) for each in zip(candidates, solutions, needed, strict=True)]


def _begin(candidate: Candidate, problem: Problem, previous: Solution | None) -> Start:
    """Return the earlier solution of a candidate as its start, or its guess where that passes an obstacle on another side."""
    if previous is None:
        return cold_start(candidate.guess)
    start = warm_start(previous, problem)
    return start if _is_in_class(candidate, _find_sides(start.path, problem)) else cold_start(candidate.guess)


def _find_sides(path: Array, problem: Problem) -> dict[str, int]:
    return find_path_sides(path, problem.obstacles, problem.centre_trajectories)


def _is_in_class(candidate: Candidate, sides: Mapping[str, int]) -> bool:
    return all(sides.get(identity, side) == side for identity, side in candidate.sides)


def _classify(candidate: Candidate, solution: Solution, problem: Problem) -> PredictedCandidate:
    """Find the class in which a solution is, and its cost. The status says if it left the candidate's."""
    sides = _find_sides(solution.path, problem)
    if solution.status.has_likelihood and not _is_in_class(candidate, sides):
        solution = replace(solution, status=Status.LEFT_CLASS, message='the solution moved into another homotopy class')
    return PredictedCandidate(candidate, solution, sides, solution.expected_effort * solution.dt, 0.0)


def drop_duplicates(candidates: Sequence[PredictedCandidate]) -> list[PredictedCandidate]:
    """Drop candidates that moved into a class that another candidate solved, so that no class is counted twice."""
    if all(each.status is not Status.LEFT_CLASS for each in candidates):
        return list(candidates)
    solved = {_identify_class(each) for each in candidates if each.has_likelihood}
    return [each for each in candidates if each.status is not Status.LEFT_CLASS or _identify_class(each) not in solved]


def _identify_class(candidate: PredictedCandidate) -> tuple[int, frozenset[tuple[str, int]]]:
    return candidate.candidate.goal, frozenset(candidate.sides.items())


def rank_candidates(
    candidates: Sequence[PredictedCandidate],
    config: LikelihoodConfig,
    obstacles: Obstacles,
    hand: HandState,
    goals: Array,
    planning_spread: float = BETWEEN_OPERATORS,
) -> list[PredictedCandidate]:
    """Return the distinct candidates: solved and compromised ones, most likely first, then the others, with likelihood 0.

    obstacles: grown by the radius of the hand; goals (g, 2) [m]; planning_spread: as in `compute_likelihoods`.
    """
    candidates = drop_duplicates(candidates)
    taken = [each for each in candidates if each.has_likelihood]
    time_s = min((float(each.solution.times[-1]) for each in taken), default=0.0)
    looks_ahead = compute_lookahead_share(time_s, config, planning_spread) > 0.0
    branch_times = compute_branch_times(taken, obstacles) if looks_ahead and config.lookahead_s > 0.0 else None
    costs, shortfalls = (np.array(each) for each in ([c.cost for c in taken], [c.solution.safety_shortfall for c in taken]))
    decisions = None
    if len(taken) > 1 and (looks_ahead or config.weaving > 0.0):
        goal = np.array([each.candidate.goal for each in taken], dtype=np.intp)
        decisions = find_decisions(tabulate_sides([each.solution for each in taken], obstacles), goal, obstacles, hand, goals)
    shares = compute_likelihoods(costs, config, branch_times, shortfalls, decisions, time_s, planning_spread)
    ranked = [replace(each, likelihood=share) for each, share in zip(taken, shares.tolist(), strict=True)]
    ranked.sort(key=lambda each: (-each.likelihood, each.label))
    return ranked + [each for each in candidates if not each.has_likelihood]
