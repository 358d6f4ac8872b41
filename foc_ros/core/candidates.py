# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""From candidates to likelihoods: each is solved, its real class is found, duplicates are dropped, the rest is ranked."""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence
from dataclasses import replace

import numpy as np

from .classes.rows import find_decisions, tabulate_sides
from .classes.sides import compute_branch_times, find_sides, measure_passages
from .config import FocConfig, LikelihoodConfig
from .deadline import NEVER, Deadline
from .likelihood import BETWEEN_OPERATORS, ClassGoals, compute_likelihoods, compute_lookahead_share
from .obstacle_table import Obstacles
from .obstacles.clearance import is_free, measure_clearance
from .obstacles.risk import centre_trajectories
from .ocp.problem import Problem, group_by_response
from .ocp.solve import solve_problems
from .ocp.start import Start, cold_start, warm_start
from .prediction import PredictedCandidate
from .solution import Candidate, Solution, Status, label_class
from .types import Array, HandState, as_readonly

FAILED = (Status.LEFT_CLASS, Status.ITERATION_LIMIT, Status.INFEASIBLE)
"""What a solver says of classes that it could not solve."""
SHORTEST_M = 1e-6
"""Lower limit of a distance in ratios [m]: a micrometre."""
NO_NUMBER = 2**31
"""In place of the number of a class that is not followed: larger than all of them."""
LEFT_BEHIND = 3.0
"""Cost of an earlier solution from where the hand is now, relative to its cost then, above which the hand has left it."""
DETOUR = 64.0 / 9.0
"""Effort of going aside over that of going straight, see `compute_detour_effort`."""


