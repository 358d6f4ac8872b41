"""The promises of each strategy."""

import re
from dataclasses import replace

import numpy as np
import pytest
from reach_helpers import bowed, one_obstacle, random_scene, reach, solved

from foc_ros.core.config import FocConfig
from foc_ros.core.errors import SceneError
from foc_ros.core.obstacles.risk import eta_of_k
from foc_ros.core.ocp.monte_carlo import monte_carlo
from foc_ros.core.ocp.problem import rest_to_goal
from foc_ros.core.ocp.solve import find_least_safety_factor, solve_problem
from foc_ros.core.ocp.start import cold_start, warm_start
from foc_ros.core.plant.plants import build_triple_integrator_horizon, condense, discretise_damped_mass
from foc_ros.core.types import Status, make_obstacles

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


@EVERY
def test_result_is_consistent_with_itself(strategy):
    problem = one_obstacle()
    solution = solved(problem, BOWED, strategy)
    control = solution.control.T.ravel()
    k, row, moment = find_least_safety_factor(problem, control)
    assert solution.effort == pytest.approx(control @ control)
    assert solution.eta == pytest.approx(eta_of_k(k))
    assert solution.eta >= 0.9 - 1e-6
    assert solution.eta_at == ('0', pytest.approx(moment, abs=1e-3))
    assert row == 0
    assert solution.safety_factor == pytest.approx(k, rel=1e-9)
    np.testing.assert_allclose(solution.path[1:], problem.positions(control), atol=1e-12)
    np.testing.assert_allclose(solution.mean[0], problem.initial_mean)
    np.testing.assert_allclose(solution.mean[-1], problem.goal, atol=1e-7)
    assert solution.costs['effort'] == solution.effort
    variances = solution.covariance[1:, [0, 1], [0, 1]].sum()
    assert solution.costs['lambda_variance'] == pytest.approx(solution.lam * variances)


def test_low_velocity_is_nearer_and_more_precise_than_high_clearance():
    slow, wide = (solved(one_obstacle(0.94), BOWED, name) for name in ('lv', 'hc'))
    assert slow.tau < wide.tau
    assert slow.lam > wide.lam
    assert slow.path[:, 1].max() < wide.path[:, 1].max()


def test_the_ratio_of_efforts_rises_through_one_with_much_noise_and_stays_near_it_with_little():
    def ratio(eta, c):
        slow, wide = (solved(one_obstacle(eta, (c, c)), BOWED, name) for name in ('lv', 'hc'))
        return slow.effort / wide.effort

    much = [ratio(eta, 0.15) for eta in (0.7, 0.86, 0.9, 0.94)]
    assert much[0] < 1.0 < much[1] < much[2] < much[3]
    np.testing.assert_allclose(much, [0.99, 1.16, 1.40, 2.24], rtol=0.06)
    assert all(0.97 < ratio(eta, 0.05) < 1.06 for eta in (0.7, 0.9, 0.95))


@EVERY
@pytest.mark.parametrize('eta', [0.6, 0.9])
def test_monte_carlo_keeps_the_guarantee(strategy, eta):
    generator = np.random.default_rng(11)
    checked = 0
    for _ in range(6):
        obstacles, goal, amplitude = random_scene(generator)
        problem = reach(obstacles, goal=goal, noise=(0.1, 0.1), eta=eta)
        solution = solved(problem, bowed((0, 0), goal, 50, amplitude), strategy)
        if solution.status is not Status.SOLVED:
            continue
        sampled = monte_carlo(problem, solution.control.T.ravel(), 2000)
        assert sampled.step[2] >= eta
        assert sampled.path[0] <= sampled.step[0]
        checked += 1
    assert checked >= 3


@pytest.mark.parametrize('strategy', ['lv', 'hc', 'optimal'])
def test_the_message_of_an_unreachable_eta_names_the_largest_that_is_reached(strategy):
    solution = solved(one_obstacle(0.999, (0.6, 0.6)), BOWED, strategy)
    assert solution.status is Status.ETA_UNREACHABLE
    assert 0 < solution.eta < 0.999
    said = float(re.search(r': .*?(0\.\d+)', solution.message)[1])
    assert said == pytest.approx(solution.eta, abs=1e-3)
    easier = solved(one_obstacle(0.8 * solution.eta, (0.6, 0.6)), BOWED, strategy)
    assert easier.status is Status.SOLVED


@pytest.mark.parametrize('strategy', ['lv', 'hc', 'optimal', 'fixed', 'algorithm1'])
def test_no_way_through_is_infeasible_with_a_path_to_look_at(strategy):
    wall = make_obstacles([[0.15, 0.02], [0.15, -0.02]], [0.03, 0.03])
    solution = solved(reach(wall), bowed((0, 0), (0.3, 0), 50, 0.0), strategy)
    assert solution.status is Status.INFEASIBLE
    assert solution.eta == 0.0
    assert np.isfinite(solution.mean).all()
    assert 'no path' in solution.message


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
def test_where_two_circles_leave_no_gap_there_is_no_way_between_two_steps_either(strategy):
    """Rows at the steps alone would let the mean leap through the gap of 1 mm less than nothing."""
    shut = reach(make_obstacles([[0.122, 0.03], [0.122, -0.03]], [0.0305, 0.0305]), noise=(0.0, 0.0), steps=10)
    assert solved(shut, bowed((0, 0), (0.3, 0), 10, 0.0), strategy).status is Status.INFEASIBLE


