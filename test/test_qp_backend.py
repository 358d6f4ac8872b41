"""QP backends: each solves a problem as PIQP does, for every strategy, and one from outside the package is used by its name."""

import numpy as np
import pytest
from reach_helpers import bowed, one_obstacle, reach

from foc_ros.core.config import FocConfig
from foc_ros.core.errors import InputError
from foc_ros.core.ocp.backend import Answer, DenseQP, solve_named, solve_piqp
from foc_ros.core.ocp.solve import solve_problem
from foc_ros.core.ocp.start import cold_start
from foc_ros.core.registry import QP_BACKENDS
from foc_ros.core.types import Status, make_obstacles

BOWED = bowed((0, 0), (0.3, 0), 50, 0.08)
OTHERS = pytest.mark.parametrize('backend', ['daqp', 'quadprog'])


def solved_by(backend: str, strategy: str, **values):
    problem = one_obstacle(0.85)
    return solve_problem(problem, cold_start(BOWED), FocConfig(qp_backend=backend, strategy=strategy, **values))


@OTHERS
@pytest.mark.parametrize('strategy', ['lv', 'hc', 'optimal', 'fixed', 'algorithm1'])
def test_every_strategy_has_the_same_solution_by_another_backend(strategy, backend):
    pytest.importorskip(backend, reason=f'optional data: the solver {backend} is not installed')
    values = {'tau': 1e-3, 'lam': 10.0} if strategy == 'fixed' else {'algorithm1_growth': 1.5}
    expected, other = solved_by('piqp', strategy, **values), solved_by(backend, strategy, **values)
    assert other.status is expected.status is Status.SOLVED
    np.testing.assert_allclose(other.path, expected.path, atol=1e-6)
    assert other.effort == pytest.approx(expected.effort, rel=1e-5)


@OTHERS
def test_a_class_without_a_path_is_told_by_another_backend_too(backend):
    pytest.importorskip(backend, reason=f'optional data: the solver {backend} is not installed')
    wall = reach(make_obstacles([[0.15, 0.02], [0.15, -0.02]], [0.03, 0.03]))
    settings = FocConfig(strategy='optimal', qp_backend=backend)
    assert solve_problem(wall, cold_start(bowed((0, 0), (0.3, 0), 50, 0.0)), settings).status is Status.INFEASIBLE


@pytest.mark.parametrize('strategy', ['lv', 'optimal', 'fixed', 'algorithm1'])
def test_a_registered_backend_is_used(strategy, monkeypatch):
    calls = []

    def count(qp: DenseQP) -> Answer:
        calls.append(len(qp.c))
        return solve_piqp(qp)

    monkeypatch.setattr(QP_BACKENDS, '_parts', dict(QP_BACKENDS._parts))
    QP_BACKENDS.register('counting', count)
    counted = solved_by('counting', strategy, algorithm1_growth=1.5)
    assert calls
    np.testing.assert_array_equal(counted.path, solved_by('piqp', strategy, algorithm1_growth=1.5).path)


def test_an_unknown_backend_is_refused_with_those_that_exist():
    with pytest.raises(InputError, match=r'piqp.*daqp'):
        solved_by('nothing', 'lv')


def test_backends_report_an_infeasible_problem():
    qp = DenseQP(np.eye(2), np.zeros(2), G=np.array([[1.0, 0.0], [-1.0, 0.0]]), g=np.array([1.0, 1.0]))
    assert not solve_piqp(qp).solved
    assert not solve_named(qp, 'piqp').solved


def test_a_problem_on_which_piqp_oscillates_is_solved_with_other_settings():
    P = np.array([[1.0, -0.8976, -0.9733], [-0.8976, 1.0, 0.9642], [-0.9733, 0.9642, 1.0]])
    qp = DenseQP(P, np.array([-0.4239, -1.0, -0.2773]), lower=np.zeros(3))
    answer = solve_piqp(qp)
    assert answer.solved
    gradient = P @ answer.x + qp.c
    assert answer.x.min() > -1e-8
    assert gradient.min() > -1e-8
    assert abs(gradient @ answer.x) < 1e-7
