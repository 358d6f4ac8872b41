"""The Newton iteration ends where sequential QPs end, and contacts slide from one step to the next."""

import numpy as np
import pytest
from reach_helpers import bowed, make_obstacles, one_obstacle, reach

from foc_ros.core.kernels import freeze
from foc_ros.core.ocp.contacts.contacts import Contacts
from foc_ros.core.ocp.contacts.kkt_point import is_fixed_point, solve_at_fixed_times, solve_kkt_point
from foc_ros.core.ocp.qp import effort_cost
from foc_ros.core.ocp.sqp import converge
from foc_ros.core.ocp.working_set import WorkingSet

TAU, LAM = 5e-4, 1e4
BOWED = bowed((0.0, 0.0), (0.3, 0.0), 50, 0.06)


def solve_by_qps(problem, lam=LAM):
    """Return what the QPs end with, and its rows as contacts."""
    here = converge(problem, BOWED[1:], WorkingSet(), TAU, lam)
    return here, here.contacts


def slide(problem, control, contacts, tau, lam):
    """Return the control and the contacts of the solution, None where there is none."""
    found = solve_kkt_point(problem, control, contacts, tau, lam)
    return None if found is None else (found.control, found.contacts)


@pytest.mark.parametrize('factor', [0.5, 1.0, 2.0])
def test_held_at_its_steps_it_ends_where_the_qps_end(factor):
    problem = one_obstacle(0.9)
    here, contacts = solve_by_qps(problem)
    control, found = solve_at_fixed_times(problem, here.control, contacts, TAU, factor * LAM)
    there, expected = solve_by_qps(problem, factor * LAM)
    np.testing.assert_allclose(problem.positions(control), there.positions, atol=1e-7)
    np.testing.assert_array_equal(found.time, expected.time)
    np.testing.assert_allclose(found.multiplier, expected.multiplier, rtol=1e-3)


def test_a_contact_that_cannot_hold_at_its_step_holds_where_it_slides():
    """Held at one step, the mean would slip past it to either side; two steps straddle the place where one contact is enough."""
    problem = one_obstacle(0.9)
    here, contacts = solve_by_qps(problem)
    assert len(contacts.time) == 2
    alone = freeze(Contacts(contacts.obstacle[:1], contacts.time[:1], contacts.multiplier.sum(keepdims=True)))
    assert solve_at_fixed_times(problem, here.control, alone, TAU, LAM) is None
    control, found = slide(problem, here.control, contacts.merge(problem.first_alike), TAU, LAM)
    assert len(found.time) == 1
    assert contacts.time[0] < found.time[0] < contacts.time[1]
    assert np.abs(problem.positions(control) - here.positions).max() < 1e-3
    assert is_fixed_point(problem, control, found, TAU, LAM)
    assert not is_fixed_point(problem, control, found, TAU, 2 * LAM)


@pytest.mark.parametrize('factor', [2.0**-6, 2.0**6])
def test_with_more_weight_on_precision_the_contact_slides_to_later_times(factor):
    problem = one_obstacle(0.9)
    here, contacts = solve_by_qps(problem)
    control, first = slide(problem, here.control, contacts.merge(problem.first_alike), TAU, LAM)
    _, last = slide(problem, control, first, TAU, factor * LAM)
    assert (last.time[0] > first.time[0]) == (factor > 1)
    fresh, rows = solve_by_qps(problem, factor * LAM)
    _, again = slide(problem, fresh.control, rows.merge(problem.first_alike), TAU, factor * LAM)
    assert last.time[0] == pytest.approx(again.time[0], abs=1e-5)


def test_the_mean_is_the_least_that_keeps_clear_at_every_time():
    """Moved a little in any direction that keeps the contact, the cost rises by the square of it only."""
    problem = one_obstacle(0.9)
    here, contacts = solve_by_qps(problem)
    cost = effort_cost(problem, LAM)
    least, _ = slide(problem, here.control, contacts.merge(problem.first_alike), TAU, LAM)
    value = least @ (cost.hessian * least)
    assert here.control @ (cost.hessian * here.control) < value, 'rows at the steps alone let the mean cut the corner'
    finer, _ = slide(problem, least + 1e-3 * np.sin(np.arange(len(least))), contacts.merge(problem.first_alike), TAU, LAM)
    np.testing.assert_allclose(finer, least, atol=1e-6 * np.abs(least).max())


def test_the_same_circle_twice_is_touched_once():
    twice = make_obstacles([[0.12, 0.0]] * 2, [0.03] * 2, [0.003] * 2)
    problem = reach(twice, eta=0.9)
    here, contacts = solve_by_qps(problem)
    once, alone = solve_by_qps(one_obstacle(0.9))
    control, found = slide(problem, here.control, contacts.merge(problem.first_alike), TAU, LAM)
    expected, single = slide(one_obstacle(0.9), once.control, alone.merge(one_obstacle(0.9).first_alike), TAU, LAM)
    assert len(found.time) == len(single.time) == 1
    np.testing.assert_allclose(control, expected, atol=1e-6 * np.abs(expected).max())


def test_multipliers_that_are_not_known_count_as_equal():
    problem = one_obstacle(0.9)
    here, contacts = solve_by_qps(problem)
    unknown = freeze(contacts._replace(multiplier=np.full(len(contacts.time), np.nan)))
    control, found = slide(problem, here.control, unknown.merge(problem.first_alike), TAU, LAM)
    _, expected = slide(problem, here.control, contacts.merge(problem.first_alike), TAU, LAM)
    np.testing.assert_allclose(found.time, expected.time, atol=1e-6)
    assert np.isfinite(control).all()


def test_where_two_circles_leave_no_gap_there_is_no_way_between_two_steps_either():
    """Rows at the steps let the mean leap through the gap of 1 mm less than nothing."""
    shut = make_obstacles([[0.122, 0.03], [0.122, -0.03]], [0.0305, 0.0305], [0.0, 0.0])
    problem = reach(shut, noise=(0.0, 0.0), steps=10)
    straight = bowed((0.0, 0.0), (0.3, 0.0), 10, 0.0)
    leaps = converge(problem, straight[1:], WorkingSet(), 0.0, 0.0)
    assert leaps is not None
    contacts = leaps.contacts.merge(problem.first_alike)
    assert slide(problem, leaps.control, contacts, 0.0, 0.0) is None
