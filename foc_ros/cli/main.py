"""The program `foc_ros` and its commands. A command's module is imported only when the command is run.

Exit codes: 0 done; 2 the input is wrong, and one line on standard error names field, value and bound; 3 no candidate could be
solved; 130 after an interrupt and 141 if the reader of standard output has closed it, both as in a shell.
"""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Sequence
from importlib import import_module
from typing import NoReturn

from foc_ros.core.errors import FocError

COMMANDS = {
    'demo': 'play the packaged recording to the node and show its predictions',
    'node': 'run the node; further arguments are passed to ROS, as in --ros-args -r hand_pose:=/PSM1/measured_cp',
    'paper': "repeat the paper's studies: figures, numbers, a table",
    'solve': 'solve one scene from a YAML or JSON file',
    'replay': 'compute predictions from a recording, without ROS and faster than real time',
    'fit': 'find the parameters that explain recordings best',
    'evaluate': 'compare predictions with recordings of people, beside simple baselines',
    'convert': 'convert motion capture in CSV tables to bags',
}
"""Purpose of each command. The module of that name defines `add_arguments(parser)` and `run(arguments) -> exit code`."""


class _Parser(argparse.ArgumentParser):
    """A parser that reports an error in one line."""

    def error(self, message: str) -> NoReturn:
        self.exit(2, f'{self.prog}: {" ".join(message.split())}\n')


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command and return the exit code; arguments: those of the process by default, without its name."""
    given = list(sys.argv[1:] if arguments is None else arguments)
    parser = _Parser(prog='foc_ros', description='Predict where the hand of an operator is going among obstacles.')
    commands = parser.add_subparsers(dest='command', required=True)
    for name, purpose in COMMANDS.items():
        command = commands.add_parser(name, help=purpose, description=f'{purpose[0].upper()}{purpose[1:]}.')
        if given[:1] == [name]:
            import_module(f'.{name}', __package__).add_arguments(command)
    parsed, rest = parser.parse_known_args(given)
    if rest and parsed.command != 'node':
        commands.choices[parsed.command].error(f'unrecognized arguments: {" ".join(rest)}')
    parsed.rest = rest
    return _run(parsed)


def _run(parsed: argparse.Namespace) -> int:
    try:
        code = int(import_module(f'.{parsed.command}', __package__).run(parsed))
        sys.stdout.flush()
    except FocError as error:
        print(f'foc_ros {parsed.command}: {" ".join(str(error).split())}', file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        return 130
    except BrokenPipeError:
        # Otherwise the interpreter flushes into the closed pipe at exit and prints an error.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 141
    return code
