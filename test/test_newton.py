"""Newton steps end where sequential QPs end, wherever the contacts roll to on the way."""

import numpy as np
import pytest
from reach_helpers import bowed, one_obstacle

from foc_ros.foc.newton import newton
from foc_ros.foc.qp import effort_cost
from foc_ros.foc.sequential import CHANGES, converge, follow
from foc_ros.foc.solver import WorkingSet

TAU, LAM = 5e-4, 1e4
BOWED = bowed((0.0, 0.0), (0.3, 0.0), 50, 0.06)


@pytest.mark.parametrize('factor', [0.25, 2.0, 16.0, 64.0])
def test_following_ends_where_the_qps_end(factor):
    """With more weight on precision the contact rolls to later steps."""
    problem = one_obstacle(0.9)
    here = converge(problem, BOWED[1:], WorkingSet(), TAU, LAM)
    followed = follow(problem, here.positions, here.solution.active, here.solution.multipliers, TAU, factor * LAM)
    assert followed is not None
    qps = converge(problem, followed.positions, followed.solution.active, TAU, factor * LAM)
    assert qps.qp_solves == 1
    np.testing.assert_allclose(followed.positions, qps.positions, atol=1e-7)
    np.testing.assert_array_equal(followed.solution.active.step, qps.solution.active.step)
    np.testing.assert_allclose(followed.solution.multipliers, qps.solution.multipliers, rtol=1e-3)


def test_the_contact_rolls_on():
    """Otherwise the test above shows nothing of it."""
    problem = one_obstacle(0.9)
    here = converge(problem, BOWED[1:], WorkingSet(), TAU, LAM)
    there = follow(problem, here.positions, here.solution.active, here.solution.multipliers, TAU, 64 * LAM)
    assert there.solution.active.step.min() > here.solution.active.step.min()


def test_a_contact_that_cannot_hold_is_no_solution():
    """Alone at one step, where the mean would slip round the circle to either side."""
    problem = one_obstacle(0.9)
    here = converge(problem, BOWED[1:], WorkingSet(), TAU, LAM)
    assert len(here.solution.active) == 2
    alone = here.solution.active.only(np.array([True, False]))
    force = here.solution.multipliers.sum()[None]
    assert newton(problem, effort_cost(problem, LAM), here.positions, alone, force, TAU) is None


def test_a_contact_said_twice_shares_its_force():
    problem = one_obstacle(0.9)
    here = converge(problem, BOWED[1:], WorkingSet(), TAU, LAM)
    rows, forces = here.solution.active, here.solution.multipliers
    twice = WorkingSet(np.repeat(rows.obstacle, 2), np.repeat(rows.step, 2))
    found = newton(problem, effort_cost(problem, LAM), here.positions, twice, np.repeat(forces, 2) / 2, TAU, CHANGES)
    np.testing.assert_allclose(found.positions, here.positions, atol=1e-8)
    np.testing.assert_allclose(found.multipliers.reshape(-1, 2), (forces[:, None] / 2).repeat(2, axis=1), rtol=1e-2)
