# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""All classes of a scene solved together: as each alone, the same each time, and as good as independent solvers."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from reach_helpers import reach

from foc_ros.core.classes import find_path_sides, search
from foc_ros.core.config import FocConfig, HomotopyConfig
from foc_ros.core.obstacle_table import Obstacles, make_obstacles
from foc_ros.core.obstacles.shapes import Box, Capsule, Circle, collect_obstacles
from foc_ros.core.ocp.problem import Problem
from foc_ros.core.ocp.solve import solve_problem, solve_problems
from foc_ros.core.ocp.solver import LARGEST_TOLERANCE
from foc_ros.core.ocp.start import cold_start
from foc_ros.core.safety_preference import SafetyPreference
from foc_ros.core.solution import Candidate, Solution, Status

REFERENCE = Path(__file__).resolve().parents[2] / 'shared' / 'reference' / 'random_shapes.json'
PREFERENCE = SafetyPreference(beta=2.0, shortfall=6.0)
SCENES = {
    'circles': [Circle((0.1, 0.01), 0.02, 0.002), Circle((0.17, -0.03), 0.025), Circle((0.2, 0.05), 0.02, velocity=(0.0, -0.02))],
    'boxes': [Box((0.12, 0.03), (0.04, 0.03), 0.4, 0.005), Box((0.19, -0.02), (0.02, 0.05), centre_stddev=0.001)],
    'mixed': [Circle((0.08, 0.0), 0.02), Capsule((0.15, 0.04), (0.19, 0.07), 0.01, 0.001), Box((0.2, -0.04), (0.03, 0.03), 1.0)],
}


def find_classes(problem: Problem) -> tuple[Candidate, ...]:
    config, duration_s = HomotopyConfig(max_candidates=16, clearance=0.0), problem.horizon.dt * problem.horizon.steps
    return search(
        problem.initial_mean, problem.goal[None, :2], problem.obstacles, config, [duration_s], problem.horizon.steps
    ).candidates


def solve_together(problem: Problem, candidates: list[Candidate], strategy: str) -> list[Solution]:
    starts = [cold_start(each.guess) for each in candidates]
    return solve_problems([problem] * len(starts), starts, FocConfig(strategy=strategy))


@pytest.mark.parametrize(
    ('name', 'strategy'),
    [
        *((name, strategy) for name in SCENES for strategy in ('optimal', 'fixed')),
    ],
)
def test_each_class_is_as_if_it_were_alone_and_the_same_each_time(name, strategy):
    problem = reach(collect_obstacles(SCENES[name]), steps=30, noise=(0.1, 0.1), preference=PREFERENCE)
    candidates = list(find_classes(problem))
    assert len(candidates) >= 4
    together, again = (solve_together(problem, candidates, strategy) for _ in range(2))
    for candidate, one, other in zip(candidates, together, again, strict=True):
        np.testing.assert_array_equal(one.mean, other.mean)
        alone = solve_problem(problem, cold_start(candidate.guess), FocConfig(strategy=strategy))
        # beside a better class a class is solved as far as its likelihood tells; `lv` and `hc` look at samples of such solutions
        inexact = {'fixed': 1e-6, 'lv': 0.1, 'hc': 0.1}.get(strategy, LARGEST_TOLERANCE)
        assert find_loss(one) == pytest.approx(find_loss(alone), abs=inexact)
        assert one.effort == pytest.approx(alone.effort, rel=1e-2)
        np.testing.assert_allclose(one.path, alone.path, atol=5e-4)


def find_loss(solution: Solution) -> float:
    return PREFERENCE.compute_loss(solution.effort, max(solution.safety_factor, 0.0), 3.0)


def read_table(scene: dict) -> Obstacles:
    """Return the obstacles of a scene, whose vertices are given in the world."""
    vertices = [np.array(each['vertices']) for each in scene['obstacles']]
    centres = [each.mean(axis=0) for each in vertices]
    radii, deviations, names, velocities = (
        [each[key] for each in scene['obstacles']] for key in ('radius', 'radius_stddev', 'name', 'velocity')
    )
    polygons = [each - centre for each, centre in zip(vertices, centres, strict=True)]
    return make_obstacles(centres, radii, deviations, ids=tuple(names), velocity=velocities, polygons=polygons)


@pytest.mark.skipif(not REFERENCE.is_file(), reason='optional data: ../shared/reference/random_shapes.json is absent')
def test_classes_are_as_good_as_those_of_an_independent_solver():
    """At most one of all classes has a loss more than 0.05 above its reference; every path passes on the sides of its class."""
    worse, compared = {}, 0
    for scene in json.loads(REFERENCE.read_text('utf-8')):
        problem = reach(
            read_table(scene),
            goal=scene['goal'],
            steps=scene['steps'],
            duration=scene['duration_s'],
            noise=scene['noise_per_step'],
            eta=scene['eta'],
            preference=PREFERENCE,
        )
        problem = replace(problem, initial_mean=np.array(scene['start']))
        references = {each['label']: each['reference'] for each in scene['classes']}
        candidates = [each for each in find_classes(problem) if each.label in references]
        assert len(candidates) == len(references)
        for candidate, solution in zip(candidates, solve_together(problem, candidates, 'optimal'), strict=True):
            compared += 1
            sides, reference = (
                find_path_sides(solution.path, problem.obstacles, problem.centre_trajectories),
                references[candidate.label],
            )
            assert all(sides.get(name, side) == side for name, side in candidate.sides)
            losses = [
                PREFERENCE.compute_loss(effort, min(k + 1e-5, problem.wanted_k), problem.wanted_k)
                for effort, k in ((solution.effort, solution.safety_factor), (reference['effort'], reference['k']))
            ]
            if losses[0] > losses[1] + 0.05 or solution.status not in (Status.SOLVED, Status.COMPROMISED):
                worse[scene['seed'], scene['kind'], candidate.label] = (losses[0] - losses[1], solution.status.value)
    assert compared > 50
    assert len(worse) <= 1, worse
