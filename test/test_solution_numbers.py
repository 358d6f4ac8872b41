# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The numbers of a solution against finite differences and geometry."""

import math
import re

import numpy as np
import pytest
from reach_helpers import bowed, one_obstacle, reach, solved
from scipy.interpolate import CubicHermiteSpline

from foc_ros.core.obstacle_table import make_obstacles
from foc_ros.core.solution import Status

BOWED = bowed((0, 0), (0.3, 0), 50, 0.08)
EVERY = ['lv', 'hc', 'optimal', 'fixed', 'algorithm1']
WALL = make_obstacles([[0.15, 0.02], [0.15, -0.02]], [0.03, 0.03], ids=('left', 'right'))


@pytest.mark.parametrize('strategy', EVERY)
def test_an_infeasible_geometry_says_how_much_it_lacks_and_where(strategy):
    solution = solved(reach(WALL), bowed((0, 0), (0.3, 0), 50, 0.0), strategy)
    assert solution.status is Status.INFEASIBLE
    path = CubicHermiteSpline(np.arange(51), solution.path, solution.mean[:, 2:4] * solution.dt)
    distance = np.hypot(*(path(np.arange(0, 50, 1e-3))[:, None] - WALL.centre).T)
    asked = math.sqrt(0.03**2 + solution.tau)
    assert solution.violation == pytest.approx((asked - distance).max(), abs=2e-3)
    assert solution.violation > 0.005, 'between centres 4 cm apart there are 2 cm to each at best, of 3'
    identity, step = solution.violation_at
    assert asked - np.hypot(*(path(step) - WALL.centre[WALL.ids.index(identity)])) == pytest.approx(solution.violation, abs=1e-9)
    said = float(re.search(r'by up to (\S+) m', solution.message)[1])
    assert said == pytest.approx(solution.violation, rel=1e-2)
    assert solution.qp_solves >= 1


def augmented(solution):
    return sum(solution.costs.values())


def test_multipliers_are_what_a_metre_of_distance_costs():
    """J_aug of `fixed` by tau: rows ask for sqrt(E[R^2] + tau), so dJ/dtau is the sum of the multipliers / (2 sqrt(...))."""
    tau, step = 1e-3, 1e-6
    less, middle, more = (solved(one_obstacle(), BOWED, 'fixed', tau=tau + by, lam=1e3) for by in (-step, 0.0, step))
    measured = (augmented(more) - augmented(less)) / (2 * step)
    reach_m = math.sqrt(0.03**2 + 0.003**2 + tau)
    assert sum(value for _, _, value in middle.multipliers) / (2 * reach_m) == pytest.approx(measured, rel=1e-2)
    assert middle.equivalent_weights == ((tau, 1e3),) * len(middle.multipliers)


def test_the_rows_of_optimal_have_a_tau_and_a_lambda_each():
    """Tau is what the mean keeps beyond E[R^2]; lambda what a variance at the step costs: here one of the centre itself."""
    variance = 1e-8

    def optimum(centre_variance):
        made = make_obstacles([[0.12, 0.0]], [0.03], [0.003], centre_covariance=centre_variance * np.eye(2))
        return solved(reach(made, eta=0.8), BOWED, 'optimal')

    less, middle, more = (optimum(1e-6 + by) for by in (-variance, 0.0, variance))
    assert middle.equivalent_weights
    path = CubicHermiteSpline(np.arange(len(middle.mean)), middle.path, middle.mean[:, 2:4] * middle.dt)
    for (_, at, _), (tau, lam) in zip(middle.multipliers, middle.equivalent_weights, strict=True):
        kept = np.sum((path(at) - [0.12, 0.0]) ** 2) - (0.03**2 + 0.003**2)
        assert tau == pytest.approx(kept, rel=1e-3)
        assert lam > 0
    assert (middle.tau, middle.lam) == (0.0, 0.0)
    assert sum(lam for _, lam in middle.equivalent_weights) == pytest.approx(
        (more.effort - less.effort) / (2 * variance), rel=1e-2
    )
