"""`fit`: find the parameters that explain an operator's recordings best, and write them as a parameter file for the node."""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from foc_ros.analysis.fitting.comparison import find_worse_positions
from foc_ros.analysis.fitting.estimates import Fit
from foc_ros.analysis.fitting.fit import fit_parameters
from foc_ros.analysis.fitting.tables import (
    COMPARISON_COLUMNS,
    PARAMETER_COLUMNS,
    SCORE_COLUMNS,
    format_comparison,
    format_parameters,
    format_scores,
    make_verdict,
)
from foc_ros.analysis.parallel import open_executor
from foc_ros.core.config import Config, flatten
from foc_ros.io.outputs import FIT_PAGE
from foc_ros.io.terminal import show_address, show_table, show_text
from foc_ros.ros.parameters import write_parameter_file


def run(arguments: argparse.Namespace) -> int:
    """Fit, write and show; return 2 where a recording could not be used, and the others were."""
    config, output = arguments.config, arguments.output
    if arguments.report is not None:
        from foc_ros.reporting.fit_report import write_report  # a missing library is reported before the work
    with open_executor(arguments) as executor:
        fit = fit_parameters(arguments.found, config, executor, may_lower_eta='eta' in arguments.allow)
    answer = make_answer(fit, config, output)
    if not _confirm(find_worse_positions(fit.comparison), 'positions' in arguments.allow, output):
        print(f'foc_ros fit: {output} is not written; --allow positions writes it all the same', file=sys.stderr)
        return 2
    write_parameter_file('--output', output, fit.config)
    if arguments.report is not None:
        write_report(arguments.report, arguments.data.resolve().name, answer)
    if arguments.json:
        print(json.dumps(answer, allow_nan=False))
    else:
        _show(answer)
        if arguments.report is not None:
            show_address(arguments.report / FIT_PAGE)
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
        'comparison': fit.comparison,
        'warnings': fit.warnings,
        'output': str(output),
        'node': [f'python -m foc_ros node {options}', f'ros2 run foc_ros foc_node {options}'],
    }


def _confirm(losses: Sequence[str], is_allowed: bool, output: Path) -> bool:
    """Say what becomes worse before the file is written; return whether that is allowed, which a terminal is asked for."""
    for loss in losses:
        print(f'foc_ros fit: {loss}', file=sys.stderr)
    if not losses or is_allowed:
        return True
    if not (sys.stdin.isatty() and sys.stdout.isatty()):
        return False
    return input(f'Write {output} all the same? [y/N] ').strip().lower() in ('y', 'yes')


def _show(answer: dict[str, Any]) -> None:
    show_table(PARAMETER_COLUMNS, format_parameters(answer))
    show_table(SCORE_COLUMNS, format_scores(answer))
    show_table(COMPARISON_COLUMNS, format_comparison(answer))
    for warning in answer['warnings']:
        show_text(f'note: {warning}')
    for sentence in make_verdict(answer):
        show_text(sentence)
    words = f'{answer["recordings"]} recordings; parameters written to {answer["output"]}. Run the node with them:'
    print('\n  '.join((words, *answer['node'])))
