"""The program `foc_ros` and its commands. A command's module is imported only when the command is run.

Exit codes: 0 done; 2 the input is wrong, and a line on standard error for each error names field, value and bound; 3 no candidate
could be solved; 130 after an interrupt and 141 if the reader of standard output has closed it, both as in a shell. If standard
output cannot be written, for example because its disk is full, the code is 2.
"""

from __future__ import annotations

import argparse
import os
import re
import sys
from collections.abc import Sequence
from importlib import import_module
from io import TextIOWrapper
from pathlib import Path
from typing import Any, NoReturn

from foc_ros.core.errors import FocError, list_messages, print_warnings, suggest

from . import arguments as declarations
from .inputs import read_inputs
from .interrupts import INTERRUPTED, handle_interrupts

COMMANDS = {
    'demo': 'play the packaged recording to the node and show its predictions',
    'node': 'run the node; further arguments are passed to ROS, as in --ros-args -r hand_pose:=/PSM1/measured_cp',
    'play': 'steer the hand yourself, on a page in the browser',
    'solve': 'solve one scene from a YAML or JSON file',
    'replay': 'compute predictions from a recording, without ROS and faster than real time',
    'learn': 'write the recordings of a scene as experience for predictions in this scene',
    'fit': 'find the parameters that explain recordings best',
    'evaluate': 'compare predictions with recordings of people, beside simple baselines',
    'simulate': 'compare simulated operators with and without guidance',
    'convert': 'convert motion capture in CSV tables to bags',
    'warm-up': 'nothing any more: the command will be removed',
}
"""Purpose of each command. With an underscore for a hyphen, `arguments` declares its arguments in `add_NAME_arguments(parser)`,
and the module of its name defines `run(arguments) -> exit code`."""

MOVED = {'paper': 'the studies of the paper are an example now: python examples/paper/paper.py'}
"""Commands of earlier releases, and what took their place."""


class _StoreOnce(argparse.Action):
    """Stores the value of an option; argparse itself uses the last one of an option that is given twice."""

    def __call__(
        self, _parser: argparse.ArgumentParser, namespace: argparse.Namespace, values: object, _option: str | None = None
    ) -> None:
        given = vars(namespace).setdefault('given', set())
        if self.dest in given:
            raise argparse.ArgumentError(self, 'given twice')
        given.add(self.dest)
        setattr(namespace, self.dest, values)


class _Parser(argparse.ArgumentParser):
    """A parser that reports an error in one line and refuses an option that is given twice."""

    def __init__(self, **options: Any) -> None:
        super().__init__(**options)
        self.register('action', None, _StoreOnce)

    def error(self, message: str) -> NoReturn:
        self.exit(2, f'{self.prog}: {" ".join(message.split())}\n')

    def reject(self, words: Sequence[str]) -> NoReturn:
        """End with an error that names words that are no arguments, each with the most similar option."""
        options = re.findall(r'--[a-z-]+', self.format_help())
        self.error(f'unrecognized arguments: {" ".join(f"{each}{suggest(each, options)}" for each in words)}')


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command and return the exit code; arguments: those of the process by default, without its name."""
    if sys.stdout is None:  # the process was started with its standard output closed
        sys.stdout = Path(os.devnull).open('w', encoding='utf-8')  # noqa: SIM115  it stays open until the process ends
    if arguments is None and sys.getfilesystemencoding() != 'utf-8':  # it could not even name the files that it is given
        os.execv(sys.executable, [sys.executable, '-X', 'utf8', *sys.orig_argv[1:]])  # noqa: S606
    if arguments is None:  # matrices are small: threads of a linear algebra library would only wait for each other
        os.environ.setdefault('OPENBLAS_NUM_THREADS', '1')
    if arguments is None:  # pictures are files; the backend of a notebook or of a desktop may not exist here
        os.environ['MPLBACKEND'] = 'agg'
    given = list(sys.argv[1:] if arguments is None else arguments)
    try:
        with handle_interrupts(), print_warnings(' '.join(['foc_ros', *given[:1]])):
            code = _parse_and_run(given)
            sys.stdout.flush()
    except KeyboardInterrupt:
        return INTERRUPTED
    except OSError as error:
        _discard_lost_output()
        if isinstance(error, BrokenPipeError):
            return 141
        print(f'{" ".join(["foc_ros", *given[:1]])}: {_format_line(str(error))}', file=sys.stderr)
        return 2
    return code


def _discard_lost_output() -> None:
    """Discard what standard output does not take: the interpreter would write it again at exit and print an error."""
    try:
        sys.stdout.flush()
    except OSError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def _parse_and_run(given: list[str]) -> int:
    if isinstance(sys.stdout, TextIOWrapper):
        sys.stdout.reconfigure(errors='backslashreplace')  # a name of a file or topic may have characters that it cannot show
    parser = _Parser(prog='foc_ros', description='Predict where the hand of an operator is going among obstacles.')
    commands = parser.add_subparsers(dest='command', required=True)
    for name, purpose in COMMANDS.items():
        command = commands.add_parser(name, help=purpose, description=f'{purpose[0].upper()}{purpose[1:]}.')
        getattr(declarations, f'add_{_get_module_name(name)}_arguments')(command)
    try:
        words = f'{", ".join(COMMANDS)} are the commands (foc_ros --help explains them)'
        if not given:
            parser.error(f'no command is given; {words}')
        if given[0] in MOVED:
            raise FocError(MOVED[given[0]])
        if not given[0].startswith('-') and given[0] not in COMMANDS:
            parser.error(f'there is no command {given[0]}{suggest(given[0], COMMANDS)}; {words}')
        parsed, rest = parser.parse_known_args(given)
        if rest and parsed.command != 'node':
            commands.choices[parsed.command].reject(rest)
        parsed.rest = rest
        read_inputs(parsed)
        module = import_module(f'.{_get_module_name(parsed.command)}', __package__)
        return int(module.run(parsed))
    except SystemExit as leaving:  # after --help, or wrong arguments
        return int(leaving.code or 0)
    except FocError as error:
        for message in list_messages(error):
            print(f'foc_ros {given[0]}: {_format_line(message)}', file=sys.stderr)
        return 2


def _get_module_name(command: str) -> str:
    return command.replace('-', '_')


def _format_line(message: str) -> str:
    """Return a message in one line; a character from a file that would control the terminal is escaped."""
    line = ' '.join(message.split())
    return ''.join(each if each.isprintable() else ascii(each)[1:-1] for each in line)
