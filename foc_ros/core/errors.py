"""The exceptions of the package: for wrong input they name the field, the value and what was expected.

An expected failure (infeasible, unreachable, out of time) is a :class:`foc_ros.core.types.Status`, not an exception.
"""

from __future__ import annotations

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


class ParameterError(InputError):
    """A parameter that is unknown, of the wrong type or out of its bounds."""


class SceneError(InputError):
    """Obstacles, goals or a start that define no reaching problem."""


class MessageError(InputError):
    """A message that cannot be converted."""


class RecordingError(FocError):
    """A file that cannot be read or written; the message names the file and the reason."""
