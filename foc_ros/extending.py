# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The public Python API for parts from outside: strategies, plants, QP solvers, likelihood rules; `foc_ros` exports all of it."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from foc_ros.core import types
from foc_ros.core.errors import InputError
from foc_ros.core.ocp.problem import Problem
from foc_ros.core.ocp.solve import find_least_safety_factor
from foc_ros.core.registry import LIKELIHOOD_RULES, PLANTS, QP_BACKENDS, STRATEGIES, Registry


def register_strategy(name: str, function: Callable[..., Any]) -> None:
    """Add a strategy, a new value of `foc.strategy`.

    Parameters
    ----------
    name : str
        A new name; `InputError` is raised if it is taken.
    function : callable
        ``function(problems, starts, settings, deadline)``, which returns a list of `StrategyResult`: see
        `foc_ros.core.ocp.strategies`.
    """
    _register(STRATEGIES, name, function)


def get_strategy(name: str) -> Callable[..., Any]:
    """Return a strategy by its name, for a strategy that builds on another one; `InputError` is raised for an unknown name."""
    strategy: Callable[..., Any] = STRATEGIES.get(name)
    return strategy


def compute_eta(problem: Problem, control: types.Array) -> float:
    """Return the eta that a stacked control (2N,) achieves: the smallest over all obstacles and times."""
    return problem.risk.find_probability(find_least_safety_factor(problem, control)[0])


def register_plant(name: str, factory: Callable[..., Any]) -> None:
    """Add a plant, a new value of `foc.plant`.

    Parameters
    ----------
    name : str
        A new name; `InputError` is raised if it is taken.
    factory : callable
        ``factory(settings)``, which returns a `PlantModel`; `settings` are the parameters of the group `foc`.

    Examples
    --------
    A hand whose control is its acceleration [m/s^2]:

    >>> import numpy as np
    >>> import foc_ros
    >>> def discretise(dt):
    ...     position, velocity = np.eye(2) * dt**2 / 2, np.eye(2) * dt
    ...     A = np.block([[np.eye(2), np.eye(2) * dt], [np.zeros((2, 2)), np.eye(2)]])
    ...     return foc_ros.Plant(A, np.vstack([position, velocity]), dt)
    >>> foc_ros.register_plant('double_integrator', lambda settings: foc_ros.PlantModel(discretise))
    >>> config = foc_ros.Config().with_values({'foc.plant': 'double_integrator'})
    >>> foc_ros.solve((0, 0), (0.3, 0), config=config).mean.shape
    (31, 4)
    """
    _register(PLANTS, name, factory)


def register_qp_backend(name: str, solver: Callable[..., Any]) -> None:
    """Add a QP solver, a new value of `foc.qp_backend`; the solvers of qpsolvers need no registration.

    Parameters
    ----------
    name : str
        A new name; `InputError` is raised if it is taken.
    solver : callable
        ``solver(qp)``, from a `foc_ros.core.ocp.backend.DenseQP` to an `Answer`.
    """
    _register(QP_BACKENDS, name, solver)


def register_likelihood_rule(name: str, function: Callable[..., Any]) -> None:
    """Add a likelihood rule, a new value of `likelihood.rule`.

    Parameters
    ----------
    name : str
        A new name; `InputError` is raised if it is taken.
    function : callable
        ``function(costs, config)``: from the costs (k,) of k classes and the parameters of the group `likelihood` to the
        logarithms (k,) of their weights, which need no normalisation.

    Examples
    --------
    >>> import foc_ros
    >>> foc_ros.register_likelihood_rule('exponential', lambda costs, config: -config.beta * costs)
    """
    _register(LIKELIHOOD_RULES, name, function)


def _register(registry: Registry, name: str, part: Callable[..., Any]) -> None:
    if not callable(part):
        raise InputError(f'{registry.kind} {name}', 'a function', repr(part))
    registry.register(name, part)
