"""The scenes that are measured. They are those of the tests."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from foc_ros.core.ocp.problem import Problem
from foc_ros.core.types import Array, Solution

from .page import ROOT

sys.path.append(str(ROOT / 'test'))

import reach_helpers  # type: ignore[import-not-found]
import varied_reaches  # type: ignore[import-not-found]


@dataclass(frozen=True, eq=False)
class Scene:
    """A reach: its problem as a function of the wanted eta, and a guess (N + 1, 2) [m] from which it is solved."""

    name: str
    problem: Callable[[float], Problem]
    guess: Array

    def solve(self, eta: float, strategy: str, **settings: float) -> Solution:
        """Solve the problem of an eta by a strategy."""
        return solve(self.problem(eta), self.guess, strategy, **settings)


def solve(problem: Problem, guess: Array, strategy: str, **settings: float) -> Solution:
    """Solve a problem from a guess (N + 1, 2) [m]."""
    solution: Solution = reach_helpers.solved(problem, guess, strategy, **settings)
    return solution


def build_one_obstacle(noise: float, steps: int = 50) -> Scene:
    """Return a reach of 0.3 m in 1 s past one obstacle near the straight line, with a radius of 30 mm ± 3 mm."""
    guess = reach_helpers.bowed((0, 0), (0.3, 0), steps, 0.05)
    return Scene('one obstacle', lambda eta: reach_helpers.one_obstacle(eta, (noise, noise), steps=steps), guess)


def build_random(seed: int, noise: float, steps: int = 50) -> Scene:
    """Return a reach of 0.28 to 0.45 m in 1 s among one to four random obstacles."""
    obstacles, goal, amplitude = reach_helpers.random_scene(np.random.default_rng(seed))

    def build_problem(eta: float) -> Problem:
        problem: Problem = reach_helpers.reach(obstacles, goal=goal, steps=steps, noise=(noise, noise), eta=eta)
        return problem

    return Scene(f'random {seed}', build_problem, reach_helpers.bowed((0, 0), goal, steps, amplitude))


def build_varied() -> tuple[Any, ...]:
    """Return two hundred random reaches with all features of the chance constraint, each with a wanted eta."""
    reaches: tuple[Any, ...] = varied_reaches.feasible_reaches()
    return reaches


def load_reference_cases() -> list[tuple[dict[str, Any], Problem, Array]]:
    """Return ten cases with the answers of independent solvers, each with its problem and guess."""
    cases = json.loads((ROOT / 'test' / 'reference_cases.json').read_text(encoding='utf-8'))
    return [(case, reach_helpers.case_problem(case), reach_helpers.case_guess(case)) for case in cases]


def load_reference_shapes() -> list[tuple[dict[str, Any], Problem, Array]]:
    """Return the same for ten scenes of boxes, capsules, hulls and circles."""
    cases = json.loads((ROOT / 'test' / 'reference_shapes.json').read_text(encoding='utf-8'))
    return [(case, reach_helpers.shapes_problem(case), reach_helpers.case_guess(case)) for case in cases]