@EVERY
def test_the_same_circle_twice_is_as_once(strategy):
    twice = reach(make_obstacles([[0.12, 0.0]] * 2, [0.03] * 2, [0.003] * 2))
    one, two = solved(one_obstacle(), BOWED, strategy), solved(twice, BOWED, strategy)
    assert two.status is Status.SOLVED
    np.testing.assert_allclose(two.path, one.path, atol=1e-5)
    assert two.effort == pytest.approx(one.effort, rel=1e-4)


@EVERY
def test_goal_inside_an_obstacle_is_never_called_solved(strategy):
    solution = solved(reach(make_obstacles([[0.3, 0.01]], [0.03])), BOWED, strategy)
    assert solution.status is Status.INFEASIBLE
    assert solution.eta == 0.0


@EVERY
def test_moving_and_uncertain_centres_are_avoided_where_they_will_be(strategy):
    crossing = make_obstacles([[0.15, -0.2]], [0.03], [0.002], velocity=[[0.0, 0.4]], centre_covariance=np.eye(2) * 1e-5)
    problem = reach(crossing, noise=(0.05, 0.05), eta=0.8)
    solution = solved(problem, bowed((0, 0), (0.3, 0), 50, 0.06), strategy)
    assert solution.status is Status.SOLVED
    centre = problem.centres[0]
    assert np.hypot(*(solution.path[1:] - centre).T).min() > 0.03
    assert monte_carlo(problem, solution.control.T.ravel(), 4000).step[2] >= 0.8


@EVERY
def test_every_strategy_solves_for_a_damped_mass(strategy):
    stacked = condense(discretise_damped_mass(0.02, 1.0, 2.0), 50)
    obstacles = make_obstacles([[0.12, 0.0]], [0.03], [0.003])
    problem = rest_to_goal(stacked, np.zeros(4), np.array([0.3, 0.0]), obstacles, np.array([0.1, 0.1]), 0.9)
    solution = solve_problem(problem, cold_start(BOWED), FocConfig(strategy=strategy))
    assert solution.status is Status.SOLVED
    assert solution.mean.shape == (51, 4)
    assert monte_carlo(problem, solution.control.T.ravel(), 4000).step[2] >= 0.9


def test_algorithm1_as_printed_overshoots_the_solution_of_the_continuous_path():
    problem = one_obstacle(0.9)
    stepped = solved(problem, BOWED, 'algorithm1', algorithm1_growth=10.0)
    followed = solved(problem, BOWED, 'lv', growth=10.0)
    if stepped.status is Status.SOLVED:
        assert stepped.effort >= followed.effort * (1 - 1e-6)
    else:
        assert any(words in stepped.message for words in ('infeasible', 'not settled', 'achieves eta'))
    gentle = solved(problem, BOWED, 'algorithm1', algorithm1_growth=1.5)
    assert gentle.status is Status.SOLVED
    assert gentle.eta >= 0.9 - 0.02, 'at the steps; between them it may be a little less'


@EVERY
def test_a_warm_start_finds_what_a_cold_one_finds(strategy):
    problem = one_obstacle(0.86)
    first = solved(problem, BOWED, strategy)
    again = solve_problem(problem, warm_start(first, problem), FocConfig(strategy=strategy))
    assert again.status is Status.SOLVED
    assert again.qp_solves < first.qp_solves
    np.testing.assert_allclose(again.path, first.path, atol=5e-4 if strategy == 'hc' else 2e-6)


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
@pytest.mark.parametrize('steps', [1, 2, 3, 5])
def test_however_few_the_steps_there_is_an_answer(strategy, steps):
    problem = reach(make_obstacles([[0.15, 0.01]], [0.03], [0.001]), steps=steps)
    solution = solved(problem, bowed((0, 0), (0.3, 0), steps, 0.05), strategy)
    assert solution.mean.shape == (steps + 1, 6)
    assert np.isfinite(solution.mean).all()
    assert np.isfinite(solution.covariance).all()


@pytest.mark.parametrize('steps', [20, 50])
def test_optimal_settles_wherever_the_obstacle_lies_between_two_steps(steps):
    """The touching step slides along the circle with the obstacle's position, and the sequence creeps where it changes."""
    generator = np.random.default_rng(0)
    for _ in range(12):
        centre = np.array([0.15, 0.0]) + generator.normal(0, 0.001, 2)
        problem = reach(make_obstacles([centre], [0.03], [0.001]), steps=steps, duration=1.2, noise=(0.05, 0.05))
        solution = solved(problem, bowed((0, 0), (0.3, 0), steps, 0.05), 'optimal')
        assert solution.status is Status.SOLVED


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
