"""`evaluate`: how well predictions meet recordings of people, beside simple baselines."""

from __future__ import annotations

import argparse
import json
import sys
from functools import partial
from pathlib import Path
from typing import Any

from foc_ros.analysis.evaluation.answer import answer_of
from foc_ros.analysis.evaluation.evaluation import evaluate
from foc_ros.analysis.evaluation.labels import check_labels
from foc_ros.analysis.evaluation.observe import observe
from foc_ros.analysis.evaluation.recordings import find_recordings
from foc_ros.analysis.evaluation.tables import tables
from foc_ros.analysis.evaluation.workers import add_worker_arguments, collected, workers
from foc_ros.core.errors import InputError
from foc_ros.io.terminal import show_table
from foc_ros.ros.parameters import given_config


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare what the command takes."""
    words = 'folder of bags, or of recordings.csv, goals.csv and obstacles.csv'
    parser.add_argument('data', type=Path, metavar='DATA', help=words)
    parser.add_argument('--params', type=Path, metavar='YAML', help="the node's parameter file")
    parser.add_argument('--json', action='store_true', help='print one JSON object')
    parser.add_argument('--report', type=Path, metavar='DIR', help='write a page with plots')
    add_worker_arguments(parser)


def run(arguments: argparse.Namespace) -> int:
    """Evaluate; 2 where a recording failed, 3 where all did."""
    config = given_config(arguments.params)
    if arguments.report is not None and arguments.report.is_file():
        raise InputError('--report', 'a folder', arguments.report)
    found = find_recordings(arguments.data)
    with workers(arguments) as executor:
        recordings, failed = collected(partial(observe, config=config), list(found.items()), executor, 'replay')
        for name, reason in failed.items():
            print(f'foc_ros evaluate: {name}: {reason}', file=sys.stderr)
        if not recordings:
            print(f'foc_ros evaluate: none of the {len(failed)} recordings could be evaluated', file=sys.stderr)
            return 3
        evaluation = evaluate(recordings, config.likelihood, executor)
    labels = check_labels(arguments.data, recordings)
    for name, words in labels.items():
        print(f'foc_ros evaluate: {name}: its label is not the way that it took: {words}', file=sys.stderr)
    answer = answer_of(evaluation, recordings, config, failed, labels)
    if arguments.report is not None:
        from foc_ros.reporting.evaluation_report import write_report

        write_report(arguments.report, arguments.data.resolve().name, answer)
    _print(answer, arguments.json)
    return 2 if failed else 0


def _print(answer: dict[str, Any], as_json: bool) -> None:
    if as_json:
        print(json.dumps(answer, allow_nan=False))
        return
    for title, columns, lines in tables(answer):
        show_table(columns, lines, title)
