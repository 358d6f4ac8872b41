# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The promises of each strategy."""

import re
from dataclasses import replace

import numpy as np
import pytest
from reach_helpers import bowed, one_obstacle, reach, solved

from foc_ros.core.config import FocConfig
from foc_ros.core.errors import SceneError
from foc_ros.core.obstacle_table import make_obstacles
from foc_ros.core.ocp.problem import rest_to_goal
from foc_ros.core.ocp.solve import solve_problem
from foc_ros.core.ocp.start import cold_start, warm_start
from foc_ros.core.plant.plants import build_triple_integrator_horizon
from foc_ros.core.solution import Status

BOWED = bowed((0, 0), (0.3, 0), 50, 0.05)
EVERY = pytest.mark.parametrize('strategy', ['lv', 'hc', 'optimal'])


@EVERY
def test_without_obstacles_the_minimum_jerk_reach(strategy):
    """Least jerk from rest to rest: x = D (10 s^3 - 15 s^4 + 6 s^5), integral of jerk^2 = 720 D^2 / T^5."""
    solution = solved(reach(make_obstacles(), steps=200), bowed((0, 0), (0.3, 0), 200, 0.0), strategy)
    assert solution.status is Status.SOLVED
    assert solution.eta_at is None
    np.testing.assert_allclose(solution.path, bowed((0, 0), (0.3, 0), 200, 0.0), atol=3e-4)
    assert solution.effort * solution.dt == pytest.approx(720 * 0.3**2, rel=1e-2)


def test_the_ratio_of_efforts_rises_through_one_with_much_noise_and_stays_near_it_with_little():
    def ratio(eta, c):
        slow, wide = (solved(one_obstacle(eta, (c, c)), BOWED, name) for name in ('lv', 'hc'))
        return slow.effort / wide.effort

    much = [ratio(eta, 0.15) for eta in (0.7, 0.86, 0.9, 0.94)]
    assert much[0] < 1.0 < much[1] < much[2] < much[3]
    np.testing.assert_allclose(much, [0.99, 1.16, 1.40, 2.24], rtol=0.06)
    assert all(0.97 < ratio(eta, 0.05) < 1.06 for eta in (0.7, 0.9, 0.95))


@pytest.mark.parametrize('strategy', ['lv', 'hc', 'optimal'])
def test_the_message_of_an_unreachable_eta_names_the_largest_that_is_reached(strategy):
    solution = solved(one_obstacle(0.999, (0.6, 0.6)), BOWED, strategy)
    assert solution.status is Status.ETA_UNREACHABLE
    assert 0 < solution.eta < 0.999
    said = float(re.search(r': .*?(0\.\d+)', solution.message)[1])
    assert said == pytest.approx(solution.eta, abs=1e-3)
    easier = solved(one_obstacle(0.8 * solution.eta, (0.6, 0.6)), BOWED, strategy)
    assert easier.status is Status.SOLVED
    assert easier.eta_reachable is None and solution.eta_reachable == solution.eta
    assert (easier.violation, easier.violation_at) == (0.0, None)


@pytest.mark.parametrize('strategy', ['lv', 'hc', 'optimal', 'fixed', 'algorithm1'])
def test_no_way_through_is_infeasible_with_a_path_to_look_at(strategy):
    wall = make_obstacles([[0.15, 0.02], [0.15, -0.02]], [0.03, 0.03])
    held = make_obstacles([[0.3, 0.01]], [0.03])
    for obstacles, amplitude in ((wall, 0.0), (held, 0.05)):
        solution = solved(reach(obstacles), bowed((0, 0), (0.3, 0), 50, amplitude), strategy)
        assert solution.status is Status.INFEASIBLE
        assert solution.eta == 0.0
        assert np.isfinite(solution.mean).all()
        assert 'no path' in solution.message
    if strategy in ('lv', 'hc', 'optimal'):  # rows at the steps alone would let the mean leap through a gap less than nothing
        shut = make_obstacles([[0.122, 0.03], [0.122, -0.03]], [0.0305, 0.0305])
        leap = solved(reach(shut, noise=(0.0, 0.0), steps=10), bowed((0, 0), (0.3, 0), 10, 0.0), strategy)
        assert leap.status is Status.INFEASIBLE


@pytest.mark.parametrize('strategy', ['lv', 'optimal'])
@pytest.mark.parametrize('start', [(0.0, 0.025), (0.0, 0.001)], ids=['in the margin', 'in the obstacle'])
def test_a_hand_inside_a_margin_gets_out_of_it_in_the_recovery_time(strategy, start):
    obstacles = make_obstacles([[0.0, 0.0]], [0.02], [0.002], ids=('near',))
    strict = solved(reach(obstacles, start=start), bowed(start, (0.3, 0), 50, 0.05), strategy)
    assert strict.status is not Status.SOLVED
    problem = reach(obstacles, start=start, recovery_s=0.3, noise=(0.05, 0.05))
    solution = solved(problem, bowed(start, (0.3, 0), 50, 0.05), strategy)
    assert solution.status is Status.SOLVED
    assert 'near' in solution.message
    assert np.hypot(*solution.path[15:].T).min() > 0.02


@EVERY
def test_a_warm_start_is_corrected_to_the_goal_from_where_the_hand_really_is(strategy):
    before = solved(one_obstacle(0.86), BOWED, strategy)
    state = np.array([0.002, 0.001, 0.03, 0.01, 0.8, 0.2])  # not where the plan would be, and far from its acceleration
    problem = replace(one_obstacle(0.86), initial_mean=state)
    start = warm_start(before, problem)
    found = solve_problem(problem, start, FocConfig(strategy=strategy))
    fresh = solve_problem(problem, cold_start(BOWED), FocConfig(strategy=strategy))
    assert found.status is fresh.status is Status.SOLVED
    np.testing.assert_allclose(found.path, fresh.path, atol=1e-5)


@EVERY
@pytest.mark.parametrize('steps', [1, 2, 5])
def test_however_few_the_steps_there_is_an_answer(strategy, steps):
    problem = reach(make_obstacles([[0.15, 0.01]], [0.03], [0.001]), steps=steps)
    solution = solved(problem, bowed((0, 0), (0.3, 0), steps, 0.05), strategy)
    assert solution.mean.shape == (steps + 1, 6)
    assert np.isfinite(solution.mean).all()
    assert np.isfinite(solution.covariance).all()


@pytest.mark.parametrize(
    ('field', 'values'),
    [
        ('start', {'initial_mean': np.full(6, np.nan)}),
        ('goal', {'goal_position': np.array([np.inf, 0.0])}),
        ('noise', {'noise': np.array([0.1, np.nan])}),
        ('start covariance', {'initial_covariance': np.full((6, 6), np.inf)}),
    ],
)
def test_a_problem_that_is_not_finite_is_refused_by_name(field, values):
    given = {'initial_mean': np.zeros(6), 'goal_position': np.array([0.3, 0.0]), 'noise': np.array([0.1, 0.1])}
    with pytest.raises(SceneError, match=f'{field}: expected finite numbers'):
        rest_to_goal(build_triple_integrator_horizon(0.02, 50), obstacles=make_obstacles(), eta=0.9, **(given | values))
