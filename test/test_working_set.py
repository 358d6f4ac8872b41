"""The solution by the working set against that of the full QP, and the QP itself."""

from dataclasses import replace

import numpy as np
import pytest
from reach_helpers import bowed, case_guess, case_problem, one_obstacle, random_scene, reach, reference_cases

from foc_ros.core.ocp.qp import clearance_qp, effort_cost, half_planes
from foc_ros.core.ocp.working_set import WorkingSet, solve, solve_full
from foc_ros.core.types import make_obstacles


def random_qp(seed: int, **weights):
    generator = np.random.default_rng(seed)
    obstacles, goal, amplitude = random_scene(generator)
    problem = replace(reach(obstacles, goal=goal, steps=25), **weights)
    tau, lam = generator.uniform(0, 1e-3), 10 ** generator.uniform(0, 7)
    return problem, clearance_qp(problem, effort_cost(problem, lam), bowed((0, 0), goal, 25, amplitude)[1:], tau)


@pytest.mark.parametrize('case', reference_cases())
def test_literal_qp_at_the_guess_reproduces_the_reference(case):
    problem, reference = case_problem(case), case['single_qp']
    cost = effort_cost(problem, reference['lam'])
    qp = clearance_qp(problem, cost, case_guess(case)[1:], reference['tau'], literal=True)
    for solution in (solve(qp, WorkingSet()), solve_full(qp)):
        assert solution is not None
        assert solution.control @ solution.control == pytest.approx(reference['effort'], rel=1e-6)
        np.testing.assert_allclose(problem.positions(solution.control)[case['steps'] // 2 - 1], reference['mid'], atol=1e-7)
        stddev = np.sqrt(problem.position_variance(solution.control)[:2].max(axis=1))
        np.testing.assert_allclose(stddev, reference['stddev_max'], rtol=1e-5, atol=1e-7)


@pytest.mark.parametrize('seed', range(25))
def test_range_space_equals_the_full_qp(seed):
    problem, qp = random_qp(seed)
    fast, slow = solve(qp, WorkingSet()), solve_full(qp)
    assert (fast is None) == (slow is None)
    if fast is not None and slow is not None:
        np.testing.assert_allclose(problem.positions(fast.control), problem.positions(slow.control), atol=1e-7)


@pytest.mark.parametrize('seed', range(8))
def test_weights_on_the_mean_are_soft_goal_rows(seed):
    generator = np.random.default_rng(seed)
    at_goal = np.array([False, True, False, True, True, False])
    problem, qp = random_qp(
        seed, at_goal=at_goal, terminal_weights=10 ** generator.uniform(4, 8, 6), stage_weights=np.array([1e3, 0, 0, 10.0, 0, 0])
    )
    fast, slow = solve(qp, WorkingSet()), solve_full(qp)
    assert fast is not None
    assert slow is not None
    np.testing.assert_allclose(problem.positions(fast.control), problem.positions(slow.control), atol=1e-6)


@pytest.mark.parametrize('seed', range(10))
def test_solution_meets_the_optimality_conditions(seed):
    _, qp = random_qp(seed)
    solution = solve(qp, WorkingSet())
    if solution is None:
        return
    rows = qp.rows(solution.active.obstacle, solution.active.step)
    gradient = qp.cost.hessian * solution.control - solution.multipliers @ rows
    forces, *_ = np.linalg.lstsq(qp.cost.goal_rows.T, gradient, rcond=None)
    scale = np.abs(qp.cost.hessian * solution.control).max()
    assert np.abs(gradient - forces @ qp.cost.goal_rows).max() < 1e-6 * scale
    assert (solution.multipliers > 0).all()
    assert (qp.row_values(solution.control) - qp.limits).min() > -1e-8
    assert np.abs(rows @ solution.control - qp.limits[solution.active.obstacle, solution.active.step]).max() < 1e-8


def test_any_working_set_gives_the_same_answer():
    problem, qp = random_qp(1)
    generator = np.random.default_rng(0)
    expected = solve(qp, WorkingSet())
    assert expected is not None
    for _ in range(10):
        rows = WorkingSet(generator.integers(0, len(problem.obstacles), 12), generator.integers(0, 25, 12))
        rows = rows.unite(*rows.rows, 25)
        again = solve(qp, rows)
        assert again is not None
        np.testing.assert_allclose(problem.positions(again.control), problem.positions(expected.control), atol=1e-8)


def test_contradicting_rows_are_infeasible_and_elastic_ones_share_the_violation():
    wall = make_obstacles([[0.15, 0.02], [0.15, -0.02]], [0.03, 0.03])
    problem = reach(wall)
    qp = clearance_qp(problem, effort_cost(problem, 1.0), bowed((0, 0), (0.3, 0), 50, 0.0)[1:], 0.0)
    assert solve(qp, WorkingSet()) is None
    assert solve_full(qp) is None
    elastic = solve(qp, WorkingSet(), elastic=True)
    assert elastic is not None
    np.testing.assert_allclose(problem.positions(elastic.control)[:, 1], 0.0, atol=1e-4)


def test_elastic_rows_give_way_by_little_where_none_contradicts():
    problem, qp = random_qp(2)
    hard, elastic = solve(qp, WorkingSet()), solve(qp, WorkingSet(), elastic=True)
    assert hard is not None
    assert elastic is not None
    np.testing.assert_allclose(problem.positions(elastic.control), problem.positions(hard.control), atol=1e-4)


def test_half_planes_touch_the_circle_and_hold_the_side_of_the_guess():
    problem = one_obstacle()
    generator = np.random.default_rng(7)
    guess = generator.normal(0.12, 0.05, (50, 2))
    for literal in (False, True):
        normals, limits = half_planes(problem, guess, 1e-4, literal=literal)
        reach_m = np.sqrt(0.03**2 + 0.003**2 + 1e-4)
        away = limits - np.einsum('jti,jti->jt', normals, problem.centres - problem.free[1:, :2])
        np.testing.assert_allclose(np.hypot(normals[..., 0], normals[..., 1]), 1.0)
        assert (away >= reach_m - 1e-12).all()
        assert (np.einsum('jti,jti->jt', normals, guess - problem.centres) > 0).all()
        if not literal:
            np.testing.assert_allclose(away, reach_m)


def test_a_guess_on_a_centre_has_a_side_all_the_same():
    problem = one_obstacle()
    guess = np.tile([0.12, 0.0], (50, 1))
    normals, limits = half_planes(problem, guess, 0.0)
    assert np.isfinite(normals).all()
    assert np.isfinite(limits).all()
    np.testing.assert_allclose(np.hypot(normals[..., 0], normals[..., 1]), 1.0)
