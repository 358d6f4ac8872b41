# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Scenes solved by independent solvers (quadprog, IPOPT): those of `reference_cases.json`, and more where they are present."""

import itertools
import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from homotopy_scenes import GOAL, random_shapes
from reach_helpers import REFERENCE_SHAPES, case_guess, case_problem, reach, reference_cases, solved

from foc_ros.core.classes import find_path_sides, search
from foc_ros.core.config import Config, FocConfig, HomotopyConfig
from foc_ros.core.obstacle_table import make_obstacles
from foc_ros.core.obstacles.shapes import Box, Capsule, Circle, collect_obstacles
from foc_ros.core.ocp.solve import solve_problem, solve_problems
from foc_ros.core.ocp.solver import LARGEST_TOLERANCE
from foc_ros.core.ocp.start import cold_start
from foc_ros.core.reach import build_scene_problems, solve_scene
from foc_ros.core.safety_preference import SafetyPreference
from foc_ros.core.scene import ReachingScene
from foc_ros.core.solution import Status
from foc_ros.core.types import HandState

CIRCLES = reference_cases()
SHAPES = [
    pytest.param(case, id='-'.join(each['kind'] for each in case['obstacles']))
    for case in json.loads(REFERENCE_SHAPES.read_text('utf-8'))
]
OURS = [case for case in CIRCLES if not case.id.startswith('shared')]
IN_TURN = [
    pytest.param(*case.values, strategy, id=f'{case.id}-{strategy}')
    for case, strategy in zip([*OURS, *SHAPES], itertools.cycle(['lv', 'hc']), strict=False)
]
"""Each case of this folder with one of the strategies that seek a point of a curve, which take many times as long as others."""


def find_sides(problem, solution):
    return find_path_sides(solution.path, problem.obstacles, problem.centre_trajectories)


