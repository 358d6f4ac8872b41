# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The studies of the paper, redone by the public API of foc_ros: figures, all numbers, and the seven checks as a table.

python examples/paper/paper.py [--output DIR]
"""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path

from checks import as_json, check_trends
from figures import write_figures
from studies import COUNT, FULL, Grid, Studies, compute_studies

COLUMNS = ('study', 'what the paper shows', 'paper', 'here', 'holds here')


def perform(output: Path, grid: Grid = FULL) -> Studies:
    """Write study1 to study7 (PNG, PDF), numbers.json and table.md to a folder; return what was computed."""
    output.mkdir(parents=True, exist_ok=True)
    (output / 'table.md').write_text('', encoding='utf-8')  # a folder that cannot be written is reported before the work
    studies = {}
    for study in compute_studies(grid):
        print(f'study {study.number} of {COUNT}: {study.title}', file=sys.stderr)
        studies[study.number] = study
    write_figures(studies, output)
    (output / 'numbers.json').write_text(json.dumps(as_json(studies), indent=1, allow_nan=False) + '\n', encoding='utf-8')
    checked = [(str(t.study), t.statement, t.paper, t.ours, 'yes' if t.holds else 'no') for t in check_trends(studies)]
    rows = [COLUMNS, ('---',) * len(COLUMNS), *checked]
    (output / 'table.md').write_text(''.join(f'| {" | ".join(row)} |\n' for row in rows), encoding='utf-8')
    return studies


def main() -> int:
    """Compute, draw, write and show; return 1 where a check does not hold, 2 where the folder cannot be written."""
    parser = argparse.ArgumentParser(description='Repeat the studies of the paper.')
    parser.add_argument('--output', type=Path, default=Path('paper_output'), metavar='DIR', help='default: %(default)s')
    output = parser.parse_args().output
    try:
        studies = perform(output)
    except OSError as error:
        print(f'paper: --output: expected a folder that can be written, got {output}: {error.strerror}', file=sys.stderr)
        return 2
    print((output / 'table.md').read_text('utf-8'), end='')
    print(f'figures, numbers.json and table.md written to {output}')
    return 0 if all(each.holds for each in check_trends(studies)) else 1


if __name__ == '__main__':
    sys.exit(main())
