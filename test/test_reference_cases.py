# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Scenes solved by independent solvers (quadprog, IPOPT): those of `reference_cases.json`, and more where they are present."""

import numpy as np
import pytest
from reach_helpers import case_guess, case_problem, reference_cases, solved

from foc_ros.core.classes import find_path_sides
from foc_ros.core.solution import Status

CASES = pytest.mark.parametrize('case', reference_cases())


def sides(problem, solution) -> list[int]:
    realised = find_path_sides(solution.path, problem.obstacles)
    return [realised[identity] for identity in problem.obstacles.ids]


@CASES
def test_fixed_reproduces_the_converged_qp(case):
    reference, problem = case['converged_qp'], case_problem(case)
    solution = solved(problem, case_guess(case), 'fixed', tau=reference['tau'], lam=reference['lam'])
    assert solution.status is Status.SOLVED
    assert solution.effort == pytest.approx(reference['effort'], rel=1e-4)
    assert sides(problem, solution) == reference['sides']
    np.testing.assert_allclose(solution.path[case['steps'] // 2], reference['mid'], atol=1e-4)
    stddev = np.sqrt(solution.covariance[:, [0, 1], [0, 1]]).max(axis=0)
    np.testing.assert_allclose(stddev, reference['stddev_max'], rtol=1e-2, atol=1e-5)


@CASES
def test_optimal_meets_eta_at_no_more_than_the_reference_effort(case):
    reference, problem = case['min_effort_at_eta'], case_problem(case)
    solution = solved(problem, case_guess(case), 'optimal')
    assert solution.status is Status.SOLVED
    assert solution.eta >= reference['eta'] - 1e-4
    assert sides(problem, solution) == reference['sides']
    if 'socp_ccp_effort' in reference:
        assert solution.effort <= 1.01 * reference['socp_ccp_effort']
    assert solution.effort <= 1.02 * reference['ipopt_effort']


@CASES
@pytest.mark.parametrize('strategy', ['lv', 'hc'])
def test_continuous_strategies_just_meet_eta_and_cost_no_less_than_optimal(case, strategy):
    problem = case_problem(case)
    solution, optimal = (solved(problem, case_guess(case), name) for name in (strategy, 'optimal'))
    assert solution.status is Status.SOLVED
    assert sides(problem, solution) == case['min_effort_at_eta']['sides']
    assert solution.eta >= problem.eta
    assert solution.lam == 1.0 or solution.eta == pytest.approx(problem.eta, abs=1e-3)
    assert solution.effort >= optimal.effort * (1 - 1e-3)
