"""One reaching scene, solved as the paper poses it: a known start, goals and a duration, without a movement before it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from .candidates import rank_candidates, solve_candidates
from .config import Config
from .dynamics.plant_models import make_plant_model
from .errors import SceneError
from .estimation.duration import is_passing
from .homotopy import find_path_sides, search
from .obstacles.rounded_polygon import measure_offsets
from .ocp.problem import Problem
from .predictor import build_problem
from .types import LEFT, Array, Candidate, HandState, Obstacles, PredictedCandidate, Record


@dataclass(frozen=True, eq=False)
class ReachingScene(Record):
    """One reaching problem.

    hand: where it starts; goals (g, 2) [m]; obstacles; noise (2,): c per step, None for the parameters' noise scaled to the step;
    guess (N + 1, 2) [m]: path in the only class to be solved, None to search the classes; config: parameters, of which
    `duration.fixed_s` is the duration.
    """

    hand: HandState
    goals: Array
    obstacles: Obstacles
    noise: Array | None
    guess: Array | None
    config: Config

    @property
    def avoided(self) -> Obstacles:
        """The obstacles that the centre of the hand has to avoid: those of the scene, larger by the radius of the hand."""
        return self.obstacles.grow(self.config.scene.hand_radius)

    @property
    def duration_s(self) -> float:
        """Duration of the movement [s]."""
        return self.config.duration.fixed_s


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
    return rank_candidates(solved, config.likelihood, avoided, scene.hand, scene.goals)[0]


def _make_guessed_candidate(guess: Array, obstacles: Obstacles) -> Candidate:
    sides = tuple(sorted(find_path_sides(guess, obstacles).items()))
    label = 'goal0:' + ''.join(('+' if side == LEFT else '-') + identity for identity, side in sides)
    return Candidate(label, 0, sides, guess, 0.0)


def check_outside(field: str, point: Array, obstacles: Obstacles) -> None:
    """Raise SceneError, which names the field, if a point (2,) [m] lies inside the mean boundary of an obstacle."""
    distances = measure_offsets(point, obstacles)[1][0]
    for row in np.flatnonzero(distances < obstacles.radius)[:1]:
        found = f'{point.tolist()}, {distances[row]:.4g} m from its polygon'
        raise SceneError(field, f'a point outside obstacle {obstacles.ids[row]}, of radius {obstacles.radius[row]:g} m', found)
