"""From candidates to likelihoods: each is solved, its real class is found, duplicates are dropped, the rest is ranked."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Protocol

import numpy as np

from .classes import find_path_sides
from .classes.rows import find_decisions, tabulate_sides
from .classes.sides import compute_branch_times
from .config import ONLINE, Config, FocConfig
from .deadline import NEVER, Deadline
from .heading_bias import make_reaches
from .learning.choices import Choice
from .likelihood import CostModel, compute_likelihoods, compute_lookahead_share
from .ocp.problem import Problem
from .ocp.solve import solve_problem
from .ocp.warm_start import Start, cold_start, warm_start
from .types import Array, Candidate, HandState, Obstacles, PredictedCandidate, Solution, Status

EFFORT_ONLY = CostModel()
NO_TURN = -1, -1
"""The turns of a class that has had none."""
RAISED_ANYWAY = 2
"""Number of candidates for which there is always time to raise the safety factor: the most likely one, and the next in turn."""
FIRST_RAISES, FURTHER_RAISES = 1, 8
"""How often the safety factor of a candidate that is followed is raised: first of each, then of those that are not settled."""
SETTLED = 0.02
"""Change of a safety factor from one prediction to the next up to which it is settled."""


class ProblemTable(Protocol):
    """The problems of candidates by row: a list, or what builds each when it is asked for."""

    def __getitem__(self, row: int, /) -> Problem:
        """Return the problem of the candidate in a row."""


@dataclass(frozen=True)
class EarlierSolutions:
    """Results of earlier predictions by label: solutions to start from, and what gives the order of solving.

    likelihoods; turns: two stamps [ns] of each class, of the prediction that solved it last, and of the last one that also had
    time to raise its safety factor.
    """

    solutions: Mapping[str, Solution] = field(default_factory=dict)
    likelihoods: Mapping[str, float] = field(default_factory=dict)
    turns: Mapping[str, tuple[int, int]] = field(default_factory=dict)

    def sort_by_turn(self, candidates: Sequence[Candidate]) -> list[int]:
        """Return the rows of candidates: the one that was most likely, then those of which the turns are the longest time ago."""
        labels, rows = [each.label for each in candidates], range(len(candidates))
        most_likely = max(rows, key=lambda row: (self.likelihoods.get(labels[row], 0.0), -row), default=0)
        has_likelihood = any(self.likelihoods.get(label, 0.0) > 0.0 for label in labels)
        return sorted(rows, key=lambda row: (not has_likelihood or row != most_likely, self.turns.get(labels[row], NO_TURN)))


NOTHING = EarlierSolutions()


def solve_candidates(
    candidates: Sequence[Candidate],
    problems: ProblemTable,
    settings: FocConfig,
    costs: CostModel = EFFORT_ONLY,
    earlier: EarlierSolutions = NOTHING,
    deadline: Deadline = NEVER,
    deadline_of_raises: Deadline = NEVER,
) -> list[PredictedCandidate]:
    """Solve the candidates in turn; return those for which there was time in their own order, with likelihoods 0.

    problems: one for each candidate; costs: parts of the cost besides the effort to go; earlier: results of the prediction
    before, to start from. The first one is begun whatever the time. One that the deadline stops gets the status DEADLINE. Until
    the deadline of raises, safety factors are raised: once that of each candidate, of the first ones in any case, then those that
    are not settled.
    """
    solved: dict[int, PredictedCandidate] = {}
    for row in earlier.sort_by_turn(candidates):
        if solved and not deadline.allows():
            break
        previous, raises = earlier.solutions.get(candidates[row].label), math.inf
        if earlier is not NOTHING:
            raises = FIRST_RAISES if len(solved) < RAISED_ANYWAY or deadline_of_raises.allows() else 0
        solved[row] = _solve_candidate(candidates[row], problems[row], settings, costs, previous, deadline, raises)
    unsettled = [row for row, each in solved.items() if earlier is not NOTHING and _is_unsettled(each, earlier.solutions)]
    for row in unsettled:
        if deadline_of_raises.allows():
            first, problem = solved[row], problems[row]
            start = replace(warm_start(first.solution, problem), raises=FURTHER_RAISES)
            raised = _solve_from(start, candidates[row], problem, settings, costs, deadline_of_raises)
            qp_solves = first.solution.qp_solves + raised.solution.qp_solves
            raised = replace(raised, solution=replace(raised.solution, qp_solves=qp_solves))
            solved[row] = raised if raised.has_likelihood else first
    return [solved[row] for row in sorted(solved)]


def _is_unsettled(result: PredictedCandidate, before: Mapping[str, Solution]) -> bool:
    """Tell whether a safety factor below the wanted one is new or has changed, so that a larger one may be in reach."""
    previous, k = before.get(result.label), result.solution.safety_factor
    return result.status is Status.COMPROMISED and (previous is None or abs(k - previous.safety_factor) > SETTLED)


def _solve_candidate(
    candidate: Candidate,
    problem: Problem,
    settings: FocConfig,
    costs: CostModel,
    previous: Solution | None,
    deadline: Deadline,
    raises: float,
) -> PredictedCandidate:
    """Solve from the previous solution; where a likelihood comes or goes, also from the candidate's own guess.

    raises: how often the safety factor may be raised, as in `Start`.

    A candidate that was unreachable and is solved now may have come from far beyond the least effort: the result with the smaller
    loss counts.
    """
    warm = None
    if previous is not None:
        start = replace(warm_start(previous, problem), raises=raises)
        warm = _solve_from(start, candidate, problem, settings, costs, deadline)
        # a solution that continues one stopped by the deadline has skipped nothing
        is_continued = warm.has_likelihood and (previous.status is Status.DEADLINE or previous.status.has_likelihood)
        if warm.status in (previous.status, Status.DEADLINE) or is_continued:
            return warm
    start = replace(cold_start(candidate.guess), raises=raises)
    cold = _solve_from(start, candidate, problem, settings, costs, deadline)
    if warm is None or not warm.has_likelihood:
        return cold
    return cold if cold.has_likelihood and _compute_loss(cold, problem) < _compute_loss(warm, problem) else warm


def _compute_loss(candidate: PredictedCandidate, problem: Problem) -> float:
    solution, wanted = candidate.solution, problem.wanted_k
    k = wanted if candidate.is_solved else solution.safety_factor
    return problem.preference.compute_loss(solution.effort, k, wanted)


def _solve_from(
    start: Start, candidate: Candidate, problem: Problem, settings: FocConfig, costs: CostModel, deadline: Deadline
) -> PredictedCandidate:
    """Solve from a start; find the class in which the solution is, and its cost. The status says if it left the candidate's."""
    solution = solve_problem(problem, start, settings, deadline)
    sides = find_path_sides(solution.path, problem.obstacles, problem.centre_trajectories)
    if solution.status.has_likelihood and any(sides.get(identity, side) != side for identity, side in candidate.sides):
        solution = replace(solution, status=Status.LEFT_CLASS, message='the solution moved into another homotopy class')
    return PredictedCandidate(candidate, solution, sides, costs.compute_cost(solution), 0.0)


