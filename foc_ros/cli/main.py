"""One program, several commands: each in a module of its own, imported only when it is asked for.

Exit codes: 0 done; 2 the input is wrong, and one line on standard error says what and where; 3 nothing could be solved; as in a
shell 130 for an interrupt and 141 for a reader of our output that went away.
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
    'demo': 'play the packaged recording into the node and show what it predicts',
    'node': 'run the node; what follows goes to ROS: --ros-args -r hand_pose:=/PSM1/measured_cp',
    'paper': "redo the paper's studies: figures, numbers, a table",
    'solve': 'solve one scene from a YAML or JSON file',
    'replay': 'predict from a recording, without ROS and without waiting',
    'fit': 'find the parameters that explain recordings best',
    'evaluate': 'judge predictions by recordings of people, beside simple baselines',
    'convert': 'turn motion capture in CSV tables into bags',
}
"""Purpose of each command. Its module has the same name and defines `add_arguments(parser)` and `run(arguments) -> exit code`."""


class _Parser(argparse.ArgumentParser):
    """Says what is wrong in one line."""

    def error(self, message: str) -> NoReturn:
        self.exit(2, f'{self.prog}: {" ".join(message.split())}\n')


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command and return the exit code; arguments: without the program's name, those of the process by default."""
    given = list(sys.argv[1:] if arguments is None else arguments)
    parser = _Parser(prog='foc_ros', description='Predict where an operator is reaching among obstacles.')
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
        # Or the interpreter meets the same pipe again when it flushes at exit, and complains.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 141
    return code
