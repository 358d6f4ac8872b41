"""Named parts that can be exchanged: strategies, plants, QP backends and likelihood rules.

A registry knows the names of its parts before it imports them, so that a parameter can be checked without loading the solver.
"""

from __future__ import annotations

from collections.abc import Iterator
from importlib import import_module
from typing import Any

from .errors import InputError


class Registry:
    """Parts of one kind by name.

    Parameters
    ----------
    kind
        What the parts are, for messages: ``'strategy'``.
    locations
        ``'module:attribute'`` of every built-in part by name. A part is imported when it is first asked for.
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
        """Add a part under a new name.

        Raises
        ------
        InputError
            If the name is taken or empty.
        """
        if not name or name in self:
            raise InputError(self.kind, f'a new name beside {", ".join(self)}', repr(name))
        self._parts[name] = part

    def get(self, name: str) -> Any:
        """Return the part of a name; raise InputError, naming all that exist, for an unknown one."""
        if name not in self:
            raise InputError(self.kind, f'one of {", ".join(self)}', repr(name))
        if name not in self._parts:
            module, _, attribute = self._locations[name].partition(':')
            self._parts[name] = getattr(import_module(module), attribute)
        return self._parts[name]


STRATEGIES = Registry(
    'strategy',
    {
        'lv': 'foc_ros.core.ocp.strategies.lv_hc:solve_lv',
        'hc': 'foc_ros.core.ocp.strategies.lv_hc:solve_hc',
        'optimal': 'foc_ros.core.ocp.strategies.optimal:solve_optimal',
        'algorithm1': 'foc_ros.core.ocp.strategies.algorithm1:solve_algorithm1',
        'fixed': 'foc_ros.core.ocp.strategies.fixed:solve_fixed',
    },
)
PLANTS = Registry(
    'plant',
    {
        'triple_integrator': 'foc_ros.core.dynamics.plants:make_triple_integrator',
        'damped_mass': 'foc_ros.core.dynamics.plants:make_damped_mass',
    },
)
LIKELIHOOD_RULES = Registry('likelihood rule', {'cost_ratio': 'foc_ros.core.likelihood:cost_ratio_logs'})