def drop_duplicates(candidates: Sequence[PredictedCandidate]) -> list[PredictedCandidate]:
    """Drop candidates that moved into a class that another candidate solved, so that no class is counted twice."""
    if all(each.status is not Status.LEFT_CLASS for each in candidates):
        return list(candidates)
    solved = {_identify_class(each) for each in candidates if each.has_likelihood}
    return [each for each in candidates if each.status is not Status.LEFT_CLASS or _identify_class(each) not in solved]


def _identify_class(candidate: PredictedCandidate) -> tuple[int, frozenset[tuple[str, int]]]:
    return candidate.candidate.goal, frozenset(candidate.sides.items())


def rank_candidates(
    candidates: Sequence[PredictedCandidate], config: Config, obstacles: Obstacles, hand: HandState, goals: Array
) -> tuple[list[PredictedCandidate], Choice | None]:
    """Return the distinct candidates: solved and compromised ones, most likely first, then the others, with likelihood 0.

    obstacles: grown by the radius of the hand; goals (g, 2) [m]. The choice is that between the candidates with a likelihood,
    None where there are fewer than two or nothing is learnt from choices.
    """
    candidates, likelihood = drop_duplicates(candidates), config.likelihood
    taken = [each for each in candidates if each.has_likelihood]
    is_learnt = likelihood.adaptation == ONLINE
    time_s = min((float(each.solution.times[-1]) for each in taken), default=0.0)
    may_look_ahead = is_learnt or compute_lookahead_share(time_s, likelihood) > 0.0
    branch_times = compute_branch_times(taken, obstacles) if may_look_ahead and likelihood.lookahead_s > 0.0 else None
    costs, shortfalls = (np.array(each) for each in ([c.cost for c in taken], [c.solution.safety_shortfall for c in taken]))
    reaches = make_reaches(taken, goals, hand, config)
    decisions = choice = None
    if len(taken) > 1 and (may_look_ahead or likelihood.weaving > 0.0):
        goal, sides = np.array([each.candidate.goal for each in taken], dtype=np.intp), tuple(each.sides for each in taken)
        decisions = find_decisions(tabulate_sides([each.solution for each in taken], obstacles), goal, obstacles, hand, goals)
        if is_learnt:
            made = hand.stamp_ns, hand.onset_ns, obstacles, goals
            choice = Choice(*made, goal, sides, costs, shortfalls, branch_times, decisions, time_s, reaches)
    shares = compute_likelihoods(costs, likelihood, branch_times, shortfalls, decisions, time_s, reaches)
    pairs = zip(taken, shares.tolist(), strict=True)
    ranked = [replace(each, likelihood=share) for each, share in pairs]
    ranked.sort(key=lambda each: (-each.likelihood, each.label))
    return ranked + [each for each in candidates if not each.has_likelihood], choice
