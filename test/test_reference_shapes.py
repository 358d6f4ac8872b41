# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Ten scenes of boxes, capsules, hulls and circles, solved by IPOPT: see `benchmarks/reference_shapes.py`."""

import json

import pytest
from reach_helpers import REFERENCE_SHAPES, case_guess, shapes_problem, solved

from foc_ros.core.classes import find_path_sides
from foc_ros.core.ocp.problem import Problem
from foc_ros.core.solution import Solution, Status

CASES = pytest.mark.parametrize(
    'case',
    [
        pytest.param(case, id='-'.join(each['kind'] for each in case['obstacles']))
        for case in json.loads(REFERENCE_SHAPES.read_text('utf-8'))
    ],
)


def find_sides(problem: Problem, solution: Solution) -> list[int]:
    realised = find_path_sides(solution.path, problem.obstacles, problem.centre_trajectories)
    return [realised[identity] for identity in problem.obstacles.ids]


@CASES
def test_fixed_costs_no_more_than_what_ipopt_finds(case):
    """Within 2 %: with a distance kept at the steps alone, every pair of steps that a corner lies between has its own minimum."""
    reference, problem = case['fixed'], shapes_problem(case)
    solution = solved(problem, case_guess(case), 'fixed', tau=reference['tau'], lam=reference['lam'])
    assert solution.status is Status.SOLVED
    assert find_sides(problem, solution) == reference['sides']
    assert solution.violation < 1e-6
    assert solution.effort <= 1.01 * reference['effort']
    assert solution.costs['effort'] + solution.costs['lambda_variance'] <= 1.02 * reference['cost']


@CASES
def test_optimal_meets_eta_at_no_more_than_the_effort_of_ipopt(case):
    reference, problem = case['min_effort_at_eta'], shapes_problem(case)
    solution = solved(problem, case_guess(case), 'optimal')
    assert solution.status is Status.SOLVED, solution.message
    assert solution.eta >= reference['eta'] - 1e-6
    assert find_sides(problem, solution) == reference['sides']
    assert solution.effort <= 1.01 * reference['ipopt_effort']


@CASES
@pytest.mark.parametrize('strategy', ['lv', 'hc'])
def test_continuous_strategies_meet_eta_and_cost_no_less_than_ipopt(case, strategy):
    reference, problem = case['min_effort_at_eta'], shapes_problem(case)
    solution = solved(problem, case_guess(case), strategy)
    assert solution.status is Status.SOLVED, solution.message
    assert solution.eta >= reference['eta'] - 1e-6
    assert find_sides(problem, solution) == reference['sides']
    assert solution.effort >= 0.999 * reference['ipopt_effort']
