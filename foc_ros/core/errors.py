"""The exceptions of the package: for wrong input they name the field, the value and what was expected.

An expected failure (infeasible, unreachable, out of time) is a :class:`foc_ros.core.types.Status`, not an exception.
"""

from __future__ import annotations


class FocError(Exception):
    """Base of all exceptions that this package raises on purpose."""


class InputError(FocError):
    """A value that cannot be used.

    Attributes: field, its name; expected, in words; got, the value or its description.
    """

    def __init__(self, field: str, expected: str, got: object) -> None:
        super().__init__(f'{field}: expected {expected}, got {got}')
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
