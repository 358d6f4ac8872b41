"""The command: an operator's recordings in, the parameters that explain them best out, as a file that the node takes."""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path
from typing import Any

from foc_ros.analysis.evaluation.recordings import find_recordings
from foc_ros.analysis.evaluation.workers import add_worker_arguments, workers
from foc_ros.analysis.fitting.estimates import as_json
from foc_ros.analysis.fitting.fit import fit
from foc_ros.analysis.fitting.found import Fit
from foc_ros.core.config import Config, flatten
from foc_ros.core.errors import InputError
from foc_ros.io.terminal import show_table
from foc_ros.ros.parameters import dump_parameter_file, given_config

SCORES = {
    'ways': 'log-likelihood of the way taken [nat]',
    'positions': 'log-density of true positions [nat]',
    'inside_90': 'true positions in the 90 % ellipse of the likeliest way at 0.5 s',
    'inside_all_90': 'true positions in the 90 % region of all ways at 0.5 s',
}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare what the command takes."""
    words = 'folder of bags, or of recordings.csv, goals.csv and, unless there are none, obstacles.csv'
    parser.add_argument('data', type=Path, metavar='DATA', help=words)
    parser.add_argument('--output', type=Path, metavar='YAML', required=True, help='parameter file to write')
    parser.add_argument('--params', type=Path, metavar='FILE', help='parameter file to start from, and to take the rest from')
    parser.add_argument('--json', action='store_true', help='print one JSON object')
    parser.add_argument('--report', type=Path, metavar='DIR', help='write a page with plots')
    add_worker_arguments(parser)


def run(arguments: argparse.Namespace) -> int:
    """Fit, write and show; 2 where a recording could not be used, and the others were."""
    config = given_config(arguments.params)
    _check_output(arguments.output)
    if arguments.report is not None and arguments.report.is_file():
        raise InputError('--report', 'a folder', arguments.report)
    recordings = find_recordings(arguments.data)
    with workers(arguments) as executor:
        found = fit(recordings, config, executor)
    text = dump_parameter_file(found.config)
    try:
        arguments.output.write_text(text, encoding='utf-8')
    except OSError as error:
        raise InputError('--output', 'a file that can be written', f'{arguments.output}: {error.strerror}') from error
    if arguments.report is not None:
        from foc_ros.reporting.fit_report import write_report

        title = arguments.data.resolve().name
        write_report(arguments.report, title, _answer(found, config, arguments.output), SCORES)
    if arguments.json:
        print(json.dumps(_answer(found, config, arguments.output), allow_nan=False))
    else:
        _show(found, config, arguments.output)
    for name, reason in found.failed.items():
        print(f'foc_ros fit: {name}: {reason}', file=sys.stderr)
    return 2 if found.failed else 0


def node_commands(file: Path) -> tuple[str, str]:
    """Return how the node is run with a parameter file: without and with a ROS installation."""
    given = f'--ros-args --params-file {file}'
    return f'python -m foc_ros node {given}', f'ros2 run foc_ros foc_node {given}'


def _check_output(file: Path) -> None:
    """Tell before the work, not after it, that nothing can be written."""
    if file.is_dir() or not file.resolve().parent.is_dir():
        raise InputError('--output', 'a file in a directory that exists', file)


def _answer(found: Fit, given: Config, file: Path) -> dict[str, Any]:
    before = flatten(given)
    return {
        'recordings': found.recordings,
        'failed': found.failed,
        'parameters': {name: {**as_json(each), 'given': before[name]} for name, each in found.estimates.items()},
        'chosen': {name: {'value': value, 'given': before[name]} for name, value in found.chosen.items()},
        'scores': found.scores,
        'warnings': found.warnings,
        'output': str(file),
        'node': list(node_commands(file)),
    }


def _show(found: Fit, given: Config, file: Path) -> None:
    before = flatten(given)
    rows = [
        (each.name, f'{before[each.name]:.4g}', f'{each.value:.4g}', f'{each.low:.4g} to {each.high:.4g}', each.how)
        for each in found.estimates.values()
    ]
    rows += [(name, str(before[name]), value, '', 'positions and ways foretold') for name, value in found.chosen.items()]
    show_table(('parameter', 'given', 'fitted', '95 %', 'by'), rows)
    show_table(
        ('score', 'under', 'value'),
        [
            (SCORES[score], name, '-' if value is None else f'{value:.3f}')
            for score, values in found.scores.items()
            for name, value in values.items()
        ],
    )
    for warning in found.warnings:
        print(f'note: {warning}')
    here, installed = node_commands(file)
    print(f'{found.recordings} recordings; parameters written to {file}. Run the node with them:\n  {here}\n  {installed}')
