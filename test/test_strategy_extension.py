"""A strategy from outside the package: one function, registered by name, is solved like the built-in ones."""

import numpy as np
import pytest
from reach_helpers import bowed, one_obstacle, reach, solved

from foc_ros.core.config import FocConfig
from foc_ros.core.deadline import Deadline
from foc_ros.core.errors import InputError
from foc_ros.core.obstacles.chance_constraint import k_of_eta
from foc_ros.core.ocp.problem import Problem
from foc_ros.core.ocp.sqp import converge
from foc_ros.core.ocp.strategies import Strategy, StrategyResult, find_best_effort
from foc_ros.core.ocp.start import Start
from foc_ros.core.ocp.working_set import WorkingSet
from foc_ros.core.registry import STRATEGIES
from foc_ros.core.types import Status, make_obstacles

BOWED = bowed((0, 0), (0.3, 0), 50, 0.08)


def solve_margin(problem: Problem, start: Start, settings: FocConfig, deadline: Deadline) -> StrategyResult:
    """Keep a margin of k standard deviations of the radius, as for a hand without noise, at the lambda of the settings."""
    tau = k_of_eta(problem.eta) * float(np.sqrt(problem.size[1]).max(initial=0.0))
    found = converge(problem, start.positions, WorkingSet(), tau, settings.lam, deadline)
    if found is None:
        return find_best_effort(problem, start, tau, settings.lam)
    return StrategyResult(Status.SOLVED, 'solved', found.control, found.contacts, tau, settings.lam, found.qp_solves)


@pytest.fixture(autouse=True)
def margin(monkeypatch):
    monkeypatch.setattr(STRATEGIES, '_parts', dict(STRATEGIES._parts))
    strategy: Strategy = solve_margin
    STRATEGIES.register('margin', strategy)


def test_it_is_solved_by_its_name():
    problem = one_obstacle(0.8, noise=(0.0, 0.0))
    solution = solved(problem, BOWED, 'margin')
    assert solution.status is Status.SOLVED
    assert solution.eta >= 0.8 - 1e-5
    assert solution.tau == pytest.approx(2 * 2 * 0.03 * 0.003, rel=1e-2)
    assert np.hypot(*(solution.path - [0.12, 0.0]).T).min() > np.sqrt(0.03**2 + solution.tau) - 1e-6
    assert solution.equivalent_weights == ((solution.tau, 1.0),) * len(solution.multipliers)
    assert solution.qp_solves >= 1


def test_a_solution_that_falls_short_of_eta_is_not_called_solved():
    solution = solved(one_obstacle(0.9, noise=(0.15, 0.15)), BOWED, 'margin')
    assert solution.status is Status.ITERATION_LIMIT
    assert f'achieves eta {solution.eta:.6g} only' in solution.message


def test_where_nothing_is_feasible_it_returns_the_best_effort():
    wall = reach(make_obstacles([[0.15, 0.02], [0.15, -0.02]], [0.03, 0.03]))
    assert solved(wall, bowed((0, 0), (0.3, 0), 50, 0.0), 'margin').status is Status.INFEASIBLE


def test_a_name_that_is_not_registered_is_refused():
    with pytest.raises(InputError, match='lv, hc, optimal, algorithm1, fixed, margin'):
        solved(one_obstacle(), BOWED, 'nothing')


def test_a_strategy_without_a_result_is_named():
    STRATEGIES.register('forgetful', lambda problem, start, settings, deadline: None)
    with pytest.raises(InputError, match='strategy forgetful: expected a StrategyResult as its result, got None'):
        solved(one_obstacle(), BOWED, 'forgetful')
