"""The fast solution is that of the slow way: one full QP, linearised there, with every row and no working set, returns the same
mean.

Sequential QPs end where a QP returns the control that it is linearised at. `lv` and `hc` keep clear between the steps too; their
QP has a row for every obstacle at every step and at every time of a contact.
"""

import numpy as np
import pytest
from reach_helpers import solved
from varied_reaches import varied_reach

from foc_ros.core.kernels import freeze
from foc_ros.core.ocp.contacts.hermite import interpolate, interpolation_row
from foc_ros.core.ocp.problem import Problem
from foc_ros.core.ocp.qp import ObstacleRows, ReachingQP, clearance_qp, effort_cost
from foc_ros.core.ocp.working_set import solve_full
from foc_ros.core.types import Solution, Status

SCENES = 300
AGREE_M = 1e-6


def clearance_qp_with_contacts(problem: Problem, solution: Solution) -> ReachingQP:
    """Return the QP of `clearance_qp` with rows at the steps and at the times of the contacts, linearised at the solution."""
    steps = problem.horizon.steps
    further = np.array([time for _, time, _ in solution.multipliers])
    times = np.concatenate((np.arange(1, steps + 1), further))
    motion, trajectory = problem.terms.motion, problem.trajectory(solution.control.T.ravel())
    maps = np.array([[interpolation_row(motion.responses, time, x, y) for time in further] for x, y in ((1.0, 0.0), (0.0, 1.0))])
    maps = maps.reshape(2, len(further), 2 * steps)
    centres = problem.obstacles.centre[:, None] + times[None, :, None] * problem.drift[:, None]
    away = np.array([interpolate(trajectory, time, 0) for time in times]) - centres
    normals = away / np.linalg.norm(away, axis=2, keepdims=True)
    free = np.array([interpolate(motion.free, time, 0) for time in times])
    limits = np.sqrt(problem.size[0] + solution.tau)[:, None] + np.einsum('mta,mta->mt', normals, centres - free)
    positions = problem.horizon.maps[:2]
    rows = freeze(ObstacleRows(positions, maps, np.ones((2, 2 * steps)), normals, limits))
    return ReachingQP(effort_cost(problem, solution.lam), rows)


def slow_path(problem: Problem, solution: Solution, strategy: str) -> np.ndarray:
    """Return the mean (N, 2) of the full QP at a solution."""
    if strategy in ('lv', 'hc'):
        qp = clearance_qp_with_contacts(problem, solution)
    else:
        qp = clearance_qp(problem, effort_cost(problem, solution.lam), solution.path[1:], solution.tau)
    answer = solve_full(qp)
    assert answer is not None
    return problem.positions(answer.control)


@pytest.mark.parametrize('strategy', ['fixed', 'lv', 'hc'])
def test_full_qps_stay_where_the_fast_path_ends(strategy):
    compared, apart = 0, {}
    for seed in range(SCENES):
        made = varied_reach(seed)
        settings = {'tau': made.tau, 'lam': made.lam} if strategy == 'fixed' else {}
        solution = solved(made.problem, made.guess, strategy, **settings)
        if solution.status is not Status.SOLVED:
            continue
        compared += 1
        move = float(np.abs(slow_path(made.problem, solution, strategy) - solution.path[1:]).max())
        if move > AGREE_M:
            apart[seed] = move
    assert apart == {}
    assert compared > SCENES / 2, f'{compared} scenes compared'


@pytest.mark.parametrize('strategy', ['lv', 'hc'])
def test_the_mean_keeps_clear_between_the_steps(strategy):
    """At fifty times per step, to 1e-7 of the scene."""
    looked_at = 0
    for seed in range(60):
        problem, guess = (made := varied_reach(seed)).problem, made.guess
        solution = solved(problem, guess, strategy)
        if solution.status is not Status.SOLVED:
            continue
        trajectory = problem.trajectory(solution.control.T.ravel())
        times = np.linspace(1.0, problem.horizon.steps, 50 * (problem.horizon.steps - 1) + 1)
        positions = np.array([interpolate(trajectory, time, 0) for time in times])
        away = positions - problem.obstacles.centre[:, None] - times[:, None] * problem.drift[:, None]
        spare = np.linalg.norm(away, axis=2) - np.sqrt(problem.size[0] + solution.tau)[:, None]
        assert spare.min() > -1e-7 * problem.extent
        assert len(solution.multipliers) == 0 or spare.min() < 1e-4, 'touched at a time in between'
        looked_at += 1
    assert looked_at > 30