def solve_candidates(
    candidates: Sequence[Candidate],
    problems: Sequence[Problem],
    settings: FocConfig,
    earlier: Sequence[Solution | None] | None = None,
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
        The solution of the prediction before of each, from which its class is followed, None where there is none.
    deadline
        When the solutions have to be ready. A class that is not ready then has an estimate, and says so.
    """
    before = [None] * len(candidates) if earlier is None else earlier
    starts = _begin(candidates, problems, before)
    solutions = solve_problems(problems, starts, settings, deadline)
    sides = find_all_sides([each.path for each in solutions], problems)
    return [_classify(*each) for each in zip(candidates, solutions, sides, strict=True)]


def _begin(candidates: Sequence[Candidate], problems: Sequence[Problem], earlier: Sequence[Solution | None]) -> list[Start]:
    """Return the earlier solution of each candidate as its start, or its guess.

    An earlier solution is no start if it passes an obstacle on another side, or if the hand has left it.
    """
    starts = [cold_start(each.guess) for each in candidates]
    for rows in group_by_response(problems):
        known = {row: solution for row in rows if (solution := earlier[row]) is not None}
        for row, start in zip(known, warm_start(list(known.values()), [problems[row] for row in known]), strict=True):
            control, solution = start.control, known[row]
            if control is None or control @ control * problems[row].horizon.dt <= LEFT_BEHIND * solution.effort * solution.dt:
                starts[row] = start
    sides = find_all_sides([each.path for each in starts], problems)
    return [
        start if each.contains(found) else cold_start(each.guess)
        for each, start, found in zip(candidates, starts, sides, strict=True)
    ]


def find_all_sides(paths: Sequence[Array], problems: Sequence[Problem]) -> list[dict[str, int]]:
    """Return the sides on which the path of each problem passes its obstacles, for all paths among the same obstacles at once."""
    found: dict[int, dict[str, int]] = {}
    for obstacles in {id(each.obstacles): each.obstacles for each in problems}.values():
        rows = [row for row, each in enumerate(problems) if each.obstacles is obstacles]
        centres = np.stack([problems[row].centre_trajectories for row in rows])
        found |= zip(rows, find_sides(np.stack([paths[row] for row in rows]), obstacles, centres), strict=True)
    return [found[row] for row in range(len(problems))]


def is_there(candidate: Candidate, solution: Solution, obstacles: Obstacles) -> bool:
    """Tell whether an earlier solution is still a path of its class, among the obstacles of now.

    The obstacles in the name of the class are there, the path passes them on its sides, and no obstacle blocks it. The path of an
    estimate may lead through an obstacle.
    """
    if not {name for name, _ in candidate.sides} <= set(obstacles.ids):
        return False
    centres = centre_trajectories(obstacles.centre, obstacles.velocity * solution.dt, len(solution.control))
    sides = find_sides(solution.path[None], obstacles, centres)[0]
    return candidate.contains(sides) and (solution.status.is_estimate or is_free(solution.path, obstacles, solution.dt))


def _classify(candidate: Candidate, solution: Solution, sides: dict[str, int]) -> PredictedCandidate:
    """Return a candidate with its solution, which passes obstacles on some sides. The status says if it left its class."""
    if solution.status.has_likelihood and not candidate.contains(sides):
        solution = replace(solution, status=Status.LEFT_CLASS, message='the solution moved into another homotopy class')
    return PredictedCandidate(candidate, solution, sides, solution.effort * solution.dt, 0.0)


def estimate_unsolved(
    candidates: Sequence[PredictedCandidate], in_the_way: Sequence[Obstacles], begun: Collection[int] = ()
) -> list[PredictedCandidate]:
    """Return the candidates with an estimate for those that the solver could not solve although the search has a path for them.

    The path is what the solver found, if it is in the class, or the guess of the search. Effort and safety follow from a similar
    class that is solved (`find_similar`). A class without a path, such as one that an obstacle closes on the way, stays as it is.
    in_the_way: the obstacles on the way to each goal, grown by the radius of the hand; begun: numbers of the classes for which
    there was time for one step from a guess only. The lengths of the paths tell more than such a step. If all classes are like
    this, the one of the least cost is the similar one.
    """
    answered = [each for each in candidates if each.has_likelihood]
    solved = [each for each in answered if each.way not in begun] or sorted(answered, key=lambda each: each.cost)[:1]
    return [
        _estimate(each, find_similar(each.candidate, solved))
        if solved and (each.status in FAILED or each.way in begun) and _has_path(each, in_the_way[each.candidate.goal])
        else each
        for each in candidates
    ]


def compute_detour_effort(length: float, distance: float) -> float:
    """Return the effort of a detour of a length [m] from rest to rest over a distance [m], up to a factor [m^2].

    Aside of the straight way by A half way, and not at rest there, it needs 720 (D^2 + 256 A^2 / 9) / T^5, and its shortest path
    is L = sqrt(D^2 + 4 A^2) long, so that this is proportional to D^2 + 64 (L^2 - D^2) / 9.
    """
    straight = max(distance, SHORTEST_M) ** 2
    return straight + DETOUR * max(length**2 - straight, 0.0)


def find_similar(candidate: Candidate, solved: Sequence[PredictedCandidate]) -> PredictedCandidate:
    """Return the solved candidate by which the effort of another one is estimated: of those to the same goal, the most similar.

    If there are none to its goal, all are compared.
    """

    def measure(other: PredictedCandidate) -> tuple[bool, float]:
        return other.candidate.goal != candidate.goal, abs(math.log(compare_efforts(candidate, other)))

    return min(solved, key=measure)


def compare_efforts(candidate: Candidate, other: PredictedCandidate) -> float:
    """Return the effort of a class relative to that of another one, as their shortest paths lead to expect."""
    return compute_detour_effort(*_measure(candidate)) / compute_detour_effort(*_measure(other.candidate))


def _measure(candidate: Candidate) -> tuple[float, float]:
    """Return the length of the shortest path of a class, and the straight distance to its goal [m]."""
    return candidate.length, math.dist(candidate.guess[0], candidate.guess[-1])


def _has_path(candidate: PredictedCandidate, obstacles: Obstacles) -> bool:
    """Tell whether the guess of the search is a path between the obstacles, whatever the solver says."""
    solution = candidate.solution
    if candidate.status is not Status.INFEASIBLE:
        return True
    # at the steps: the lines between them cut corners
    return measure_clearance(candidate.candidate.guess, obstacles, solution.dt, parts=1) >= 0.0


def _estimate(candidate: PredictedCandidate, known: PredictedCandidate) -> PredictedCandidate:
    """Return a candidate with a path in its class, and the effort and safety that a similar one leads to expect."""
    failed = candidate.solution
    effort = compare_efforts(candidate.candidate, known) * known.cost / failed.dt
    mean = failed.mean
    if not candidate.candidate.contains(candidate.sides):
        mean = _derive_states(candidate.candidate.guess, failed.dt, mean.shape[1])
        mean[0] = failed.mean[0]
        mean = as_readonly(mean)
    safety = known.solution.eta, known.solution.safety_factor, known.solution.safety_shortfall
    estimated = replace(
        failed,
        status=failed.status if failed.status is Status.DEADLINE else Status.ESTIMATED,
        message=f'{failed.message}; its effort follows from the length of its path',
        mean=mean,
        effort=effort,
        eta=safety[0],
        safety_factor=safety[1],
        safety_shortfall=safety[2],
    )
    return replace(candidate, solution=estimated, sides=dict(candidate.candidate.sides), cost=effort * failed.dt)


def _derive_states(path: Array, dt: float, size: int) -> Array:
    """Return positions on a path (N + 1, 2) [m] at steps of dt [s], and their derivatives: states (N + 1, size)."""
    states = [path]
    for _ in range(size // 2 - 1):
        states.append(np.gradient(states[-1], dt, axis=0))
    return np.concatenate(states, axis=1)


def estimate_unfollowed(
    unfollowed: Sequence[Candidate], answered: Sequence[PredictedCandidate], durations_s: Sequence[float]
) -> list[PredictedCandidate]:
    """Return the classes that the search has seen and that are no candidates, each with an estimated effort and safety.

    The estimate follows from the candidate that costs most for the length of its path (`compare_efforts`): classes that are not
    followed have the longest paths, with turns that cost more than their length tells. These classes are ranked with the
    candidates by the same rule, for which their means are the positions alone, and what they get is the unknown share.

    Parameters
    ----------
    unfollowed
        The classes.
    answered
        The candidates. Where none of them has a likelihood, nothing can be estimated.
    durations_s
        Time to go to each goal [s].
    """
    known, names = [each for each in answered if each.has_likelihood], {each.label for each in answered}
    if not known:
        return []
    estimated = []
    reference = max(known, key=lambda each: each.cost / compute_detour_effort(*_measure(each.candidate)))
    for candidate in [each for each in unfollowed if each.label not in names]:
        dt = durations_s[candidate.goal] / (len(candidate.guess) - 1)
        cost = compare_efforts(candidate, reference) * reference.cost
        solution = replace(
            reference.solution,
            status=Status.ESTIMATED,
            message='not followed',
            dt=dt,
            mean=candidate.guess,
            effort=cost / dt,
        )
        estimated.append(PredictedCandidate(candidate, solution, dict(candidate.sides), cost, 0.0, way=NO_NUMBER))
    return estimated


def drop_duplicates(candidates: Sequence[PredictedCandidate]) -> list[PredictedCandidate]:
    """Return the candidates, and of those whose paths are in one class only one, so that no class is counted twice.

    The solver has moved a path into another class, or the obstacle that told two classes apart moves out of the way.
    """
    alike: dict[tuple[int, frozenset[tuple[str, int]]], list[PredictedCandidate]] = {}
    for each in candidates:
        if each.has_likelihood:
            alike.setdefault(_identify_class(each), []).append(each)
    others = [
        each
        for each in candidates
        if not each.has_likelihood and not (each.status is Status.LEFT_CLASS and _identify_class(each) in alike)
    ]
    return [*map(_merge, alike.values()), *others]


def _merge(alike: Sequence[PredictedCandidate]) -> PredictedCandidate:
    """Return one of the solutions in one class: the newest one, of the followed ones if there are any.

    Where there are several, the name that it gets contains only the obstacles that its path passes.
    """
    newest = min(alike, key=lambda each: (each.way == NO_NUMBER, each.age_s))
    if len(alike) == 1:
        return newest
    sides = tuple(each for each in newest.candidate.sides if each[0] in newest.sides)
    named = replace(newest.candidate, sides=sides, label=label_class(newest.candidate.goal, sides))
    return replace(newest, candidate=named, way=min(each.way for each in alike))


def _identify_class(candidate: PredictedCandidate) -> tuple[int, frozenset[tuple[str, int]]]:
    return candidate.candidate.goal, frozenset(candidate.sides.items())


def rank_candidates(
    candidates: Sequence[PredictedCandidate],
    config: LikelihoodConfig,
    obstacles: Obstacles,
    hand: HandState,
    goals: Array,
    planning_spread: float = BETWEEN_OPERATORS,
    weights: Array | None = None,
) -> list[PredictedCandidate]:
    """Return the distinct candidates: solved and compromised ones, most likely first, then the others, with likelihood 0.

    obstacles: grown by the radius of the hand; goals (g, 2) [m]; planning_spread: as in `compute_likelihoods`; weights (g,):
    factors on the likelihoods of the goals.
    """
    candidates = drop_duplicates(candidates)
    taken = [each for each in candidates if each.has_likelihood]
    time_s = min((float(each.solution.times[-1]) for each in taken), default=0.0)
    looks_ahead = compute_lookahead_share(time_s, config, planning_spread) > 0.0
    passages = measure_passages([each.solution for each in taken], obstacles) if looks_ahead or config.weaving > 0.0 else None
    branch_times = compute_branch_times(passages) if passages is not None and looks_ahead and config.lookahead_s > 0.0 else None
    costs, shortfalls = (np.array(each) for each in ([c.cost for c in taken], [c.solution.safety_shortfall for c in taken]))
    decisions, goal = None, np.array([each.candidate.goal for each in taken], dtype=np.intp)
    if len(taken) > 1 and passages is not None:
        decisions = find_decisions(tabulate_sides(passages), goal, obstacles, hand, goals)
    among = ClassGoals(goal, weights) if len(goals) > 1 else None
    shares = compute_likelihoods(costs, config, branch_times, shortfalls, decisions, time_s, planning_spread, among)
    ranked = [replace(each, likelihood=share) for each, share in zip(taken, shares.tolist(), strict=True)]
    ranked.sort(key=lambda each: (-each.likelihood, each.label))
    return ranked + [each for each in candidates if not each.has_likelihood]


def split_unknown(ranked: Sequence[PredictedCandidate], unfollowed: Collection[str]) -> tuple[list[PredictedCandidate], float]:
    """Return the candidates among ranked classes, with likelihoods that sum to one, and the share of the other classes.

    unfollowed: labels of these other classes. Their share is 1 where no candidate has a likelihood.
    """
    followed = [each for each in ranked if each.label not in unfollowed]
    known = sum(each.likelihood for each in followed)
    if known <= 0.0:
        return followed, 1.0
    unknown = sum(each.likelihood for each in ranked if each.label in unfollowed)
    return [replace(each, likelihood=each.likelihood / known) for each in followed], unknown
