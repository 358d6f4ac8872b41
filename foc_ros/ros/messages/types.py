# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Creation of messages of two libraries with one call: rclpy's (the node) and rosbags' (bags without ROS).

Neither library checks the values of fields by default, and both serialise the memory as it is: an integer in a float field
arrives as 5e-324. Every value is therefore converted here to the type of its field's default.
"""

from __future__ import annotations

import array
import re
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable
from copy import copy
from functools import cache, partial
from importlib import import_module
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from rosbags.typesys.store import Typestore

Converter = Callable[[Any], Any]


class MessageTypes(ABC):
    """The message classes of one library."""

    def __init__(self) -> None:
        self._find_layout = cache(self._describe)

    def make(self, name: str, /, **values: Any) -> Any:
        """Create a message of type `name`, such as 'std_msgs/msg/Header'; fields that are not given have their defaults.

        A message in a field may be given as a message, as a dictionary of its fields, or as the values of all its fields in their
        order; a list of messages also as an array as in `fill_each`. Messages may share the values of their fields, so they must
        not be changed. rosbags knows no defaults but zero. Raises TypeError for a field that the type does not have.
        """
        blank, converters = self._find_layout(name)
        if unknown := values.keys() - converters.keys():
            raise TypeError(f'{name} has no field {", ".join(sorted(unknown))}')
        message = copy(blank)  # the constructors of rclpy make a default of every field, also of those that are given
        for field, value in values.items():
            setattr(message, field, converters[field](value))
        return message

    def fill(self, name: str, values: Iterable[Any]) -> Any:
        """Create a message from the values of all its fields in their order, such as a Point from x, y and z."""
        blank, converters = self._find_layout(name)
        message = copy(blank)
        for (field, convert), value in zip(converters.items(), values, strict=True):
            setattr(message, field, convert(value))
        return message

    def fill_each(self, name: str, rows: NDArray[np.float64]) -> list[Any]:
        """Create a message from each row of numbers (m, n), the values of all its n fields of floats; faster than `fill`."""
        blank, converters = self._find_layout(name)
        message_class, fields = type(blank), tuple(converters)
        return [message_class(**dict(zip(fields, row, strict=True))) for row in rows.tolist()]

    def _describe(self, name: str) -> tuple[Any, dict[str, Converter]]:
        blank, fields = self._make_blank(name)
        return blank, {field: self._find_converter(getattr(blank, field), inner) for field, inner in fields.items()}

    def _find_converter(self, default: Any, inner: str) -> Converter:
        """Return the function that converts a value to the type of a default; inner: type of the message or messages in it."""
        if inner and isinstance(default, list):
            return partial(self._convert_each, inner)
        if inner:
            return partial(self._convert, inner)
        if isinstance(default, array.array):
            code = default.typecode
            return lambda value: array.array(code, value if isinstance(value, bytes) else np.asarray(value, code).tobytes())
        if isinstance(default, np.ndarray):
            dtype = default.dtype
            return lambda value: np.frombuffer(value, dtype) if isinstance(value, bytes) else np.array(value, dtype)
        if isinstance(default, bytes):
            return lambda value: bytes([value])  # a byte field of rclpy; rosbags takes the integer
        return type(default) if isinstance(default, (float, int, str, list)) else lambda value: value

    def _convert(self, name: str, value: Any) -> Any:
        if isinstance(value, dict):
            return self.make(name, **value)
        return self.fill(name, value) if isinstance(value, (tuple, list, np.ndarray)) else value

    def _convert_each(self, name: str, values: Any) -> list[Any]:
        return self.fill_each(name, values) if isinstance(values, np.ndarray) else [self._convert(name, each) for each in values]

    @abstractmethod
    def _make_blank(self, name: str) -> tuple[Any, dict[str, str]]:
        """Return a message whose fields have their defaults, and by field the type of the messages in it, '' if it has none."""


class RclpyTypes(MessageTypes):
    """The message classes of rclpy, each imported when it is first used."""

    def _make_blank(self, name: str) -> tuple[Any, dict[str, str]]:
        blank = find_message_class(name)()
        kinds = {field: re.search(r'(\w+)/(\w+)', kind) for field, kind in blank.get_fields_and_field_types().items()}
        return blank, {field: '/msg/'.join(found.groups()) if found else '' for field, found in kinds.items()}


class RosbagsTypes(MessageTypes):
    """The message classes of a rosbags typestore."""

    def __init__(self, typestore: Typestore) -> None:
        super().__init__()
        self.typestore = typestore

    def _make_blank(self, name: str) -> tuple[Any, dict[str, str]]:
        inner: dict[str, str] = {}
        defaults: dict[str, Any] = {}
        for field, (node, detail) in self.typestore.fielddefs[name][1]:
            kind: Any = detail[0] if node.name in ('ARRAY', 'SEQUENCE') else (node, detail)
            inner[field] = kind[1] if kind[0].name == 'NAME' else ''
            defaults[field] = self._find_default((node, detail))
        return self.typestore.types[name](**defaults), inner

    def _find_default(self, kind: tuple[Any, Any]) -> Any:
        node, detail = kind
        if node.name == 'NAME':
            return self.make(detail)
        if node.name == 'BASE':
            return {'string': '', 'bool': False}.get(detail[0], 0.0 if detail[0].startswith('float') else 0)
        element, length = detail
        count = length if node.name == 'ARRAY' else 0
        is_number = element[0].name == 'BASE' and element[1][0] not in ('string', 'bool', 'byte')
        return np.zeros(count, element[1][0]) if is_number else [self._find_default(element)] * count


def find_message_class(name: str) -> Any:
    """Return rclpy's class of a message type such as 'std_msgs/msg/Header'."""
    package, _, leaf = name.split('/')
    return getattr(import_module(f'{package}.msg'), leaf)


def make_header(types: MessageTypes, stamp_ns: int, frame_id: str) -> Any:
    """Return a std_msgs/Header; beyond 32 bits, the seconds of the stamp are the first or last possible."""
    seconds, nanoseconds = divmod(stamp_ns, 1_000_000_000)
    return types.fill('std_msgs/msg/Header', ((min(max(seconds, -(2**31)), 2**31 - 1), nanoseconds), frame_id))
