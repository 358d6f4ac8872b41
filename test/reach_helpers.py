# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Reaching problems for the tests of the numeric core."""

import json
from pathlib import Path

import numpy as np
import pytest

import foc_ros
from foc_ros.core.config import Config, FocConfig
from foc_ros.core.obstacle_table import Obstacles, make_obstacles
from foc_ros.core.obstacles.shapes import Box, Capsule, Circle, Hull, Shape, collect_obstacles
from foc_ros.core.ocp.problem import Problem, rest_to_goal
from foc_ros.core.ocp.solve import solve_problem
from foc_ros.core.ocp.start import cold_start
from foc_ros.core.plant.plants import build_triple_integrator_horizon
from foc_ros.core.solution import Solution

REFERENCE = Path(__file__).with_name('reference_cases.json')
REFERENCE_SHAPES = Path(__file__).with_name('reference_shapes.json')
MORE_REFERENCE = Path(__file__).resolve().parents[2] / 'shared' / 'reference' / 'cases.json'

KINDS = {'': Circle, 'box': Box, 'capsule': Capsule, 'circle': Circle, 'hull': Hull}


def reference_cases() -> list:
    """Return the reference cases as pytest parameters: ours, and those of an optional folder, skipped where it is absent."""
    files = {name: file for name, file in (('case', REFERENCE), ('shared', MORE_REFERENCE)) if file.is_file()}
    found = {name: json.loads(file.read_text('utf-8')) for name, file in files.items()}
    cases = [pytest.param(case, id=f'{name}{row}') for name, given in found.items() for row, case in enumerate(given)]
    if 'shared' not in found:
        absent = pytest.mark.skip(reason='optional data: ../shared/reference/cases.json is absent')
        cases.append(pytest.param({}, id='shared', marks=absent))
    return cases


def bowed(start, goal, steps: int, amplitude: float) -> np.ndarray:
    """Minimum-jerk straight line plus amplitude sin(pi k / N) to the left, (N + 1, 2)."""
    start, goal = np.asarray(start, dtype=float), np.asarray(goal, dtype=float)
    s = np.arange(steps + 1)[:, None] / steps
    along = (goal - start) / np.hypot(*(goal - start))
    left = np.array([-along[1], along[0]])
    return start + (goal - start) * (10 * s**3 - 15 * s**4 + 6 * s**5) + amplitude * np.sin(np.pi * s) * left


def case_problem(case: dict, eta: float | None = None) -> Problem:
    """Return the problem of a reference case; an obstacle without a kind is a circle."""
    return reach(
        collect_obstacles([make_shape(**each) for each in case['obstacles']]),
        goal=case['goal'],
        steps=case['steps'],
        duration=case['duration_s'],
        noise=case['noise'],
        eta=case['min_effort_at_eta']['eta'] if eta is None else eta,
    )


def make_shape(kind: str = '', **fields) -> Shape:
    if not kind:
        fields['centre'] = fields.pop('x'), fields.pop('y')
    return KINDS[kind](**fields)


def case_guess(case: dict) -> np.ndarray:
    return bowed(case['start'], case['goal'], case['steps'], case['guess']['amplitude'])


def make_predictor(config: Config, goals, obstacles=None) -> foc_ros.Predictor:
    predictor = foc_ros.Predictor(config)
    predictor.set_goals(goals)
    if obstacles is not None:
        predictor.set_obstacles(obstacles)
    return predictor


def reach(
    obstacles: Obstacles, goal=(0.3, 0.0), start=(0.0, 0.0), steps=50, duration=1.0, noise=(0.15, 0.15), eta=0.9, **rest
) -> Problem:
    initial = np.zeros(6)
    initial[:2] = start
    horizon = build_triple_integrator_horizon(duration / steps, steps)
    return rest_to_goal(horizon, initial, np.asarray(goal, dtype=float), obstacles, np.asarray(noise, dtype=float), eta, **rest)


def one_obstacle(eta=0.9, noise=(0.15, 0.15), **rest) -> Problem:
    """One obstacle at (0.12, 0) on the straight way from (0, 0) to (0.3, 0)."""
    return reach(make_obstacles([[0.12, 0.0]], [0.03], [0.003]), eta=eta, noise=noise, **rest)


def solved(problem: Problem, guess: np.ndarray, strategy: str = 'lv', **settings) -> Solution:
    return solve_problem(problem, cold_start(guess), FocConfig(strategy=strategy, **settings))


def random_scene(generator: np.random.Generator, obstacles: int | None = None) -> tuple[Obstacles, np.ndarray, float]:
    """Return obstacles, a goal and the amplitude of a guess, of the kind of the reference cases."""
    n = int(generator.integers(1, 5)) if obstacles is None else obstacles
    goal = np.array([generator.uniform(0.28, 0.45), 0.0])
    centre = np.stack((goal[0] * generator.uniform(0.3, 0.7, n), generator.uniform(-0.07, 0.07, n)), axis=1)
    made = make_obstacles(centre, generator.uniform(0.017, 0.03, n), generator.uniform(0.001, 0.0035, n))
    return made, goal, float(generator.choice([-1, 1]) * generator.uniform(0.03, 0.12))


def random_reach(generator: np.random.Generator, **options) -> tuple[Problem, np.ndarray]:
    """Return the problem of a random scene, and a guess; options: of `reach`."""
    obstacles, goal, amplitude = random_scene(generator)
    problem = reach(obstacles, goal=goal, **options)
    return problem, bowed((0, 0), goal, problem.horizon.steps, amplitude)
