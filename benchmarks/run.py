"""The benchmark: every row a ratio of medians within one run, peers on the identical problem, answers compared.

    python benchmarks/run.py [--json | --markdown] [--report FILE] [--only NAME ...] [--quick]

Each row is measured in a process of its own, with one thread for BLAS and OpenMP, ours and the peer in turn.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from catalogue import ROWS
from rich.console import Console
from rich.table import Table

from foc_ros.reporting import page

HERE = Path(__file__).resolve().parent
ONE_THREAD = dict.fromkeys(('OMP_NUM_THREADS', 'OPENBLAS_NUM_THREADS', 'MKL_NUM_THREADS'), '1')
HEADINGS = ('row', 'ours [ms]', 'peer [ms]', 'ratio', 'target', 'met', 'agree')

Row = dict[str, Any]


def measured(name: str, quick: bool) -> Row:
    """Measure a row in its own process; a row that fails says why instead, and is not met."""
    command = [sys.executable, str(HERE / 'row.py'), name, *(['--quick'] if quick else [])]
    path = os.pathsep.join([str(HERE.parent), *filter(None, [os.environ.get('PYTHONPATH')])])
    environment = os.environ | ONE_THREAD | {'PYTHONPATH': path}
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    if done.returncode:
        return {'name': name, 'ours_ms': None, 'peer_ms': None, 'ratio': None, 'agree': False, 'met': False, 'error': _why(done)}
    row: Row = json.loads(done.stdout.splitlines()[-1])
    return row


def _why(done: subprocess.CompletedProcess[str]) -> str:
    lines = done.stderr.strip().splitlines()
    return lines[-1] if lines else f'exit code {done.returncode}'


def cells(row: Row) -> tuple[str, ...]:
    """Return a row as texts under `HEADINGS`."""
    if 'error' in row:
        return row['name'], '', '', '', '', 'no', row['error']
    met = {True: 'yes', False: 'no', None: ''}[row['met']]
    figures = f'{row["ours_ms"]:.3g}', f'{row["peer_ms"]:.3g}', f'{row["ratio"]:.3g}'
    return row['name'], *figures, row['target'] or 'for the record', met, 'yes' if row['agree'] else 'no'


def table(rows: Iterable[Row]) -> Table:
    """Return the rows as a table for a terminal."""
    made = Table(*HEADINGS, title='One thread; ratios of medians, measured in turn')
    for row in rows:
        made.add_row(*cells(row))
    return made


def report(rows: Iterable[Row]) -> str:
    """Return the rows as a page in the look of all reports, with what each compares."""
    rows = list(rows)
    compared = [(row['name'], f'{row["ours"]}, against: {row["peer"]}', row['agreement']) for row in rows if 'error' not in row]
    body = (
        page.table(HEADINGS, map(cells, rows))
        + '<h2>What is compared</h2>'
        + page.table(('row', 'of what', 'agreement'), compared)
    )
    return page.page_of('Benchmark', body, [f'{row["name"]}: {row["error"]}' for row in rows if 'error' in row])


def markdown(rows: Iterable[Row]) -> str:
    """Return the rows as a table for doc/speed.md, and below it what each compares."""
    rows = list(rows)
    lines = ['| ' + ' | '.join(HEADINGS) + ' |', '|---' * len(HEADINGS) + '|']
    lines += ['| ' + ' | '.join((f'`{name}`', *rest)) + ' |' for name, *rest in map(cells, rows)]
    lines += ['']
    for row in rows:
        if 'error' not in row:
            extra = ''.join(f'; {key} {_short(value)}' for key, value in row['details'].items())
            lines.append(
                f'- `{row["name"]}`: {row["ours"]}, against: {row["peer"]}. Ratio {row["ratio_of"]}, '
                f'{row["repetitions"]} repetitions. {row["agreement"]}{extra}.'
            )
    return '\n'.join(lines)


def _short(value: object) -> str:
    return f'{value:.3g}' if isinstance(value, float) else str(value)


def main() -> int:
    """Run the rows of the command line; 1 where one could not be measured."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    shown = parser.add_mutually_exclusive_group()
    shown.add_argument('--json', action='store_true', help='print a list of {name, ours_ms, peer_ms, ratio, agree, ...}')
    shown.add_argument('--markdown', action='store_true', help='print the table of doc/speed.md')
    parser.add_argument('--only', nargs='+', choices=ROWS, default=list(ROWS), metavar='NAME', help=', '.join(ROWS))
    parser.add_argument('--quick', action='store_true', help='few repetitions, 5 s of the node: to see that it works')
    parser.add_argument('--report', type=Path, metavar='FILE', help='write an HTML page')
    chosen = parser.parse_args()
    rows = []
    for name in chosen.only:
        rows.append(measured(name, chosen.quick))
        print(*cells(rows[-1]), sep='  ', file=sys.stderr, flush=True)  # a whole run takes minutes
    if chosen.report is not None:
        chosen.report.write_text(report(rows), encoding='utf-8')
    if chosen.json:
        print(json.dumps(rows, indent=1))
    elif chosen.markdown:
        print(markdown(rows))
    else:
        Console().print(table(rows))
    return int(any('error' in row for row in rows))


if __name__ == '__main__':
    sys.exit(main())