@pytest.mark.parametrize('case', CIRCLES)
def test_fixed_reproduces_the_converged_qp(case):
    reference, problem = case['converged_qp'], case_problem(case)
    solution = solved(problem, case_guess(case), 'fixed', tau=reference['tau'], lam=reference['lam'])
    assert solution.status is Status.SOLVED
    assert solution.effort == pytest.approx(reference['effort'], rel=1e-4)
    assert list(find_sides(problem, solution).values()) == reference['sides']
    np.testing.assert_allclose(solution.path[case['steps'] // 2], reference['mid'], atol=1e-4)
    stddev = np.sqrt(solution.covariance[:, [0, 1], [0, 1]]).max(axis=0)
    np.testing.assert_allclose(stddev, reference['stddev_max'], rtol=1e-2, atol=1e-5)


@pytest.mark.parametrize('case', SHAPES)
def test_fixed_costs_no_more_than_what_ipopt_finds(case):
    """Within 2 %: with a distance kept at the steps alone, every pair of steps that a corner lies between has its own minimum."""
    reference, problem = case['fixed'], case_problem(case)
    solution = solved(problem, case_guess(case), 'fixed', tau=reference['tau'], lam=reference['lam'])
    assert solution.status is Status.SOLVED
    assert list(find_sides(problem, solution).values()) == reference['sides']
    assert solution.violation < 1e-6
    assert solution.effort <= 1.01 * reference['effort']
    assert solution.costs['effort'] + solution.costs['lambda_variance'] <= 1.02 * reference['cost']


@pytest.mark.parametrize(
    ('case', 'eta_below', 'above'),
    [
        pytest.param(*each.values, *bounds, id=each.id, marks=each.marks)
        for cases, bounds in ((CIRCLES, (1e-4, 1.02)), (SHAPES, (1e-6, 1.01)))
        for each in cases
    ],
)
def test_optimal_meets_eta_at_no_more_than_the_reference_effort(case, eta_below, above):
    reference, problem = case['min_effort_at_eta'], case_problem(case)
    solution = solved(problem, case_guess(case), 'optimal')
    assert solution.status is Status.SOLVED, solution.message
    assert solution.eta >= reference['eta'] - eta_below
    assert list(find_sides(problem, solution).values()) == reference['sides']
    assert solution.effort <= above * reference['ipopt_effort']
    if 'socp_ccp_effort' in reference:
        assert solution.effort <= 1.01 * reference['socp_ccp_effort']


@pytest.mark.parametrize(('case', 'strategy'), IN_TURN)
def test_continuous_strategies_meet_eta_and_cost_no_less_than_optimal(case, strategy):
    reference, problem = case['min_effort_at_eta'], case_problem(case)
    solution, optimal = (solved(problem, case_guess(case), name) for name in (strategy, 'optimal'))
    assert solution.status is Status.SOLVED, solution.message
    assert list(find_sides(problem, solution).values()) == reference['sides']
    assert solution.eta >= problem.eta - 1e-6
    assert solution.lam == 1.0 or solution.eta == pytest.approx(problem.eta, abs=1e-3)
    assert solution.effort >= 0.999 * optimal.effort


REFERENCE = Path(__file__).resolve().parents[2] / 'shared' / 'reference' / 'random_shapes.json'
PREFERENCE = SafetyPreference(beta=2.0, shortfall=6.0)
SCENES = {
    'boxes': [Box((0.12, 0.03), (0.04, 0.03), 0.4, 0.005), Box((0.19, -0.02), (0.02, 0.05), centre_stddev=0.001)],
    'mixed': [Circle((0.08, 0.0), 0.02), Capsule((0.15, 0.04), (0.19, 0.07), 0.01, 0.001), Box((0.2, -0.04), (0.03, 0.03), 1.0)],
}


def find_classes(problem):
    config, steps = HomotopyConfig(max_candidates=16, clearance=0.0), problem.horizon.steps
    goals, durations = problem.goal[None, :2], [problem.horizon.dt * steps]
    return search(problem.initial_mean, goals, problem.obstacles, config, durations, steps).candidates


def solve_together(problem, candidates, strategy):
    starts = [cold_start(each.guess) for each in candidates]
    return solve_problems([problem] * len(starts), starts, FocConfig(strategy=strategy))


@pytest.mark.parametrize(('name', 'strategy'), [*((name, 'optimal') for name in SCENES), ('mixed', 'fixed')])
def test_each_class_is_as_if_it_were_alone_and_the_same_each_time(name, strategy):
    problem = reach(collect_obstacles(SCENES[name]), steps=30, noise=(0.1, 0.1), preference=PREFERENCE)
    candidates = list(find_classes(problem))
    assert len(candidates) >= 4
    together = solve_together(problem, candidates, strategy)
    if name == 'mixed':
        for one, other in zip(together, solve_together(problem, candidates, strategy), strict=True):
            np.testing.assert_array_equal(one.mean, other.mean)
    for candidate, one in zip(candidates, together, strict=True):
        alone = solve_problem(problem, cold_start(candidate.guess), FocConfig(strategy=strategy))
        # beside a better class a class is solved as far as its likelihood tells
        inexact = 1e-6 if strategy == 'fixed' else LARGEST_TOLERANCE
        assert find_loss(one) == pytest.approx(find_loss(alone), abs=inexact)
        assert one.effort == pytest.approx(alone.effort, rel=1e-2)
        np.testing.assert_allclose(one.path, alone.path, atol=5e-4)


def find_loss(solution):
    return PREFERENCE.compute_loss(solution.effort, max(solution.safety_factor, 0.0), 3.0)


def read_table(scene):
    keys = 'vertices', 'radius', 'radius_stddev', 'name', 'velocity'
    vertices, radii, deviations, names, velocities = ([each[key] for each in scene['obstacles']] for key in keys)
    centres = [np.mean(each, axis=0) for each in vertices]
    polygons = [np.array(each) - centre for each, centre in zip(vertices, centres, strict=True)]
    return make_obstacles(centres, radii, deviations, ids=tuple(names), velocity=velocities, polygons=polygons)


@pytest.mark.skipif(not REFERENCE.is_file(), reason='optional data: ../shared/reference/random_shapes.json is absent')
def test_classes_are_as_good_as_those_of_an_independent_solver():
    """At most one of all classes has a loss more than 0.05 above its reference; every path passes on the sides of its class."""
    worse, compared = {}, 0
    for scene in json.loads(REFERENCE.read_text('utf-8')):
        given = {'duration': scene['duration_s'], 'noise': scene['noise_per_step'], 'preference': PREFERENCE}
        problem = reach(read_table(scene), goal=scene['goal'], steps=scene['steps'], eta=scene['eta'], **given)
        problem = replace(problem, initial_mean=np.array(scene['start']))
        references = {each['label']: each['reference'] for each in scene['classes']}
        candidates = [each for each in find_classes(problem) if each.label in references]
        assert len(candidates) == len(references)
        for candidate, solution in zip(candidates, solve_together(problem, candidates, 'optimal'), strict=True):
            compared += 1
            sides, reference = find_sides(problem, solution), references[candidate.label]
            assert all(sides.get(name, side) == side for name, side in candidate.sides)
            losses = [
                PREFERENCE.compute_loss(effort, min(k + 1e-5, problem.wanted_k), problem.wanted_k)
                for effort, k in ((solution.effort, solution.safety_factor), (reference['effort'], reference['k']))
            ]
            if losses[0] > losses[1] + 0.05 or solution.status not in (Status.SOLVED, Status.COMPROMISED):
                worse[scene['seed'], scene['kind'], candidate.label] = (losses[0] - losses[1], solution.status.value)
    assert compared > 50
    assert len(worse) <= 1, worse


def test_every_solved_candidate_is_in_the_class_of_its_label():
    config, hand = Config().with_values({'duration.fixed_s': 0.9, 'budget_s': 0.0}), HandState(0, np.zeros(6), np.zeros((6, 6)))
    found = []
    for seed in range(2):
        generator = np.random.default_rng(seed)
        obstacles = random_shapes(generator, int(generator.integers(2, 6)))
        scene = ReachingScene(hand, np.array([GOAL]), obstacles, None, None, config)
        for one in solve_scene(scene, build_scene_problems(scene)):
            found.append(one.status)
            if one.has_likelihood:
                sides = find_path_sides(one.solution.path, obstacles)
                assert all(sides.get(name, side) == side for name, side in one.candidate.sides), f'scene {seed}, {one.label}'
    assert len(found) > 4
    assert found.count(Status.LEFT_CLASS) <= 0.02 * len(found), found
    assert found.count(Status.SOLVED) + found.count(Status.COMPROMISED) >= 0.94 * len(found), found
