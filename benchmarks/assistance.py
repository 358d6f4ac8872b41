#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The study of `foc_ros simulate` with the assistance rules of others beside its own; it prints the same cells.

python benchmarks/assistance.py [--operators A,B] [--assistance A,B] [--trials N] [--seed S] [--params YAML] [--json]
"""

from __future__ import annotations

import argparse
import json
import os
import sys
from pathlib import Path

from assistance_rules import RIVALS

from foc_ros.analysis.parallel import open_workers
from foc_ros.analysis.recordings import find_recordings
from foc_ros.analysis.simulation import HUMAN_PATHS, OPERATORS
from foc_ros.analysis.simulation.operators import read_tasks
from foc_ros.analysis.simulation.study import RULES, make_pairs, make_tables, simulate, summarise
from foc_ros.core.config import Config
from foc_ros.core.errors import FocError
from foc_ros.io.terminal import show_table
from foc_ros.ros.parameters import load_parameter_file

ALL = {**RULES, **RIVALS}


def main() -> int:
    """Run the study and print it."""
    parser = argparse.ArgumentParser(description='Guidance of foc_ros beside the assistance rules of others.')
    parser.add_argument('--operators', default=','.join(OPERATORS[:-1]), metavar='A,B', help='default: %(default)s')
    parser.add_argument('--assistance', default=','.join(ALL), metavar='A,B', help='default: %(default)s')
    parser.add_argument('--trials', type=int, default=20, metavar='N', help='paired trials (default: %(default)s)')
    parser.add_argument('--seed', type=int, default=0, metavar='S', help='default: %(default)s')
    parser.add_argument('--recordings', type=Path, metavar='DATA', help=f'recordings of people, for the operator {HUMAN_PATHS}')
    parser.add_argument('--params', type=Path, metavar='YAML', help='parameter file')
    parser.add_argument('--workers', type=int, default=len(os.sched_getaffinity(0)), metavar='N', help='worker processes')
    parser.add_argument('--json', action='store_true', help='print one JSON object')
    given = parser.parse_args()
    operators, rules = given.operators.split(','), given.assistance.split(',')
    for option, names, known in (('--operators', operators, OPERATORS), ('--assistance', rules, ALL)):
        if unknown := set(names) - set(known):
            parser.error(f'{option}: expected names of {", ".join(known)}, got {", ".join(sorted(unknown))}')
    if HUMAN_PATHS in operators and given.recordings is None:
        parser.error(f'--recordings: expected recordings of people for the operator {HUMAN_PATHS}, got none')
    try:
        config = Config() if given.params is None else load_parameter_file(given.params)
        tasks = read_tasks(find_recordings(given.recordings).values(), config) if HUMAN_PATHS in operators else []
        with open_workers(given.workers):
            pairs = make_pairs(operators, rules, given.trials, given.seed, tasks)
            cells = summarise(simulate(pairs, config, ALL), given.seed)
    except FocError as error:
        parser.error(str(error))
    if given.json:
        print(json.dumps({'cells': cells, 'seed': given.seed}, allow_nan=False))
        return 0
    for title, columns, lines in make_tables(cells):
        show_table(columns, lines, title)
    return 0


if __name__ == '__main__':
    sys.exit(main())
