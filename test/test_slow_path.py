"""The fast path answers as the slow one: at where it ends, one full QP, with every row and no working set, returns the same mean.

A QP linearised at its own answer is what sequential QPs end with: whoever follows them slowly, stays there.
"""

import numpy as np
import pytest
from reach_helpers import solved
from varied_reaches import varied_reach

from foc_ros.foc.optimal import surrogate_qp
from foc_ros.foc.qp import clearance_qp, effort_cost
from foc_ros.foc.records import Solution, Status
from foc_ros.foc.solver import WorkingSet, solve_full

SCENES = 300
AGREE_M = 1e-6


def slow_path(problem, solution: Solution, k: float | None) -> np.ndarray:
    """Return the mean (N, 2) of the full QP at a solution; k: of the surrogate's own rows, None for those of tau and lambda."""
    if k is None:
        qp = clearance_qp(problem, effort_cost(problem, solution.lam), solution.path[1:], solution.tau)
    else:
        row = {identity: index for index, identity in enumerate(problem.obstacles.ids)}
        active = WorkingSet(
            np.array([row[identity] for identity, _, _ in solution.multipliers], dtype=np.intp),
            np.array([step - 1 for _, step, _ in solution.multipliers], dtype=np.intp),
        )
        multipliers = np.array([value for _, _, value in solution.multipliers])
        qp = surrogate_qp(problem, solution.control.T.ravel(), active, multipliers, k)
    answer = solve_full(qp)
    assert answer is not None
    return problem.positions(answer.control)


@pytest.mark.parametrize('strategy', ['fixed', 'lv', 'hc', 'optimal'])
def test_full_qps_stay_where_the_fast_path_ends(strategy):
    compared, apart = 0, {}
    for seed in range(SCENES):
        made = varied_reach(seed)
        settings = {'tau': made.tau, 'lam': made.lam} if strategy == 'fixed' else {}
        solution = solved(made.problem, made.guess, strategy, **settings)
        if solution.status is not Status.SOLVED:
            continue
        free = strategy == 'optimal' and not solution.multipliers
        k = np.sqrt(made.problem.eta / (1 - made.problem.eta)) if strategy == 'optimal' and not free else None
        compared += 1
        move = float(np.abs(slow_path(made.problem, solution, k) - solution.path[1:]).max())
        if move > AGREE_M:
            apart[seed] = move
    assert apart == {}
    assert compared > SCENES / 2, f'{compared} scenes compared'
