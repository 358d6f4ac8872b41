"""The rows of the benchmark: each is a function `measure_...(is_quick)` that returns a `Result`.

`ROWS` maps the name of a row to its module and function, rows with a target first. A module is imported only when one of its
rows is measured, and so are the programs that the row compares with.
"""

from __future__ import annotations

from importlib import import_module

from measurement import Result

ROWS = {
    'cold_vs_naive_piqp': 'one_class.measure_against_piqp',
    'cold_vs_ipopt': 'one_class.measure_against_ipopt',
    'cold_vs_fatrop': 'one_class.measure_against_fatrop',
    'warm_vs_fatrop': 'one_class.measure_warm_against_fatrop',
    'warm_vs_cold': 'one_class.measure_warm_start',
    'tick_4x8': 'ticks.measure_4_classes',
    'tick_8x16': 'ticks.measure_8_classes',
    'far_obstacles': 'ticks.measure_far_obstacles',
    'steps_200': 'ticks.measure_200_steps',
    'piqp_share': 'shares.measure_piqp',
    'search_8': 'shares.measure_search_of_8',
    'search_300': 'shares.measure_search_of_300',
    'replay': 'replay.measure_replay',
    'node': 'node.measure_node',
    'cold_vs_naive_daqp': 'one_class.measure_against_daqp',
    'one_qp_vs_cvxpy': 'one_class.measure_against_cvxpy',
    'cold_vs_annealing': 'one_class.measure_against_annealing',
}


def measure_row(name: str, is_quick: bool) -> Result:
    """Measure a row in this process."""
    module, _, function = ROWS[name].partition('.')
    result: Result = getattr(import_module(f'rows.{module}'), function)(is_quick)
    return result
