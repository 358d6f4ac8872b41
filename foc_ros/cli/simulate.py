"""`simulate`: the closed-loop study of guidance with simulated operators, beside other assistance rules."""

from __future__ import annotations

import argparse
import json

from foc_ros.analysis.parallel import open_executor
from foc_ros.analysis.simulation.assistance import ASSISTANCE
from foc_ros.analysis.simulation.human_paths import read_tasks
from foc_ros.analysis.simulation.operators import HUMAN_PATHS, OPERATORS
from foc_ros.analysis.simulation.study import make_pairs, simulate, summarise
from foc_ros.analysis.simulation.tables import make_tables
from foc_ros.core.errors import InputError
from foc_ros.io.outputs import check_page
from foc_ros.io.terminal import show_table


def run(arguments: argparse.Namespace) -> int:
    """Run the study; the exit code is 0."""
    config = arguments.config
    every = OPERATORS if arguments.recordings is not None else OPERATORS[:-1]
    operators = every if arguments.operators is None else _split('--operators', arguments.operators, OPERATORS)
    assistance = ASSISTANCE if arguments.assistance is None else _split('--assistance', arguments.assistance, ASSISTANCE)
    if HUMAN_PATHS in operators and arguments.recordings is None:
        raise InputError('--recordings', f'recordings of people for the operator {HUMAN_PATHS}', 'none')
    if arguments.report is not None:
        from foc_ros.reporting.simulation_report import PAGE, write_report  # what is wrong is said before the work

        check_page('--report', arguments.report, PAGE)
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
