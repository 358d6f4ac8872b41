"""The one exception tree: wrong input names the field, the value and the bound.

An expected failure (infeasible, unreachable, out of time) is a :class:`foc_ros.core.types.Status`, not an exception.
"""

from __future__ import annotations


class FocError(Exception):
    """Base of everything this package raises on purpose."""


class InputError(FocError):
    """A value that cannot be used: says which field, what it was and what was expected."""

    def __init__(self, field: str, expected: str, got: object) -> None:
        super().__init__(f'{field}: expected {expected}, got {got}')
        self.field = field
        self.expected = expected
        self.got = got


class ParameterError(InputError):
    """A parameter outside its bounds, of the wrong type, or unknown."""


class SceneError(InputError):
    """A scene (obstacles, goals, start) that describes no reaching problem."""


class MessageError(InputError):
    """A message that cannot be converted."""


class RecordingError(FocError):
    """A bag or CSV that cannot be read or written: says which file and why."""
