"""Registries of exchangeable parts: built-in and registered names, and QP solvers of qpsolvers."""

import pytest

from foc_ros.core.config import Config
from foc_ros.core.errors import InputError, ParameterError
from foc_ros.core.registry import QP_BACKENDS, STRATEGIES, Registry


def test_a_registry_knows_its_names_before_it_imports_the_parts():
    registry = Registry('codec', {'json': 'json:dumps', 'wrong': 'no_such_module:part'})
    assert list(registry) == ['json', 'wrong']
    assert registry.get('json')([1]) == '[1]'
    registry.register('text', str)
    assert registry.get('text')(1) == '1'
    with pytest.raises(InputError, match='codec: expected one of json, wrong, text'):
        registry.get('yaml')
    for name in ('text', 'json', ''):
        with pytest.raises(InputError, match='a new name besides'):
            registry.register(name, str)


def test_the_strategies_are_the_choices_of_their_parameter():
    assert list(STRATEGIES) == ['lv', 'hc', 'optimal', 'algorithm1', 'fixed']
    for name in STRATEGIES:
        assert Config().with_values({'foc.strategy': name}).foc.strategy == name


def test_qp_backends_are_piqp_and_the_solvers_of_qpsolvers():
    solvers = pytest.importorskip('qpsolvers', reason='qpsolvers is not installed').available_solvers
    assert next(iter(QP_BACKENDS)) == 'piqp'
    for name in solvers:
        assert callable(QP_BACKENDS.get(name))
        assert Config().with_values({'foc.qp_backend': name}).foc.qp_backend == name
    with pytest.raises(ParameterError, match=r'foc\.qp_backend: expected one of piqp'):
        Config().with_values({'foc.qp_backend': 'abacus'})
