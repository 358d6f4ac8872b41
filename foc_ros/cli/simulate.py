"""`simulate`: the closed-loop study of simulated operators with and without guidance."""

from __future__ import annotations

import argparse
import json

from foc_ros.analysis.parallel import open_executor
from foc_ros.analysis.simulation.human_paths import read_tasks
from foc_ros.analysis.simulation.study import make_pairs, simulate, summarise
from foc_ros.analysis.simulation.tables import make_tables
from foc_ros.io.outputs import SIMULATION_PAGE
from foc_ros.io.terminal import show_address, show_table


def run(arguments: argparse.Namespace) -> int:
    """Run the study; the exit code is 0."""
    config = arguments.config
    if arguments.report is not None:
        from foc_ros.reporting.simulation_report import write_report  # a missing library is reported before the work
    tasks = read_tasks(arguments.found.values(), config) if arguments.found else []
    with open_executor(arguments) as executor:
        pairs = make_pairs(arguments.operators, arguments.assistance, arguments.trials, arguments.seed, tasks)
        results = simulate(pairs, config, executor)
    cells = summarise(results, arguments.seed)
    if arguments.report is not None:
        write_report(arguments.report, cells, results)
    if arguments.json:
        print(json.dumps({'cells': cells, 'seed': arguments.seed}, allow_nan=False))
    else:
        for title, columns, lines in make_tables(cells):
            show_table(columns, lines, title)
        if arguments.report is not None:
            show_address(arguments.report / SIMULATION_PAGE)
    return 0
