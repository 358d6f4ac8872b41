# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The exceptions of the package: for wrong input they name the field, the value and what was expected.

An expected failure (infeasible, unreachable, out of time) is a :class:`foc_ros.core.solution.Status`, not an exception.
"""

from __future__ import annotations

import sys
import warnings
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import fields
from difflib import get_close_matches
from functools import wraps
from typing import Any, TypeVar

_LONGEST = 200
"""Characters of a value in a message."""


def _shorten(value: object) -> str:
    """Return the part of a value that a message shows."""
    if isinstance(value, int) and value.bit_length() > 10_000:  # Python does not convert it to a text
        return f'a whole number of {value.bit_length()} bits'
    shown = str(value)
    return shown if len(shown) <= _LONGEST else f'{shown[:_LONGEST]}...'


class FocError(Exception):
    """Base of all exceptions that this package raises on purpose."""


class InputError(FocError):
    """A value that cannot be used.

    Attributes: field, its name; expected, in words; got, the value or its description, of which the message shows a limited part.
    """

    def __init__(self, field: str, expected: str, got: object) -> None:
        super().__init__(f'{field}: expected {expected}, got {_shorten(got)}')
        self.field = field
        self.expected = expected
        self.got = got

    def __reduce__(self) -> tuple[Any, ...]:
        """Allow pickling: the constructor takes other arguments than the text of the message."""
        return type(self), (self.field, self.expected, self.got), vars(self)


class ParameterError(InputError):
    """A parameter that is unknown, of the wrong type or out of its bounds."""


class SceneError(InputError):
    """Obstacles, goals or a start that define no reaching problem."""


class MessageError(InputError):
    """A message that cannot be converted."""


class LostHandError(MessageError):
    """A hand pose by which a tracker says that it has no data."""


class RecordingError(FocError):
    """A file that cannot be read or written; the message names the file and the reason."""


class FocWarning(UserWarning):
    """Input that is used, although a part of it is missing or it is probably not meant so; the message says what and why."""


def warn(text: str) -> None:
    """Issue a FocWarning."""
    warnings.warn(text, FocWarning, stacklevel=2)


def print_messages(program: str, messages: Iterable[str]) -> int:
    """Print each message as one line on standard error, after the name of the program; return the exit code, 2 if there is any.

    A character from a file that would control the terminal is escaped.
    """
    lines = [' '.join(message.split()) for message in messages]
    with suppress(OSError):  # the disk of standard error may be full
        for line in lines:
            print(f'{program}: {"".join(c if c.isprintable() else ascii(c)[1:-1] for c in line)}', file=sys.stderr)
    return 2 if lines else 0


@contextmanager
def print_warnings(program: str) -> Iterator[None]:
    """Print each warning as `print_messages` does, without its place in the code, and equal ones once."""
    told = set[str]()

    def show(message: Warning | str, *_: object, **__: object) -> None:
        print_messages(program, {str(message)} - told)
        told.add(str(message))

    with warnings.catch_warnings():
        warnings.simplefilter('always', FocWarning)
        warnings.showwarning = show
        yield


E = TypeVar('E', bound=FocError)
T = TypeVar('T')
C = TypeVar('C', bound=type)


def collect(errors: list[FocError], read: Callable[..., T], *arguments: Any) -> T | None:
    """Return what a function reads; where it raises FocError, append this to a list and return None."""
    try:
        return read(*arguments)
    except FocError as error:
        errors.append(error)
        return None


def collect_all(read: Callable[..., T], rows: Iterable[Sequence[Any]]) -> list[T]:
    """Return what a function reads from each row of arguments; raise one error for all rows for which it raises FocError."""
    errors: list[FocError] = []
    values = [collect(errors, read, *row) for row in rows]
    if errors:
        raise join_errors(errors)
    return values  # type: ignore[return-value]  # None stands for an error only


def join_errors(errors: Sequence[E]) -> E:
    """Return the first of several errors of one input, at least one, with the messages of the others as its notes."""
    for each in errors[1:]:
        for message in list_messages(each):
            errors[0].add_note(message)
    return errors[0]


def list_messages(error: Exception) -> tuple[str, ...]:
    """Return the message of an error and its notes."""
    return str(error), *getattr(error, '__notes__', ())


def suggest(name: object, known: Iterable[str], similarity: float = 0.6) -> str:
    """Return a hint at the known name that is most similar to an unknown one, for a message; empty if none is similar.

    similarity: the least one, from 0 to 1, as :mod:`difflib` measures it.
    """
    similar = get_close_matches(str(name)[:_LONGEST], known, 1, similarity)
    return f' (did you mean {similar[0]}?)' if similar else ''


def guard_keywords(kind: C, refuse: Callable[[str, object], object]) -> C:
    """Let the constructor of a dataclass pass a keyword that is none of its fields to a function, which raises an error."""
    changed: Any = kind
    create, known = changed.__init__, {each.name for each in fields(changed)}

    @wraps(create)
    def create_guarded(self: object, *args: Any, **values: Any) -> None:
        for name in values:
            if name not in known:
                refuse(name, values[name])
        create(self, *args, **values)

    changed.__init__ = create_guarded
    return kind


def explain_keywords(field: str) -> Callable[[C], C]:
    """Return a decorator of a dataclass: for a keyword that is none of its fields SceneError names one like it, or all."""

    def explain(kind: C) -> C:
        known = [each.name for each in fields(kind)]

        def refuse(name: str, value: object) -> None:
            begun = next((each for each in known if each.startswith(name)), name)  # r is short for radius
            hint = suggest(begun, known) or f': {", ".join(known)}'
            raise SceneError(f'{field}.{name}', f'an argument of {kind.__name__}{hint}', repr(value))

        return guard_keywords(kind, refuse)

    return explain
