"""`evaluate`: compare predictions with recordings of people, beside simple baselines."""

from __future__ import annotations

import argparse
import json
import sys
from functools import partial

from foc_ros.analysis.evaluation.evaluate import evaluate, find_label_mismatches
from foc_ros.analysis.evaluation.observations import observe, observe_in_order
from foc_ros.analysis.evaluation.tables import make_tables
from foc_ros.analysis.parallel import collect, open_executor
from foc_ros.analysis.recordings import group_by_operator
from foc_ros.io.outputs import EVALUATION_PAGE
from foc_ros.io.terminal import show_address, show_table, show_text


def run(arguments: argparse.Namespace) -> int:
    """Evaluate; return 2 where a recording failed, 3 where all did."""
    config = arguments.config
    if arguments.report is not None:
        from foc_ros.reporting.evaluation_report import write_report  # a missing library is reported before the work
    with open_executor(arguments) as executor:
        if arguments.in_order:
            operators = list(group_by_operator(arguments.found).items())
            parts, failed = collect(partial(observe_in_order, config=config), operators, executor, 'replay')
            recordings = [each for observed, _ in parts for each in observed]
            failed |= {name: reason for _, reasons in parts for name, reason in reasons.items()}
        else:
            recordings, failed = collect(partial(observe, config=config), list(arguments.found.items()), executor, 'replay')
        for name, reason in failed.items():
            print(f'foc_ros evaluate: {name}: {reason}', file=sys.stderr)
        if not recordings:
            print(f'foc_ros evaluate: none of the {len(failed)} recordings could be evaluated', file=sys.stderr)
            return 3
        answer = evaluate(recordings, config, executor)
    mismatches = find_label_mismatches(arguments.data, recordings)
    for name, words in mismatches.items():
        print(f'foc_ros evaluate: {name}: the label differs from the recorded path: {words}', file=sys.stderr)
    answer |= {'failed': failed, 'labels_not_taken': mismatches}
    if arguments.report is not None:
        write_report(arguments.report, arguments.data.resolve().name, answer)
    if arguments.json:
        print(json.dumps(answer, allow_nan=False))
    else:
        for title, columns, lines in make_tables(answer):
            show_table(columns, lines, title)
        for sentence in answer['verdict']:
            show_text(sentence)
        if arguments.report is not None:
            show_address(arguments.report / EVALUATION_PAGE)
    return 2 if failed else 0
