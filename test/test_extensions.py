# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Parts from outside the package, each one function, and the plants that `foc.plant` chooses."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from reach_helpers import bowed, one_obstacle, solved
from scipy.linalg import expm

import foc_ros
from foc_ros.core.config import Config
from foc_ros.core.errors import InputError
from foc_ros.core.obstacle_table import make_obstacles
from foc_ros.core.obstacles.risk import k_of_eta
from foc_ros.core.ocp.backend import DenseQP, solve_piqp
from foc_ros.core.ocp.strategies import Strategy, solve_fixed
from foc_ros.core.plant.models import PlantModel, TripleIntegratorModel, make_plant_model
from foc_ros.core.plant.plants import Plant, discretise_damped_mass, discretise_triple_integrator
from foc_ros.core.predict import predict
from foc_ros.core.registry import QP_BACKENDS, STRATEGIES
from foc_ros.core.situation import build_problem
from foc_ros.core.solution import Status
from foc_ros.core.tracks import NO_TRACKS
from foc_ros.core.types import HandState

BOWED = bowed((0, 0), (0.3, 0), 50, 0.08)
CUP = foc_ros.Circle((0.15, 0.01), radius=0.03, radius_stddev=0.003)


def solve_margin(problems, starts, settings, deadline):
    """Keep a little more than k standard deviations of the radius at the steps, as for a hand without noise."""
    results = []
    for problem, start in zip(problems, starts, strict=True):
        tau = 1.2 * k_of_eta(problem.eta) * float(np.sqrt(problem.size[1]).max(initial=0.0))
        results += solve_fixed([problem], [start], replace(settings, tau=tau), deadline)
    return [replace(each, aims_at_eta=True) for each in results]


@pytest.fixture(autouse=True)
def parts(registries):
    strategy: Strategy = solve_margin
    foc_ros.register_strategy('margin', strategy)
    foc_ros.register_likelihood_rule('linear', lambda costs, config: -config.beta * costs)
    foc_ros.register_qp_backend('outside', lambda qp: QP_BACKENDS.get('quadprog')(qp))
    yield
    make_plant_model.cache_clear()


def test_a_strategy_is_solved_by_its_name():
    problem = one_obstacle(0.8, noise=(0.0, 0.0))
    solution = solved(problem, BOWED, 'margin')
    assert solution.status is Status.SOLVED
    assert solution.eta >= 0.8 - 1e-5
    assert solution.tau == pytest.approx(1.2 * 2 * 2 * 0.03 * 0.003, rel=1e-2)
    assert np.hypot(*(solution.path - [0.12, 0.0]).T).min() > np.sqrt(0.03**2 + 0.003**2 + solution.tau) - 1e-6
    assert solution.equivalent_weights == ((solution.tau, 1.0),) * len(solution.multipliers)
    assert solution.qp_solves >= 1


@pytest.mark.parametrize('given', [None, [], [None]])
def test_a_strategy_without_results_is_named_and_one_that_is_not_registered_is_refused(given):
    STRATEGIES.register('forgetful', lambda problems, starts, settings, deadline: given)
    with pytest.raises(InputError, match='strategy forgetful: expected a list of StrategyResult'):
        solved(one_obstacle(), BOWED, 'forgetful')
    with pytest.raises(InputError, match='lv, hc, optimal, algorithm1, fixed, margin'):
        solved(one_obstacle(), BOWED, 'nothing')


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


STEPS, MASS, DAMPING = 50, 1.5, 4.0
MASS_CONFIG = Config().with_values(
    {'foc.plant': 'damped_mass', 'foc.plant_mass': MASS, 'foc.plant_damping': DAMPING, 'estimator.acceleration_time_s': 0.0}
)
MOVING = HandState(0, np.array([0.0, 0.0, 0.1, -0.05, 1.0, 0.0]), 1e-6 * np.eye(6), onset_ns=0, onset_position=np.zeros(2))
GOAL = np.array([[0.3, 0.0]])


