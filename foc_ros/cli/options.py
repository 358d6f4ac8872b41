# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The program, and the types of its commands' arguments; nothing that computes is imported, so that a wrong one ends at once."""

from __future__ import annotations

import json
import os
import re
import sys
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import App, Group, Parameter, Token
from cyclopts.types import ExistingPath

import foc_ros
from foc_ros.analysis.simulation import ASSISTANCE, OPERATORS
from foc_ros.core.config import ONLINE, Config
from foc_ros.core.errors import InputError, collect_all, suggest
from foc_ros.io.outputs import check_file, check_new_or_earlier, check_page
from foc_ros.io.topics import TYPES
from foc_ros.ros.parameters import load_parameter_file

if TYPE_CHECKING:
    from contextlib import AbstractContextManager

app = App(
    name='foc_ros',
    help='Predict where the hand of an operator is going among obstacles.',
    version=foc_ros.__version__,
    default_parameter=Parameter(negative=(), allow_repeating=False, show_default=lambda value: value or None),
    help_format='plaintext',
)
app.register_install_completion_command('--install-completion')
TRY = Group.create_ordered('To try it')
PREDICT = Group.create_ordered('To predict')
RECORDINGS = Group.create_ordered('For recordings of people')
OTHER = Group.create_ordered('Other')

Table = tuple[str | None, Sequence[str], Iterable[Sequence[str]]]


def _read(read: Callable[[str], Any], **options: Any) -> Parameter:
    """Return the parameter whose text is read by a function."""
    return Parameter(converter=lambda _, tokens: read(tokens[0].value), n_tokens=1, accepts_keys=False, **options)


def names(known: tuple[str, ...]) -> Parameter:
    """Return the parameter of names with commas between them, each of which is taken once."""

    def read(_: object, tokens: Sequence[Token]) -> tuple[str, ...]:
        def check(name: str) -> str:
            if name not in known:
                expected = f'names of {", ".join(known)}{suggest(name, known)}'
                raise InputError(str(tokens[0].keyword), expected, name)
            return name

        return tuple(collect_all(check, [(name,) for name in dict.fromkeys(tokens[0].value.split(','))]))

    return Parameter(converter=read, n_tokens=1, metavar='A,B')


def whole(low: int, high: int) -> Parameter:
    """Return the parameter of a whole number in a range; cyclopts alone would round any other number."""

    def read(_: object, tokens: Sequence[Token]) -> int:
        text = tokens[0].value
        if not re.fullmatch(r'[+-]?\d{1,18}', text, re.ASCII) or not low <= int(text) <= high:
            raise InputError(str(tokens[0].keyword), f'a whole number in [{low}, {high}]', text)
        return int(text)

    return Parameter(converter=read, n_tokens=1)


def _read_address(text: str) -> str:
    if not re.fullmatch(r'(\w+://)?[^\s/]+:\d{1,5}', text):
        raise InputError('--scheduler', 'the address of a Dask scheduler, as in tcp://host:8786', text)
    return text


def _read_remaps(_: object, tokens: Sequence[Token]) -> tuple[tuple[str, str], ...]:
    def read(text: str) -> tuple[str, str]:
        role, separator, topic = text.partition(':=')
        if not separator or not topic:
            raise InputError('--remap', 'INPUT:=TOPIC', text)
        if role not in TYPES:
            raise InputError('--remap', f'one of the inputs {", ".join(TYPES)}{suggest(role, TYPES)}', role)
        return role, topic

    remaps = tuple(read(each.value) for each in tokens)
    roles = [role for role, _ in remaps]
    if len(set(roles)) < len(roles):
        raise InputError('--remap', 'INPUT:=TOPIC, once for an input', ', '.join(roles))
    return remaps


DEFAULTS = Config()
Existing = ExistingPath
_PARAMS_HELP = "The node's parameter file (default: every parameter has its default)."
Params = Annotated[Config, _read(load_parameter_file, name='--params', metavar='YAML', show_default=False, help=_PARAMS_HELP)]
Data = Annotated[
    ExistingPath,
    Parameter(help='Folder of bags, or of recordings.csv with scenes.csv, or with goals.csv and, for obstacles, obstacles.csv.'),
]
Json = Annotated[bool, Parameter(help='Print one JSON object.')]
Remaps = Annotated[
    tuple[tuple[str, str], ...],
    Parameter(converter=_read_remaps, n_tokens=1, allow_repeating=True, metavar='INPUT:=TOPIC', show_default=False),
]
Samples = Annotated[int, whole(1, 10_000_000)]
Port = Annotated[int, whole(0, 65535)]
Trials = Annotated[int, whole(1, 100_000)]
Seed = Annotated[int, whole(0, 100_000)]
Operators = Annotated[tuple[str, ...], names(OPERATORS)]
Assistance = Annotated[tuple[str, ...], names(ASSISTANCE)]
Allowed = Annotated[tuple[str, ...], names(('eta', 'positions'))]


