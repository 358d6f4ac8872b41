"""All rows by name, those with targets first; each is imported only when it is measured, and so are its peers."""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module

from results import Result

Measure = Callable[[bool], Result]


def _row(module: str, function: str) -> Measure:
    def measure(quick: bool) -> Result:
        result: Result = getattr(import_module(f'rows.{module}'), function)(quick)
        return result

    return measure


ROWS: dict[str, Measure] = {
    'cold_vs_naive_piqp': _row('one_class', 'cold_vs_naive_piqp'),
    'cold_vs_ipopt': _row('one_class', 'cold_vs_ipopt'),
    'warm_vs_cold': _row('one_class', 'warm_vs_cold'),
    'tick_4x8': _row('ticks', 'tick_4x8'),
    'tick_8x16': _row('ticks', 'tick_8x16'),
    'far_obstacles': _row('ticks', 'far_obstacles'),
    'steps_200': _row('ticks', 'steps_200'),
    'piqp_share': _row('shares', 'piqp_share'),
    'search_8': _row('shares', 'search_8'),
    'search_300': _row('shares', 'search_300'),
    'replay': _row('playing', 'replay'),
    'node': _row('node', 'node'),
    'cold_vs_naive_daqp': _row('one_class', 'naive_daqp'),
    'one_qp_vs_cvxpy': _row('one_class', 'cvxpy_qp'),
    'cold_vs_annealing': _row('one_class', 'annealing'),
}
