"""The study as tables for the terminal and the report."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

COLUMNS = {
    'collision_rate': ('collisions [%]', 100.0, 1),
    'completion_s': ('time [s]', 1.0, 2),
    'min_clearance_m': ('clearance [mm]', 1e3, 1),
    'path_m': ('path [m]', 1.0, 3),
    'effort': ('effort [N² s]', 1.0, 2),
    'opposing_impulse': ('opposing impulse [N s]', 1.0, 3),
    'opposing_share': ('mean opposing force [% of f_max]', 100.0, 2),
    'wrong_way_s': ('extra time, wrong way [s]', 1.0, 2),
    'wrong_way_effort': ('extra effort, wrong way [N² s]', 1.0, 2),
}
"""Heading, factor and digits of every measure."""


def make_tables(cells: Sequence[Mapping[str, Any]]) -> Iterator[tuple[str, tuple[str, ...], list[tuple[str, ...]]]]:
    """Yield title, columns and rows for each operator, from the cells of `simulate --json`."""
    for operator in dict.fromkeys(cell['operator'] for cell in cells):
        rows = [cell for cell in cells if cell['operator'] == operator]
        title = f'{operator}: mean of {rows[0]["trials"]} paired trials, and bootstrap interval of 95 %'
        yield title, ('', *(heading for heading, _, _ in COLUMNS.values())), [_format_row(cell) for cell in rows]


def _format_row(cell: Mapping[str, Any]) -> tuple[str, ...]:
    return (cell['assistance'], *(_format(cell, name) for name in COLUMNS))


def _format(cell: Mapping[str, Any], name: str) -> str:
    _, factor, digits = COLUMNS[name]
    if cell[name] is None:
        return '-'
    low, high = cell[f'{name}_interval']
    return f'{factor * cell[name]:.{digits}f} ({factor * low:.{digits}f} to {factor * high:.{digits}f})'
