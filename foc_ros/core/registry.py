# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Named parts that can be exchanged: strategies, plants, QP backends and likelihood rules.

A registry knows the names of its parts before it imports them, so that a parameter can be checked without loading the solver.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from importlib import import_module
from typing import Any

from .errors import InputError


class Registry:
    """Parts of one kind by name.

    kind: what the parts are, for messages, such as 'strategy'; locations: 'module:attribute' of every built-in part by name. A
    part is imported when it is first used.
    """

    def __init__(self, kind: str, locations: dict[str, str]) -> None:
        self.kind = kind
        self._locations = dict(locations)
        self._parts: dict[str, Any] = {}

    def __iter__(self) -> Iterator[str]:
        return iter(dict.fromkeys((*self._locations, *self._parts)))

    def __contains__(self, name: object) -> bool:
        return name in self._locations or name in self._parts

    def register(self, name: str, part: Any) -> None:
        """Add a part under a new name; raise InputError if the name is taken or empty."""
        if not name or name in self:
            raise InputError(self.kind, f'a new name besides {", ".join(self)}', repr(name))
        self._parts[name] = part

    def get(self, name: str) -> Any:
        """Return the part of a name; raise InputError, which lists all names, for an unknown one."""
        if name not in self:
            raise InputError(self.kind, f'one of {", ".join(self)}', repr(name))
        if name not in self._parts:
            module, _, attribute = self._locations[name].partition(':')
            self._parts[name] = getattr(import_module(module), attribute)
        return self._parts[name]


class QPBackendRegistry(Registry):
    """QP backends by name: PIQP, those that were registered, and every solver that qpsolvers finds installed."""

    def __contains__(self, name: object) -> bool:
        return super().__contains__(name) or name in _find_qpsolvers()

    def get(self, name: str) -> Any:
        """Return the solver of a name, a function from `DenseQP` to `Answer`; raise InputError, which lists all names."""
        if not super().__contains__(name):
            if name not in (solvers := _find_qpsolvers()):
                raise InputError(self.kind, f'one of {", ".join(dict.fromkeys((*self, *solvers)))}', repr(name))
            self._parts[name] = partial(import_module('foc_ros.core.ocp.backend').solve_named, backend=name)
        return super().get(name)


def _find_qpsolvers() -> list[str]:
    """Return the names of the solvers that qpsolvers can use here; none where it is not installed."""
    try:
        solvers: list[str] = import_module('qpsolvers').available_solvers
    except ImportError:
        return []
    return solvers


STRATEGIES = Registry(
    'strategy',
    {
        'lv': 'foc_ros.core.ocp.lv_hc:solve_lv',
        'hc': 'foc_ros.core.ocp.lv_hc:solve_hc',
        'optimal': 'foc_ros.core.ocp.strategies:solve_optimal',
        'algorithm1': 'foc_ros.core.ocp.strategies:solve_algorithm1',
        'fixed': 'foc_ros.core.ocp.strategies:solve_fixed',
    },
)
PLANTS = Registry(
    'plant',
    {
        'triple_integrator': 'foc_ros.core.plant.models:TripleIntegratorModel',
        'damped_mass': 'foc_ros.core.plant.models:make_damped_mass',
    },
)
QP_BACKENDS = QPBackendRegistry('QP backend', {'piqp': 'foc_ros.core.ocp.backend:solve_piqp'})
LIKELIHOOD_RULES = Registry('likelihood rule', {'cost_ratio': 'foc_ros.core.likelihood:cost_ratio_logs'})
