# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Creation of messages of two libraries with one call: rclpy's (the node) and rosbags' (bags without ROS).

Neither library checks the values of fields by default, and both serialise the memory as it is: an integer in a float field
arrives as 5e-324. Every value is therefore converted here to the type of its field's default.
"""

from __future__ import annotations

import array
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable
from copy import copy
from functools import cache
from importlib import import_module
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from rosbags.typesys.store import Typestore


class MessageTypes(ABC):
    """The message classes of one library."""

    def __init__(self) -> None:
        self._find_layout = cache(self._describe)

    def make(self, name: str, /, **values: Any) -> Any:
        """Create a message of type `name`, such as 'std_msgs/msg/Header'; fields that are not given have their defaults.

        Messages may share the values of their fields, so they must not be changed. rosbags knows no defaults but zero: give a
        Quaternion its w. Raises TypeError for a field that the type does not have.
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
        return self.make(name, **dict(zip(self._find_layout(name)[1], values, strict=True)))

    def fill_each(self, name: str, rows: NDArray[np.float64]) -> list[Any]:
        """Create a message from each row of numbers (m, n), the values of all its n fields of floats; faster than `fill`."""
        blank, converters = self._find_layout(name)
        message_class, fields = type(blank), tuple(converters)
        return [message_class(**dict(zip(fields, row, strict=True))) for row in rows.tolist()]

    def _describe(self, name: str) -> tuple[Any, dict[str, Callable[[Any], Any]]]:
        """Return a message whose fields have their defaults, and the converter of each field."""
        blank, fields = self._make_blank(name)
        return blank, {field: _find_converter(getattr(blank, field)) for field in fields}

    @abstractmethod
    def _make_blank(self, name: str) -> tuple[Any, Iterable[str]]:
        """Return a message whose fields have their defaults, and the names of its fields."""


class RclpyTypes(MessageTypes):
    """The message classes of rclpy, each imported when it is first used."""

    def _make_blank(self, name: str) -> tuple[Any, Iterable[str]]:
        blank = find_message_class(name)()
        return blank, blank.get_fields_and_field_types()


class RosbagsTypes(MessageTypes):
    """The message classes of a rosbags typestore."""

    def __init__(self, typestore: Typestore) -> None:
        super().__init__()
        self.typestore = typestore

    def _make_blank(self, name: str) -> tuple[Any, Iterable[str]]:
        defaults = {field: self._find_default(kind) for field, kind in self.typestore.fielddefs[name][1]}
        return self.typestore.types[name](**defaults), defaults

    def _find_default(self, kind: tuple[Any, Any]) -> Any:
        """Return the default of a field definition of the typestore."""
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


def _find_converter(default: Any) -> Callable[[Any], Any]:
    """Return the function that converts a value to the type of a default; messages are kept as they are."""
    if isinstance(default, array.array):
        typecode = default.typecode
        return lambda value: array.array(typecode, value if isinstance(value, bytes) else np.asarray(value, typecode).tobytes())
    if isinstance(default, np.ndarray):
        dtype = default.dtype
        return lambda value: np.frombuffer(value, dtype) if isinstance(value, bytes) else np.array(value, dtype)
    if isinstance(default, bytes):
        return lambda value: bytes([value])  # a byte field of rclpy; rosbags takes the integer
    return type(default) if isinstance(default, (float, int, str, list)) else lambda value: value


def make_header(types: MessageTypes, stamp_ns: int, frame_id: str) -> Any:
    """Return a std_msgs/Header; beyond 32 bits, the seconds of the stamp are the first or last possible."""
    seconds, nanoseconds = divmod(stamp_ns, 1_000_000_000)
    stamp = types.fill('builtin_interfaces/msg/Time', (min(max(seconds, -(2**31)), 2**31 - 1), nanoseconds))
    return types.fill('std_msgs/msg/Header', (stamp, frame_id))


def make_marker(types: MessageTypes, colour: Iterable[float], scale: Iterable[float], **fields: Any) -> Any:
    """Return a visualization_msgs/Marker; fields: its other ones."""
    color, size = types.fill('std_msgs/msg/ColorRGBA', colour), types.fill('geometry_msgs/msg/Vector3', scale)
    return types.make('visualization_msgs/msg/Marker', color=color, scale=size, **fields)
