"""`fit`: find the parameters that explain an operator's recordings best, and write them as a parameter file for the node."""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path
from typing import Any

from foc_ros.analysis.fitting.estimates import Fit
from foc_ros.analysis.fitting.fit import fit_parameters
from foc_ros.analysis.fitting.tables import PARAMETER_COLUMNS, SCORE_COLUMNS, format_parameters, format_scores
from foc_ros.analysis.parallel import open_executor
from foc_ros.analysis.recordings import find_recordings
from foc_ros.core.config import Config, flatten
from foc_ros.core.errors import InputError
from foc_ros.io.outputs import check_page
from foc_ros.io.terminal import show_table
from foc_ros.ros.parameters import write_parameter_file


def run(arguments: argparse.Namespace) -> int:
    """Fit, write and show; return 2 where a recording could not be used, and the others were."""
    config, output = arguments.config, arguments.output
    # before the work, not after it
    if output.is_dir() or not output.resolve().parent.is_dir():
        raise InputError('--output', 'a file in a directory that exists', output)
    if arguments.report is not None:
        from foc_ros.reporting.fit_report import PAGE, write_report

        check_page('--report', arguments.report, PAGE)
    recordings = find_recordings(arguments.data)
    with open_executor(arguments) as executor:
        fit = fit_parameters(recordings, config, executor)
    write_parameter_file('--output', output, fit.config)
    answer = make_answer(fit, config, output)
    if arguments.report is not None:
        write_report(arguments.report, arguments.data.resolve().name, answer)
    if arguments.json:
        print(json.dumps(answer, allow_nan=False))
    else:
        _show(answer)
    for name, reason in fit.failed.items():
        print(f'foc_ros fit: {name}: {reason}', file=sys.stderr)
    return 2 if fit.failed else 0


def make_answer(fit: Fit, given: Config, output: Path) -> dict[str, Any]:
    """Return a fit as plain values; node: the commands that run the node with it, without and with a ROS installation."""
    before, options = flatten(given), f'--ros-args --params-file {output}'
    return {
        'recordings': fit.recordings,
        'failed': fit.failed,
        'parameters': {name: {**each.as_json(), 'given': before[name]} for name, each in fit.estimates.items()},
        'chosen': {name: {'value': value, 'given': before[name]} for name, value in fit.chosen.items()},
        'scores': fit.scores,
        'warnings': fit.warnings,
        'output': str(output),
        'node': [f'python -m foc_ros node {options}', f'ros2 run foc_ros foc_node {options}'],
    }


def _show(answer: dict[str, Any]) -> None:
    show_table(PARAMETER_COLUMNS, format_parameters(answer))
    show_table(SCORE_COLUMNS, format_scores(answer))
    for warning in answer['warnings']:
        print(f'note: {warning}')
    words = f'{answer["recordings"]} recordings; parameters written to {answer["output"]}. Run the node with them:'
    print('\n  '.join((words, *answer['node'])))