@Parameter(name='*')
@dataclass(frozen=True)
class Learning:
    """What is kept of the movements of a recording.

    Parameters
    ----------
    learn
        Learn the movements, with experience.learning, and add them to this class library, for homotopy.library.
    operator
        File for the parameters with the durations of this operator, for --params.
    """

    learn: Path | None = None
    operator: Path | None = None

    def check(self, config: Config) -> None:
        """Raise InputError for a file that cannot be written, for two class libraries, and for one file of two kinds."""
        if self.learn is not None:
            check_file('--learn', self.learn)
        if self.operator is not None:
            check_new_or_earlier('--operator', self.operator, load_parameter_file)
        library = config.homotopy.library
        if self.learn is not None and library and Path(library).resolve() != self.learn.resolve():
            raise InputError('--learn', 'no other class library in homotopy.library', library)
        if self.learn is not None and self.operator is not None and self.operator.resolve() == self.learn.resolve():
            raise InputError('--operator', 'another file than that of --learn', self.operator)

    def prepare(self, config: Config) -> Config:
        """Return the config with which movements are learnt, in addition to those of a class library that exists."""
        if self.learn is None:
            return config
        given = {'homotopy.library': str(self.learn)} if self.learn.exists() else {}
        return config.with_values({'experience.learning': ONLINE, **given})


NO_LEARNING = Learning()


@Parameter(name='*')
@dataclass(frozen=True)
class Study:
    """Options of the commands that work on many recordings or trials.

    Parameters
    ----------
    report
        Folder for a page with plots.
    workers
        Worker processes (default: one for each core that this process may use; 1: this process itself).
    scheduler
        Address of a Dask scheduler, whose workers are used instead (extra: cluster).
    """

    params: Params = DEFAULTS
    json: Json = False
    report: Path | None = None
    workers: Annotated[int, whole(1, 1024)] | None = None
    scheduler: Annotated[str, _read(_read_address)] | None = None

    def check(self, page: str) -> None:
        """Raise InputError for a report that cannot be written, and for two kinds of workers. page: file of the report."""
        if self.workers is not None and self.scheduler is not None:
            raise InputError('--scheduler', 'either --workers or --scheduler', 'both')
        if self.report is not None:
            check_page('--report', self.report, page)

    def open_workers(self) -> AbstractContextManager[None]:
        """Return the context in which work is done by the workers; raise InputError where there are none."""
        from foc_ros.analysis import parallel

        return parallel.open_workers(self.workers or len(os.sched_getaffinity(0)), self.scheduler)

    def load_report(self, kind: str) -> Callable[..., None]:
        """Return what writes the report, so that a missing library is reported before the work; without one it does nothing."""
        if self.report is None:
            return lambda *_: None
        from foc_ros.io.terminal import show_progress
        from foc_ros.reporting import study_pages

        write = partial(getattr(study_pages, f'write_{kind}'), self.report)
        return lambda *given: [*show_progress((write(*given) for _ in (1,)), 'page', 1)].clear()

    def show(self, answer: object, tables: Iterable[Table], sentences: Iterable[str], page: str, commands: str = '') -> None:
        """Print an answer as JSON, or as tables, sentences, commands as they are, and the address of the report."""
        from foc_ros.io import terminal

        if self.json:
            print(json.dumps(answer, allow_nan=False))
            return
        for title, columns, rows in tables:
            terminal.show_table(columns, rows, title)
        for sentence in sentences:
            terminal.show_text(sentence)
        if commands:
            print(commands)
        if self.report is not None:
            terminal.show_address(self.report / page)


PLAIN = Study()


def confirm(question: str) -> bool:
    """Return whether a terminal, if there is one, agrees."""
    if not (sys.stdin.isatty() and sys.stdout.isatty()):
        return False
    try:
        return input(f'{question} [y/N] ').strip().lower() in ('y', 'yes')
    except EOFError:  # Ctrl-D
        print()
        return False
