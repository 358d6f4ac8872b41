"""`simulate`: the closed-loop study of guidance with simulated operators, beside other assistance rules."""

from __future__ import annotations

import argparse
import json
from pathlib import Path

from foc_ros.analysis.parallel import add_worker_arguments, open_executor
from foc_ros.analysis.simulation.assistance import ASSISTANCE
from foc_ros.analysis.simulation.human_paths import read_tasks
from foc_ros.analysis.simulation.operators import HUMAN_PATHS, OPERATORS
from foc_ros.analysis.simulation.study import make_pairs, simulate, summarise
from foc_ros.analysis.simulation.tables import make_tables
from foc_ros.core.errors import InputError
from foc_ros.io.outputs import check_replaceable
from foc_ros.io.terminal import show_table
from foc_ros.ros.parameters import load_optional_config

MOST_TRIALS = 100_000


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of the command."""
    words = f'some of {", ".join(OPERATORS)} (default: all; {HUMAN_PATHS} with --recordings only)'
    parser.add_argument('--operators', metavar='A,B', help=words)
    parser.add_argument('--assistance', default=','.join(ASSISTANCE), metavar='A,B', help=f'some of {", ".join(ASSISTANCE)}')
    parser.add_argument('--trials', type=int, default=20, metavar='N', help='paired trials of each operator (default: 20)')
    parser.add_argument('--seed', type=int, default=0, metavar='S', help='equal seeds give equal results (default: 0)')
    parser.add_argument(
        '--recordings', type=Path, metavar='DATA', help=f'recordings of people, as for evaluate, for {HUMAN_PATHS}'
    )
    parser.add_argument('--params', type=Path, metavar='YAML', help="the node's parameter file")
    parser.add_argument('--json', action='store_true', help='print one JSON object')
    parser.add_argument('--report', type=Path, metavar='DIR', help='write a page with pictures')
    add_worker_arguments(parser)


def run(arguments: argparse.Namespace) -> int:
    """Run the study; the exit code is 0."""
    config = load_optional_config(arguments.params)
    every = OPERATORS if arguments.recordings is not None else OPERATORS[:-1]
    operators = every if arguments.operators is None else _split('--operators', arguments.operators, OPERATORS)
    assistance = _split('--assistance', arguments.assistance, ASSISTANCE)
    if HUMAN_PATHS in operators and arguments.recordings is None:
        raise InputError('--recordings', f'recordings of people for the operator {HUMAN_PATHS}', 'none')
    for name, value, low in (('--trials', arguments.trials, 1), ('--seed', arguments.seed, 0)):
        if not low <= value <= MOST_TRIALS:
            raise InputError(name, f'a whole number in [{low}, {MOST_TRIALS}]', value)
    if arguments.report is not None:
        from foc_ros.reporting.simulation_report import PAGE, write_report  # what is wrong is said before the work

        check_replaceable('--report', arguments.report / PAGE)
    tasks = read_tasks(arguments.recordings, config) if HUMAN_PATHS in operators else []
    with open_executor(arguments) as executor:
        pairs = make_pairs(operators, assistance, arguments.trials, arguments.seed, tasks)
        results = simulate(pairs, config, executor)
    cells = summarise(results, arguments.seed)
    if arguments.report is not None:
        write_report(arguments.report, cells, results)
    if arguments.json:
        print(json.dumps({'cells': cells, 'seed': arguments.seed}, allow_nan=False))
    else:
        for title, columns, lines in make_tables(cells):
            show_table(columns, lines, title)
    return 0


def _split(option: str, text: str, known: tuple[str, ...]) -> tuple[str, ...]:
    names = tuple(dict.fromkeys(text.split(',')))
    for name in names:
        if name not in known:
            raise InputError(option, f'names of {", ".join(known)}', name)
    return names
