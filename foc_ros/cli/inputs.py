"""What the arguments of a command name is checked and read here, before the module of the command is imported.

Those modules import the solver, which takes seconds. Errors in a small file or a wrong name are answered without it.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from pathlib import Path

from foc_ros.core.errors import InputError
from foc_ros.io.outputs import (
    EVALUATION_PAGE,
    FIT_PAGE,
    SIMULATION_PAGE,
    check_file,
    check_folder,
    check_page,
    check_picture,
    check_report,
)


def read_inputs(arguments: argparse.Namespace) -> None:
    """Check the arguments of a command, and add what is read; raises FocError.

    `solve` gets `problem`, the reaching scene; `play` gets `sockets`, which are open; `evaluate`, `fit`,
    `learn` and `simulate` get `found`, the recordings by name.
    """
    if arguments.command in READERS:
        READERS[arguments.command](arguments)


def _read_solve(arguments: argparse.Namespace) -> None:
    from foc_ros.io.scene_file import load_scene

    if arguments.plot is not None:
        check_picture('--plot', arguments.plot)
    arguments.problem = load_scene(arguments.scene)


def _read_replay(arguments: argparse.Namespace) -> None:
    from foc_ros.io.bags import check_bag, check_new_bag

    if arguments.report is not None:
        check_report('--report', arguments.report)
    for option, file in (('--learn', arguments.learn), ('--operator', arguments.operator)):
        if file is not None:
            check_file(option, file)
    library = arguments.config.homotopy.library
    if arguments.learn is not None and library and Path(library) != arguments.learn:
        raise InputError('--learn', 'no other class library in homotopy.library', library)
    remapped = [role for role, _ in arguments.remap]
    if len(set(remapped)) < len(remapped):
        raise InputError('--remap', 'INPUT:=TOPIC, once for an input', ', '.join(remapped))
    check_bag(arguments.bag)
    if arguments.output is not None:
        check_new_bag(arguments.output)


def _read_learn(arguments: argparse.Namespace) -> None:
    from foc_ros.analysis.recordings import find_recordings

    check_file('--output', arguments.output)
    arguments.found = find_recordings(arguments.data)


def _read_fit(arguments: argparse.Namespace) -> None:
    check_file('--output', arguments.output)
    _read_recordings(arguments, FIT_PAGE)


def _read_evaluate(arguments: argparse.Namespace) -> None:
    _read_recordings(arguments, EVALUATION_PAGE)


def _read_recordings(arguments: argparse.Namespace, page: str) -> None:
    from foc_ros.analysis.recordings import find_recordings

    if arguments.report is not None:
        check_page('--report', arguments.report, page)
    arguments.found = find_recordings(arguments.data)


def _read_simulate(arguments: argparse.Namespace) -> None:
    from foc_ros.analysis.recordings import find_recordings
    from foc_ros.analysis.simulation.names import HUMAN_PATHS, OPERATORS

    if arguments.report is not None:
        check_page('--report', arguments.report, SIMULATION_PAGE)
    if arguments.operators is None:
        arguments.operators = OPERATORS if arguments.recordings is not None else OPERATORS[:-1]
    if HUMAN_PATHS in arguments.operators and arguments.recordings is None:
        raise InputError('--recordings', f'recordings of people for the operator {HUMAN_PATHS}', 'none')
    arguments.found = find_recordings(arguments.recordings) if HUMAN_PATHS in arguments.operators else {}


def _check_folder_of_output(arguments: argparse.Namespace) -> None:
    check_folder('--output', arguments.output)


def _read_play(arguments: argparse.Namespace) -> None:
    from foc_ros.play.address import open_sockets

    check_folder('--data', arguments.data)
    arguments.sockets = open_sockets(arguments.host, arguments.port)


READERS: dict[str, Callable[[argparse.Namespace], None]] = {
    'demo': _check_folder_of_output,
    'play': _read_play,
    'solve': _read_solve,
    'replay': _read_replay,
    'learn': _read_learn,
    'fit': _read_fit,
    'evaluate': _read_evaluate,
    'simulate': _read_simulate,
    'convert': _check_folder_of_output,
}