@pytest.mark.parametrize('strategy', ['lv', 'hc', 'optimal'])
def test_a_damped_mass_avoids_obstacles_as_surely_as_wanted(strategy):
    candidates = foc_ros.solve_classes((0, 0), (0.3, 0), [CUP], strategy=strategy, config=MASS_CONFIG)
    assert len(candidates) == 2
    for each in candidates:
        assert each.status is foc_ros.Status.SOLVED
        assert each.eta >= 0.9 - 1e-5
        assert foc_ros.monte_carlo(each.solution, 2000).step[2] >= 0.9
        offset = each.mean[1:, :2] - CUP.centre
        distance = np.hypot(*offset.T)
        variance = np.einsum('ti,tij,tj->t', offset, each.covariance[1:, :2, :2], offset) / distance**2
        expected = 0.03**2 + 0.003**2 - distance**2
        total = 4 * 0.03**2 * 0.003**2 + 2 * 0.003**4 + 4 * distance**2 * variance
        assert (expected + k_of_eta(0.9) * np.sqrt(total)).max() <= 1e-6


def test_a_triple_integrator_from_outside_predicts_what_the_built_in_one_does():
    foc_ros.register_plant('outside', lambda settings: PlantModel(discretise_triple_integrator))
    config = Config().with_values({'foc.plant': 'outside'})
    values = {'foc.steps': STEPS, 'foc.endpoint_stddev': 0.005, 'duration.spread': 0.2, 'duration.wait_s': 0.1}
    scene = make_obstacles([[0.15, 0.01]], 0.03), GOAL
    ours, theirs = (predict(each.with_values(values), MOVING, *scene, NO_TRACKS)[0] for each in (Config(), config))
    assert [each.label for each in ours.candidates] == [each.label for each in theirs.candidates]
    for one, other in zip(ours.candidates, theirs.candidates, strict=True):
        assert_allclose(other.mean, one.mean, atol=1e-6 * np.abs(one.mean).max())
        exact = one.covariance[:, :2, :2]
        assert_allclose(other.covariance[:, :2, :2], exact, atol=0.03 * np.abs(exact).max())
        assert other.likelihood == pytest.approx(one.likelihood, rel=1e-6)
    models = make_plant_model(config.foc), TripleIntegratorModel()
    noise, exact = (model.compute_process_covariance(0.02, STEPS, False)[:, 0, 0] for model in models)
    assert_allclose(noise, exact, atol=0.02 * exact.max())


def test_what_is_no_plant_is_refused():
    force = np.ones((4, 2))
    for states, B, dt in ((3, force[:3], 0.1), (4, force[:, :1], 0.1), (4, np.nan * force, 0.1), (4, force, 0.0)):
        with pytest.raises(InputError, match='plant'):
            Plant(np.eye(states), B, dt)
    foc_ros.register_plant('wrong', lambda settings: discretise_triple_integrator(0.02))
    with pytest.raises(InputError, match='plant wrong: expected a factory that returns a PlantModel'):
        build_problem(Config().with_values({'foc.plant': 'wrong'}), MOVING, make_obstacles(), GOAL[0], 1.0)
    with pytest.raises(InputError, match='4 to 6 states'):
        PlantModel(lambda dt: Plant(np.eye(8), np.ones((8, 2)), dt))
    with pytest.raises(foc_ros.ParameterError, match=r'foc\.plant: expected one of triple_integrator, damped_mass'):
        Config().with_values({'foc.plant': 'unicycle'})


def zero_order_hold(a, b, dt):
    n, m = b.shape
    block = expm(np.block([[a, b], [np.zeros((m, n + m))]]) * dt)
    return block[:n, :n], block[:n, n:]


@pytest.mark.parametrize('damping', [None, 0.0, 1e-6, 0.3, 5.0, 80.0])
def test_plants_are_exact_discretisations(damping):
    if damping is None:
        plant, motion, effect = discretise_triple_integrator(0.03), np.diag([1.0, 1.0], k=1), [[0.0], [0.0], [1.0]]
    else:
        plant = discretise_damped_mass(0.03, 1.7, damping)
        motion, effect = np.array([[0.0, 1.0], [0.0, -damping / 1.7]]), [[0.0], [1.0 / 1.7]]
    A, B = zero_order_hold(np.kron(motion, np.eye(2)), np.kron(effect, np.eye(2)), 0.03)
    assert_allclose(plant.A, A, rtol=1e-9, atol=1e-12)
    assert_allclose(plant.B, B, rtol=1e-9, atol=1e-12)
