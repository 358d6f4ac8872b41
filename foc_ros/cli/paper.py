"""The command: every study computed, drawn and written down."""

from __future__ import annotations

import argparse
import json
from pathlib import Path

from foc_ros.analysis.paper.numbers import as_json
from foc_ros.analysis.paper.studies import COUNT, FULL, Grid, Studies, collect_studies, studies
from foc_ros.analysis.paper.trends import Trend, trends
from foc_ros.core.errors import InputError
from foc_ros.io.terminal import show_table, track

FORMATS = ('png', 'pdf')
NUMBERS, TABLE = 'numbers.json', 'table.md'
COLUMNS = ('study', 'what the paper shows', 'paper', 'here', 'holds here')


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare what the command takes."""
    words = 'where figures, numbers and table are left (default: %(default)s); files of the same names are replaced'
    parser.add_argument('--output', type=Path, default=Path('paper_output'), metavar='DIR', help=words)


def run(arguments: argparse.Namespace) -> int:
    """Compute, draw, write and show."""
    found = perform(arguments.output)
    show_table(COLUMNS[:1] + COLUMNS[2:], [_cells(each)[:1] + _cells(each)[2:] for each in trends(found)])
    print(f'figures, {NUMBERS} and {TABLE} written to {arguments.output}')
    return 0


def perform(output: Path, grid: Grid = FULL) -> Studies:
    """Leave study1 to study7 (PNG, PDF), the numbers and the table in a directory; return what was computed.

    Raises InputError where the directory cannot be written, before anything is computed.
    """
    from foc_ros.reporting import paper_figures as figures  # a missing matplotlib is told before the work, not after it

    try:
        output.mkdir(parents=True, exist_ok=True)
        (output / TABLE).write_text('', encoding='utf-8')
        found = collect_studies(track(studies(grid), 'paper', COUNT))
        figures.write(found, output, FORMATS)
        (output / NUMBERS).write_text(json.dumps(as_json(found), indent=1, allow_nan=False) + '\n', encoding='utf-8')
        (output / TABLE).write_text(markdown(trends(found)), encoding='utf-8')
    except OSError as error:
        raise InputError('--output', 'a directory that can be written', f'{output}: {error.strerror}') from error
    return found


def markdown(found: tuple[Trend, ...]) -> str:
    """Return the table in Markdown."""
    rows = [COLUMNS, ('---',) * len(COLUMNS), *map(_cells, found)]
    return ''.join(f'| {" | ".join(row)} |\n' for row in rows)


def _cells(trend: Trend) -> tuple[str, ...]:
    return str(trend.study), trend.statement, trend.paper, trend.ours, 'yes' if trend.holds else 'no'
