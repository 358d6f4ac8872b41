# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The parts of the cost and the goal against a step-by-step simulation of the model."""

from dataclasses import replace

import numpy as np
import pytest

from foc_ros.core.config import FocConfig
from foc_ros.core.obstacle_table import make_obstacles
from foc_ros.core.ocp.problem import Problem, rest_to_goal
from foc_ros.core.ocp.solve import solve_problem
from foc_ros.core.ocp.start import cold_start
from foc_ros.core.plant.plants import condense, discretise_damped_mass, discretise_triple_integrator

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


@EVERY_PLANT
def test_terms_reported_for_a_solution_sum_to_the_simulated_cost(plant):
    problem = weighted_problem(plant)
    solution = solve_problem(problem, cold_start(np.zeros((STEPS + 1, 2))), FocConfig(strategy='fixed', tau=0.0, lam=LAMBDA))
    end, cost = simulated(problem, plant, solution.control.T.ravel())
    assert sum(solution.costs.values()) == pytest.approx(cost, rel=1e-9)
    np.testing.assert_allclose(end[:2], problem.goal[:2], atol=1e-9)
    assert solution.costs['effort'] == pytest.approx(solution.effort)
    nudge = np.random.default_rng(3).standard_normal(2 * STEPS)
    rows = problem.goal_rows[0][problem.goal_rows[2] == 0]
    nudge -= rows.T @ np.linalg.solve(rows @ rows.T, rows @ nudge)
    for size in (-1e-2, 1e-2):
        assert simulated(problem, plant, solution.control.T.ravel() + size * nudge)[1] > cost, 'it is the least'
