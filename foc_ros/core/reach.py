# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The solution of one reach in a scene of known duration, without memory: what `solve` and scene files ask for."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from .candidates import find_all_sides, rank_candidates, solve_candidates
from .classes import SearchOrder, search
from .classes.library import GuessTiming
from .hand.duration import is_passing
from .ocp.problem import Problem
from .plant.models import make_plant_model
from .prediction import PredictedCandidate
from .scene import ReachingScene
from .situation import build_problem, take_in_the_way
from .solution import Candidate, label_class
from .types import Array


def build_scene_problems(scene: ReachingScene) -> list[Problem]:
    """Return the problem of every goal. An uncertain start is as uncertain to the operator, so it counts in the constraint."""
    config = scene.config
    in_the_way = take_in_the_way(scene.avoided, scene.goals, [scene.duration_s] * len(scene.goals), scene.goal_objects)
    problems = [
        build_problem(config, scene.hand, around, goal, scene.duration_s)
        for around, goal in zip(in_the_way, scene.goals, strict=True)
    ]
    if scene.noise is not None:
        problems = [replace(problem, noise=scene.noise) for problem in problems]
    if not scene.hand.covariance.any():
        return problems
    plant, steps = make_plant_model(config.foc), config.foc.steps
    error_map = plant.compute_error_map(scene.duration_s / steps, steps, is_passing(config.duration))
    covariance = plant.project_covariance(scene.hand.covariance)
    return [replace(problem, initial_covariance=covariance, error_map=error_map) for problem in problems]


def solve_scene(scene: ReachingScene, problems: Sequence[Problem]) -> list[PredictedCandidate]:
    """Solve the class of the guess, or the classes that are found; solved ones come first, the most likely first.

    problems: of every goal, from `build_scene_problems`.
    """
    config, avoided = scene.config, scene.avoided
    if scene.guess is not None:
        candidates: tuple[Candidate, ...] = (_make_guessed_candidate(scene.guess, problems[0]),)
    else:
        timing = GuessTiming([scene.duration_s] * len(scene.goals), config.foc.steps)
        order = SearchOrder(objects=scene.goal_objects)
        candidates = search(scene.hand.mean, scene.goals, avoided, config.homotopy, *timing, (), order).candidates
    solved = solve_candidates(candidates, [problems[each.goal] for each in candidates], config.foc)
    ranked = rank_candidates(solved, config.likelihood, avoided, scene.hand, scene.goals)
    return [each.with_goal_name(scene.goal_names[each.candidate.goal]) for each in ranked] if scene.goal_names else ranked


def _make_guessed_candidate(guess: Array, problem: Problem) -> Candidate:
    sides = tuple(sorted(find_all_sides([guess], [problem])[0].items()))
    return Candidate(label_class(0, sides), 0, sides, guess, 0.0)
