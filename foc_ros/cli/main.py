# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The program `foc_ros`.

Exit codes: 0 done; 2 the input is wrong, or standard output cannot be written, and a line on standard error for each error names
field, value and bound; 3 no candidate could be solved; 141 if the reader of standard output has closed it, as in a shell.
"""

from __future__ import annotations

import os
import shutil
import sys
from collections.abc import Sequence
from io import TextIOWrapper
from pathlib import Path

from cyclopts import CycloptsError

from foc_ros.core.errors import FocError, list_messages, print_messages, print_warnings

from . import commands, studies  # noqa: F401  they declare the commands of the program
from .options import app

MOVED = {'paper': 'the studies of the paper are an example now: python examples/paper/paper.py'}
"""Commands of earlier releases, and what took their place."""
NARROWEST = 20
"""Width of a terminal [characters] for which help is formatted at least: less than 3 would take endless time and memory."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command, without one the help, and return the exit code; arguments: those of the process by default."""
    for number, (name, mode) in enumerate((('stdin', 'r'), ('stdout', 'w'), ('stderr', 'w'))):
        try:
            os.fstat(number)
        except OSError:  # it was closed when the process started; the next file would get its number
            setattr(sys, name, Path(os.devnull).open(mode, encoding='utf-8'))  # noqa: SIM115  it stays open
            os.set_inheritable(number, True)
    if arguments is None:
        if sys.getfilesystemencoding() != 'utf-8':  # it could not even name the files that it is given
            os.execv(sys.executable, [sys.executable, '-X', 'utf8', *sys.orig_argv[1:]])  # noqa: S606
        columns = shutil.get_terminal_size().columns
        if 'COLUMNS' in os.environ or columns < NARROWEST:
            os.environ['COLUMNS'] = str(max(columns, NARROWEST))
        # matrices are small: threads of a linear algebra library would only wait for each other
        os.environ.setdefault('OPENBLAS_NUM_THREADS', '1')
        # said by joblib's process that cleans up after a command that was terminated
        os.environ.setdefault('PYTHONWARNINGS', 'ignore:resource_tracker:UserWarning')
        os.environ['MPLBACKEND'] = 'agg'  # pictures are files; the backend of a notebook or of a desktop may not exist here
    if isinstance(sys.stdout, TextIOWrapper):
        sys.stdout.reconfigure(errors='backslashreplace')  # a name of a file or topic may have characters that it cannot show
    given = list(sys.argv[1:] if arguments is None else arguments) or ['--help']
    program = ' '.join(['foc_ros', *given[:1]])
    try:
        with print_warnings(program):
            code = _run(given, program)
            sys.stdout.flush()
    except OSError as error:
        try:
            sys.stdout.flush()
        except OSError:  # the interpreter would write what is left again at exit and print an error
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 141 if isinstance(error, BrokenPipeError) else print_messages(program, [str(error)])
    return code


def _run(given: list[str], program: str) -> int:
    try:
        if given[0] in MOVED:
            raise FocError(MOVED[given[0]])
        if given[0] == 'node' and not {'-h', '--help'} & set(given):
            return commands.node(*given[1:])  # as they are: ROS parses them
        command, bound, _ = app.parse_args(given, exit_on_error=False, print_error=False)
        return int(command(*bound.args, **bound.kwargs) or 0)
    except CycloptsError as error:
        error.verbose = False
        return print_messages(program, [str(error)])
    except FocError as error:
        return print_messages(program, list_messages(error))


def list_commands() -> list[str]:
    """Return the names of all commands."""
    return [name for name in app if not name.startswith('-')]
