"""The scenes that are measured: those of the tests."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from foc_ros.core.ocp.problem import Problem
from foc_ros.core.types import Array, Solution

ROOT = Path(__file__).resolve().parents[2]
sys.path.append(str(ROOT / 'test'))

import reach_helpers  # type: ignore[import-not-found]  # noqa: E402
import varied_reaches  # type: ignore[import-not-found]  # noqa: E402


@dataclass(frozen=True, eq=False)
class Scene:
    """A reach whose wanted eta is left open, and a guess (N + 1, 2) [m] to solve it from."""

    name: str
    problem: Callable[[float], Problem]
    guess: Array

    def solved(self, eta: float, strategy: str, **settings: float) -> Solution:
        """Solve it for an eta by a strategy."""
        return solved(self.problem(eta), self.guess, strategy, **settings)


def solved(problem: Problem, guess: Array, strategy: str, **settings: float) -> Solution:
    """Solve a problem from a guess (N + 1, 2) [m]."""
    solution: Solution = reach_helpers.solved(problem, guess, strategy, **settings)
    return solution


def one_obstacle(noise: float, steps: int = 50) -> Scene:
    """One obstacle, 3 cm and 3 mm of doubt, a little off the straight way of 0.3 m in 1 s."""
    guess = reach_helpers.bowed((0, 0), (0.3, 0), steps, 0.05)
    return Scene('one obstacle', lambda eta: reach_helpers.one_obstacle(eta, (noise, noise), steps=steps), guess)


def random_scene(seed: int, noise: float, steps: int = 50) -> Scene:
    """One to four obstacles at random, 0.28 to 0.45 m in 1 s."""
    obstacles, goal, amplitude = reach_helpers.random_scene(np.random.default_rng(seed))

    def problem(eta: float) -> Problem:
        made: Problem = reach_helpers.reach(obstacles, goal=goal, steps=steps, noise=(noise, noise), eta=eta)
        return made

    return Scene(f'random {seed}', problem, reach_helpers.bowed((0, 0), goal, steps, amplitude))


def feasible_reaches() -> tuple[Any, ...]:
    """Two hundred reaches of every kind, with the eta each is asked for."""
    reaches: tuple[Any, ...] = varied_reaches.feasible_reaches()
    return reaches


def reference_cases() -> list[tuple[dict[str, Any], Problem, Array]]:
    """Ten scenes with the answers of independent solvers, each with its problem and guess; none where the folder is absent."""
    if not reach_helpers.REFERENCE.is_file():
        return []
    cases = json.loads(reach_helpers.REFERENCE.read_text(encoding='utf-8'))
    return [(case, reach_helpers.case_problem(case), reach_helpers.case_guess(case)) for case in cases]
