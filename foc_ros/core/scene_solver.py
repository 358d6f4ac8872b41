"""The solution of one reaching scene: the class of its guess, or all classes that are found."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from .candidates import rank_candidates, solve_candidates
from .classes import find_path_sides, search
from .dynamics.plant_models import make_plant_model
from .estimation.duration import is_passing
from .ocp.problem import Problem
from .predictor import build_problem
from .reaching_scene import ReachingScene
from .types import LEFT, Array, Candidate, Obstacles, PredictedCandidate


def build_scene_problems(scene: ReachingScene) -> list[Problem]:
    """Return the problem of every goal. An uncertain start is as uncertain to the operator, so it counts in the constraint."""
    config = scene.config
    problems = [build_problem(config, scene.hand, scene.avoided, goal, scene.duration_s) for goal in scene.goals]
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
        candidates: tuple[Candidate, ...] = (_make_guessed_candidate(scene.guess, avoided),)
    else:
        durations = [scene.duration_s] * len(scene.goals)
        candidates = search(scene.hand.mean, scene.goals, avoided, config.homotopy, durations, config.foc.steps).candidates
    solved = solve_candidates(candidates, [problems[each.goal] for each in candidates], config.foc)
    return rank_candidates(solved, config.likelihood, avoided, scene.hand, scene.goals)


def _make_guessed_candidate(guess: Array, obstacles: Obstacles) -> Candidate:
    sides = tuple(sorted(find_path_sides(guess, obstacles).items()))
    label = 'goal0:' + ''.join(('+' if side == LEFT else '-') + identity for identity, side in sides)
    return Candidate(label, 0, sides, guess, 0.0)
