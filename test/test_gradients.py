"""The parts of the QPs against a step-by-step simulation of the model and its finite differences."""

from dataclasses import replace

import numpy as np
import pytest
from reach_helpers import random_scene, reach

from foc_ros.core.config import FocConfig
from foc_ros.core.dynamics.plants import condense, discretise_damped_mass, discretise_triple_integrator
from foc_ros.core.ocp.problem import Problem, rest_to_goal
from foc_ros.core.ocp.qp import Cost, effort_cost, half_planes
from foc_ros.core.ocp.solve import solve_problem
from foc_ros.core.ocp.start import cold_start
from foc_ros.core.types import make_obstacles

STEPS, LAMBDA = 12, 3e4
PLANTS = {'jerk': discretise_triple_integrator(0.05), 'force': discretise_damped_mass(0.05, 1.5, 4.0)}
EVERY_PLANT = pytest.mark.parametrize('plant', PLANTS)


def weighted_problem(plant: str, seed: int = 0) -> Problem:
    """Return a problem with every term of the cost: positions reach the goal exactly, others by weights at every step."""
    generator = np.random.default_rng(seed)
    n = len(PLANTS[plant].A)
    root = 1e-2 * generator.standard_normal((n, n))
    made = rest_to_goal(
        condense(PLANTS[plant], STEPS),
        0.1 * generator.standard_normal(n),
        np.array([0.3, 0.1]),
        make_obstacles(),
        np.array([0.1, 0.2]),
        0.9,
        initial_covariance=root @ root.T,
    )
    terminal, stage = 10 ** generator.uniform(3, 6, n), 10 ** generator.uniform(1, 3, n)
    return replace(made, at_goal=np.arange(n) < 2, terminal_weights=terminal, stage_weights=stage)


def simulated(problem: Problem, plant: str, control: np.ndarray) -> tuple[np.ndarray, float]:
    """Step mean and covariance on, and return the last mean and J_aug."""
    A, B = PLANTS[plant].A, PLANTS[plant].B
    mean, covariance, cost = problem.initial_mean, problem.initial_covariance, float(control @ control)
    for t, u in enumerate(control.reshape(2, -1).T, start=1):
        mean = A @ mean + B @ u
        covariance = A @ covariance @ A.T + B @ np.diag((problem.noise * u) ** 2) @ B.T
        variances = covariance.diagonal()
        weights = problem.terminal_weights if t == STEPS else problem.stage_weights
        cost += weights @ ((mean - problem.goal) ** 2 + variances) + LAMBDA * variances[:2].sum()
    return mean, float(cost)


def soft_rows(cost: Cost) -> tuple[np.ndarray, np.ndarray]:
    """Return rows and targets of the goal's terms, each divided by the root of its softness."""
    soft = cost.softness > 0
    root = np.sqrt(cost.softness[soft])
    return cost.goal_rows[soft] / root[:, None], cost.goal_targets[soft] / root


@EVERY_PLANT
def test_cost_and_its_derivatives_are_those_of_a_simulation(plant):
    """But for a constant: the part of the variance that no control causes."""
    problem = weighted_problem(plant)
    problem = replace(problem, at_goal=np.zeros(len(problem.goal), dtype=bool))
    cost = effort_cost(problem, LAMBDA)
    rows, targets = soft_rows(cost)
    generator = np.random.default_rng(1)
    control, other, step = 10 * generator.standard_normal((3, 2 * STEPS))

    def value(u: np.ndarray) -> float:
        return float(0.5 * u @ (cost.hessian * u) + 0.5 * ((rows @ u - targets) ** 2).sum())

    def J(u: np.ndarray) -> float:
        return simulated(problem, plant, u)[1]

    assert value(control) - value(other) == pytest.approx(J(control) - J(other), rel=1e-9)
    slope = step @ (cost.hessian * control + rows.T @ (rows @ control - targets))
    bend = step @ (cost.hessian * step) + ((rows @ step) ** 2).sum()
    assert slope == pytest.approx((J(control + step) - J(control - step)) / 2, rel=1e-7)
    assert bend == pytest.approx(J(control + step) - 2 * J(control) + J(control - step), rel=1e-7)


@EVERY_PLANT
def test_every_entry_of_the_hessian_is_a_second_difference(plant):
    """Of the effort and all variances; the means' errors are the goal's, and no part of the diagonal."""
    problem = weighted_problem(plant)
    everything = np.ones(len(problem.goal), dtype=bool)
    problem = replace(problem, at_goal=everything, stage_weights=0.0 * problem.stage_weights)
    hessian = effort_cost(problem, LAMBDA).hessian
    units = np.eye(2 * STEPS)

    def J(u: np.ndarray) -> float:
        mean, cost = simulated(problem, plant, u)
        return cost - float(problem.terminal_weights @ (mean - problem.goal) ** 2)

    differences = [J(unit) - 2 * J(0 * unit) + J(-unit) for unit in units]
    np.testing.assert_allclose(hessian, differences, rtol=1e-7)


@EVERY_PLANT
def test_goal_rows_are_the_end_of_a_simulation(plant):
    problem = weighted_problem(plant)
    cost = effort_cost(problem, LAMBDA)
    hard = cost.softness == 0
    assert hard.sum() == 2
    control = np.random.default_rng(2).standard_normal(2 * STEPS)
    end = simulated(problem, plant, control)[0]
    missed = cost.goal_rows[hard] @ control - cost.goal_targets[hard]
    np.testing.assert_allclose(missed, (end - problem.goal)[:2], atol=1e-12)
    steps = np.eye(2 * STEPS)
    differences = [(simulated(problem, plant, control + e)[0] - simulated(problem, plant, control - e)[0])[:2] / 2 for e in steps]
    np.testing.assert_allclose(cost.goal_rows[hard].T, differences, atol=1e-12)


@EVERY_PLANT
def test_terms_reported_for_a_solution_sum_to_the_simulated_cost(plant):
    problem = weighted_problem(plant)
    solution = solve_problem(problem, cold_start(np.zeros((STEPS + 1, 2))), FocConfig(strategy='fixed', tau=0.0, lam=LAMBDA))
    end, cost = simulated(problem, plant, solution.control.T.ravel())
    assert sum(solution.costs.values()) == pytest.approx(cost, rel=1e-9)
    np.testing.assert_allclose(end[:2], problem.goal[:2], atol=1e-9)
    assert solution.costs['effort'] == pytest.approx(solution.effort)


def test_half_planes_are_the_gradient_of_the_distance():
    obstacles, goal, _ = random_scene(np.random.default_rng(3), 3)
    problem = reach(obstacles, goal=goal)
    generator = np.random.default_rng(4)
    guess = goal / 2 + generator.normal(0.0, 0.1, (50, 2))
    normals, _ = half_planes(problem, guess, 0.0)

    def distance(points: np.ndarray) -> np.ndarray:
        return np.linalg.norm(points - problem.centres, axis=-1)

    for axis, step in enumerate(1e-6 * np.eye(2)):
        np.testing.assert_allclose(normals[..., axis], (distance(guess + step) - distance(guess - step)) / 2e-6, atol=1e-6)
