"""One reaching problem as the paper poses it: every homotopy class of a scene, or the class of a guess, solved once."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Protocol

from .candidates import rank_candidates, solve_candidates
from .config import Config
from .dynamics.replanning import triple_integrator_error_map
from .estimation.duration import is_passing
from .homotopy import path_sides, search
from .ocp.problem import Problem
from .predictor import build_problem
from .types import LEFT, Array, Candidate, HandState, Obstacles, PredictedCandidate


class ReachingScene(Protocol):
    """What a scene has to provide: start state, goals (g, 2) [m], obstacles, noise (2,) per step, a guess (N + 1, 2) or None."""

    @property
    def hand(self) -> HandState: ...  # noqa: D102
    @property
    def goals(self) -> Array: ...  # noqa: D102
    @property
    def obstacles(self) -> Obstacles: ...  # noqa: D102
    @property
    def noise(self) -> Array: ...  # noqa: D102
    @property
    def guess(self) -> Array | None: ...  # noqa: D102
    @property
    def config(self) -> Config: ...  # noqa: D102


def scene_problems(scene: ReachingScene) -> list[Problem]:
    """Return the problem of every goal.

    The noise is per step, as the scene gives it. The uncertainty of the start state is also that of the operator.
    """
    config, duration_s = scene.config, scene.config.duration.fixed_s
    steps, covariance = config.foc.steps, scene.hand.covariance
    error_map = triple_integrator_error_map(duration_s / steps, steps, is_passing(config.duration))
    problems = [build_problem(config, scene.hand, scene.obstacles, goal, duration_s) for goal in scene.goals]
    return [replace(each, noise=scene.noise, initial_covariance=covariance, error_map=error_map) for each in problems]


def solve_scene(scene: ReachingScene, problems: Sequence[Problem]) -> list[PredictedCandidate]:
    """Solve the class of the guess or, without a guess, the classes that the search finds.

    problems: one for every goal. Returns solved candidates first, most likely first.
    """
    config = scene.config
    if scene.guess is None:
        durations = [config.duration.fixed_s] * len(scene.goals)
        task = scene.hand.mean, scene.goals, scene.obstacles, config.homotopy, durations, config.foc.steps
        candidates = search(*task).candidates
    else:
        candidates = (_build_guessed_candidate(scene.guess, scene.obstacles),)
    solved = solve_candidates(candidates, [problems[each.goal] for each in candidates], config.foc, config.likelihood)
    return rank_candidates(solved, config.likelihood, scene.obstacles)


def _build_guessed_candidate(guess: Array, obstacles: Obstacles) -> Candidate:
    sides = tuple(sorted(path_sides(guess, obstacles).items()))
    label = 'goal0:' + ''.join(('+' if side == LEFT else '-') + name for name, side in sides)
    return Candidate(label, 0, sides, guess, 0.0)
