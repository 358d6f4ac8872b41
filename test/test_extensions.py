# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Parts from outside the package, each one function: a strategy, a plant, a likelihood rule and a QP backend."""

from dataclasses import replace

import numpy as np
import pytest
from reach_helpers import bowed, one_obstacle, solved

import foc_ros
from foc_ros.core.errors import InputError
from foc_ros.core.obstacles.risk import k_of_eta
from foc_ros.core.ocp.backend import DenseQP, solve_piqp
from foc_ros.core.ocp.strategies import Strategy, solve_fixed
from foc_ros.core.plant.models import PlantModel
from foc_ros.core.plant.plants import Plant
from foc_ros.core.registry import LIKELIHOOD_RULES, PLANTS, QP_BACKENDS, STRATEGIES
from foc_ros.core.solution import Status

BOWED = bowed((0, 0), (0.3, 0), 50, 0.08)
CUP = foc_ros.Circle((0.15, 0.01), radius=0.03, radius_stddev=0.003)


def solve_margin(problems, starts, settings, deadline):
    """Keep a little more than k standard deviations of the radius at the steps, as for a hand without noise."""
    results = []
    for problem, start in zip(problems, starts, strict=True):
        tau = 1.2 * k_of_eta(problem.eta) * float(np.sqrt(problem.size[1]).max(initial=0.0))
        results += solve_fixed([problem], [start], replace(settings, tau=tau), deadline)
    return [replace(each, aims_at_eta=True) for each in results]


def discretise_double_integrator(dt):
    A = np.block([[np.eye(2), dt * np.eye(2)], [np.zeros((2, 2)), np.eye(2)]])
    return Plant(A, np.vstack([dt**2 / 2 * np.eye(2), dt * np.eye(2)]), dt)


def solve_by_quadprog(qp):
    return QP_BACKENDS.get('quadprog')(qp)


@pytest.fixture(autouse=True)
def parts(monkeypatch):
    for registry in (STRATEGIES, PLANTS, LIKELIHOOD_RULES, QP_BACKENDS):
        monkeypatch.setattr(registry, '_parts', dict(registry._parts))
    strategy: Strategy = solve_margin
    foc_ros.register_strategy('margin', strategy)
    foc_ros.register_plant('double', lambda settings: PlantModel(discretise_double_integrator))
    foc_ros.register_likelihood_rule('linear', lambda costs, config: -config.beta * costs)
    foc_ros.register_qp_backend('outside', solve_by_quadprog)


def test_a_strategy_is_solved_by_its_name():
    problem = one_obstacle(0.8, noise=(0.0, 0.0))
    solution = solved(problem, BOWED, 'margin')
    assert solution.status is Status.SOLVED
    assert solution.eta >= 0.8 - 1e-5
    assert solution.tau == pytest.approx(1.2 * 2 * 2 * 0.03 * 0.003, rel=1e-2)
    assert np.hypot(*(solution.path - [0.12, 0.0]).T).min() > np.sqrt(0.03**2 + 0.003**2 + solution.tau) - 1e-6
    assert solution.equivalent_weights == ((solution.tau, 1.0),) * len(solution.multipliers)
    assert solution.qp_solves >= 1


def test_a_name_that_is_not_registered_is_refused():
    with pytest.raises(InputError, match='lv, hc, optimal, algorithm1, fixed, margin'):
        solved(one_obstacle(), BOWED, 'nothing')


@pytest.mark.parametrize('given', [None, [], [None]])
def test_a_strategy_without_results_is_named(given):
    STRATEGIES.register('forgetful', lambda problems, starts, settings, deadline: given)
    with pytest.raises(InputError, match='strategy forgetful: expected a list of StrategyResult'):
        solved(one_obstacle(), BOWED, 'forgetful')


@pytest.mark.parametrize('strategy', ['lv', 'hc', 'optimal'])
def test_a_plant_is_solved_by_every_strategy(strategy):
    config = foc_ros.Config().with_values({'foc.plant': 'double', 'foc.noise_x': 0.05, 'foc.noise_y': 0.05})
    for each in foc_ros.solve_classes((0, 0), (0.3, 0), [CUP], strategy=strategy, config=config):
        assert each.status is Status.SOLVED
        assert each.mean.shape == (51, 4)
        assert foc_ros.monte_carlo(each.solution, 1000).step[2] >= 0.9


def test_a_likelihood_rule_weighs_the_classes():
    config = foc_ros.Config().with_values({'likelihood.rule': 'linear'})
    classes = foc_ros.solve_classes((0, 0), (0.3, 0), [CUP], config=config)
    (first, second), (usual, _) = classes, foc_ros.solve_classes((0, 0), (0.3, 0), [CUP])
    assert first.cost < second.cost
    assert first.likelihood > usual.likelihood


def test_the_solvers_of_qpsolvers_are_backends():
    solvers = pytest.importorskip('qpsolvers', reason='qpsolvers is not installed').available_solvers
    assert next(iter(QP_BACKENDS)) == 'piqp'
    for name in solvers:
        assert callable(QP_BACKENDS.get(name))
        assert foc_ros.Config().with_values({'foc.qp_backend': name}).foc.qp_backend == name
    with pytest.raises(foc_ros.ParameterError, match=r'foc\.qp_backend: expected one of piqp'):
        foc_ros.Config().with_values({'foc.qp_backend': 'abacus'})


def test_a_problem_on_which_piqp_oscillates_is_solved_with_other_settings():
    P = np.array([[1.0, -0.8976, -0.9733], [-0.8976, 1.0, 0.9642], [-0.9733, 0.9642, 1.0]])
    qp = DenseQP(P, np.array([-0.4239, -1.0, -0.2773]), lower=np.zeros(3))
    answer = solve_piqp(qp)
    assert answer.solved
    gradient = P @ answer.x + qp.c
    assert min(answer.x.min(), gradient.min()) > -1e-8 and abs(gradient @ answer.x) < 1e-7


@pytest.mark.parametrize('strategy', ['lv', 'hc', 'optimal', 'fixed'])
def test_a_qp_backend_has_the_same_solution(strategy):
    pytest.importorskip('quadprog', reason='quadprog is not installed')
    one, other = (solved(one_obstacle(0.75), BOWED, strategy, tau=1e-3, qp_backend=each) for each in ('piqp', 'outside'))
    assert other.status is one.status is Status.SOLVED
    np.testing.assert_allclose(other.path, one.path, atol=3e-5)
    assert other.effort == pytest.approx(one.effort, rel=1e-4)
