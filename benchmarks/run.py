# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The benchmark. Each row is a ratio of medians within one run.

    python benchmarks/run.py [--json] [--only NAME ...] [--quick]

Each row is measured in a process of its own, with one thread for BLAS and OpenMP. Ours and the peer take turns on the identical
problem, and their answers are compared.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

from rows import ROWS

from foc_ros.io.terminal import show_table

HERE = Path(__file__).resolve().parent
ONE_THREAD = dict.fromkeys(('OMP_NUM_THREADS', 'OPENBLAS_NUM_THREADS', 'MKL_NUM_THREADS'), '1')
HEADINGS = ('row', 'ours [ms]', 'peer [ms]', 'peer / ours', 'agree')
LONGEST_S = 600.0
"""Time after which a row is given up: a peer may not end."""

Row = dict[str, Any]
"""The JSON object of a result and the name of its row, or of an error."""


def run_row(name: str, is_quick: bool) -> Row:
    """Measure a row in its own process. The row of a failed measurement contains the error."""
    command = [sys.executable, str(HERE / 'run.py'), '--in-this-process', '--only', name, *(['--quick'] if is_quick else [])]
    path = os.pathsep.join([str(HERE.parent), *filter(None, [os.environ.get('PYTHONPATH')])])
    environment = os.environ | ONE_THREAD | {'PYTHONPATH': path}
    try:
        done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False, timeout=LONGEST_S)
        error = (done.stderr.strip().splitlines() or [f'exit code {done.returncode}'])[-1] if done.returncode else None
    except subprocess.TimeoutExpired:
        error = f'not ready after {LONGEST_S:g} s'
    if error is not None:
        return {'name': name, 'ours_ms': None, 'peer_ms': None, 'ratio': None, 'agree': False, 'error': error}
    row: Row = {'name': name} | json.loads(done.stdout.splitlines()[-1])
    return row


def format_cells(row: Row) -> tuple[str, ...]:
    """Return the texts of a row under `HEADINGS`."""
    if 'error' in row:
        return row['name'], '', '', '', row['error']
    numbers = f'{row["ours_ms"]:.3g}', f'{row["peer_ms"]:.3g}', f'{row["ratio"]:.3g}'
    return row['name'], *numbers, 'yes' if row['agree'] else 'no'


def main() -> int:
    """Run the rows of the command line. The exit code is 1 if one could not be measured."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('--json', action='store_true', help='print a list of {name, ours_ms, peer_ms, ratio, agree, ...}')
    parser.add_argument('--in-this-process', action='store_true', help=argparse.SUPPRESS)
    parser.add_argument('--only', nargs='+', choices=ROWS, default=list(ROWS), metavar='NAME', help=', '.join(ROWS))
    parser.add_argument('--quick', action='store_true', help='few repetitions, for a first look')
    chosen = parser.parse_args()
    if chosen.in_this_process:
        for name in chosen.only:
            print(json.dumps(ROWS[name](chosen.quick).to_json()))
        return 0
    rows = []
    for name in chosen.only:
        rows.append(run_row(name, chosen.quick))
        print(*format_cells(rows[-1]), sep='  ', file=sys.stderr, flush=True)  # a whole run takes minutes
    if chosen.json:
        print(json.dumps(rows, indent=1))
    else:
        show_table(HEADINGS, map(format_cells, rows), 'One thread; ratios of medians, measured in turn')
    return int(any('error' in row for row in rows))


if __name__ == '__main__':
    sys.exit(main())
