"""`paper`: compute, draw and tabulate the paper's studies."""

from __future__ import annotations

import argparse
import json
from pathlib import Path

from foc_ros.analysis.paper.numbers import as_json
from foc_ros.analysis.paper.studies import COUNT, FULL, Grid, Studies, compute_studies
from foc_ros.analysis.paper.trends import Trend, check_trends
from foc_ros.core.errors import InputError
from foc_ros.io.terminal import show_progress, show_table

FORMATS = ('png', 'pdf')
NUMBERS, TABLE = 'numbers.json', 'table.md'
COLUMNS = ('study', 'what the paper shows', 'paper', 'here', 'holds here')


def run(arguments: argparse.Namespace) -> int:
    """Compute, draw, write and show."""
    studies = perform(arguments.output)
    show_table(COLUMNS[:1] + COLUMNS[2:], [cells[:1] + cells[2:] for cells in map(_format_cells, check_trends(studies))])
    print(f'figures, {NUMBERS} and {TABLE} written to {arguments.output}')
    return 0


def perform(output: Path, grid: Grid = FULL) -> Studies:
    """Write study1 to study7 (PNG, PDF), the numbers and the table to a directory; return what was computed.

    Raises InputError where the directory cannot be written, before anything is computed.
    """
    from foc_ros.reporting import paper_figures  # a missing matplotlib is reported before the work, not after it

    try:
        output.mkdir(parents=True, exist_ok=True)
        (output / TABLE).write_text('', encoding='utf-8')
        studies = {study.number: study for study in show_progress(compute_studies(grid), 'paper', COUNT)}
        paper_figures.write_figures(studies, output, FORMATS)
        (output / NUMBERS).write_text(json.dumps(as_json(studies), indent=1, allow_nan=False) + '\n', encoding='utf-8')
        rows = [COLUMNS, ('---',) * len(COLUMNS), *map(_format_cells, check_trends(studies))]
        (output / TABLE).write_text(''.join(f'| {" | ".join(row)} |\n' for row in rows), encoding='utf-8')
    except OSError as error:
        raise InputError('--output', 'a directory that can be written', f'{output}: {error.strerror}') from error
    return studies


def _format_cells(trend: Trend) -> tuple[str, ...]:
    return str(trend.study), trend.statement, trend.paper, trend.ours, 'yes' if trend.holds else 'no'
