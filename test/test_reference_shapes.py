"""Ten scenes of boxes, capsules, hulls and circles, solved by IPOPT: see `scripts/make_reference_shapes.py`."""

import json

import numpy as np
import pytest
from reach_helpers import REFERENCE, bowed, reach, solved

from foc_ros.core.homotopy import find_path_sides
from foc_ros.core.obstacles.shapes import Box, Capsule, Circle, Hull, collect_obstacles
from foc_ros.core.ocp.problem import Problem
from foc_ros.core.types import Solution, Status

KINDS = {'box': Box, 'capsule': Capsule, 'circle': Circle, 'hull': Hull}
CASES = pytest.mark.parametrize(
    'case',
    [
        pytest.param(case, id='-'.join(each['kind'] for each in case['obstacles']))
        for case in json.loads(REFERENCE.with_name('reference_shapes.json').read_text('utf-8'))
    ],
)


def case_problem(case: dict) -> Problem:
    shapes = [KINDS[each['kind']](**{key: value for key, value in each.items() if key != 'kind'}) for each in case['obstacles']]
    return reach(
        collect_obstacles(shapes),
        goal=case['goal'],
        steps=case['steps'],
        duration=case['duration_s'],
        noise=case['noise'],
        eta=case['min_effort_at_eta']['eta'],
    )


def case_guess(case: dict) -> np.ndarray:
    return bowed(case['start'], case['goal'], case['steps'], case['guess']['amplitude'])


def find_sides(problem: Problem, solution: Solution) -> list[int]:
    realised = find_path_sides(solution.path, problem.obstacles, problem.centre_trajectories)
    return [realised[identity] for identity in problem.obstacles.ids]


@CASES
def test_fixed_costs_no_more_than_what_ipopt_finds(case):
    reference, problem = case['fixed'], case_problem(case)
    solution = solved(problem, case_guess(case), 'fixed', tau=reference['tau'], lam=reference['lam'])
    assert solution.status is Status.SOLVED
    assert find_sides(problem, solution) == reference['sides']
    assert solution.violation < 1e-6
    assert solution.costs['effort'] + solution.costs['lambda_variance'] <= 1.01 * reference['cost']


@CASES
def test_optimal_meets_eta_at_no_more_than_the_effort_of_ipopt(case):
    reference, problem = case['min_effort_at_eta'], case_problem(case)
    solution = solved(problem, case_guess(case), 'optimal')
    assert solution.status is Status.SOLVED, solution.message
    assert solution.eta >= reference['eta'] - 1e-6
    assert find_sides(problem, solution) == reference['sides']
    assert solution.effort <= 1.01 * reference['ipopt_effort']


@CASES
@pytest.mark.parametrize('strategy', ['lv', 'hc'])
def test_continuous_strategies_meet_eta_and_cost_no_less_than_ipopt(case, strategy):
    reference, problem = case['min_effort_at_eta'], case_problem(case)
    solution = solved(problem, case_guess(case), strategy)
    assert solution.status is Status.SOLVED, solution.message
    assert solution.eta >= reference['eta'] - 1e-6
    assert find_sides(problem, solution) == reference['sides']
    assert solution.effort >= 0.999 * reference['ipopt_effort']
