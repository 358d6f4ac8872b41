"""Creation of messages of two libraries with one call: rclpy's (the node) and rosbags' (bags without ROS).

Neither library checks a field's value unless it is told to, and both serialise the memory as it is: an integer in a float field
arrives as 5e-324. Every value is therefore converted here to the declared type of its field.
"""

from __future__ import annotations

import array
import re
from abc import ABC, abstractmethod
from collections.abc import Callable
from importlib import import_module
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from rosbags.typesys.store import Typestore

Converter = Callable[[Any], Any]

TYPECODES = {np.dtype(code).name: code for code in 'dfbBhHiIqQ'}
"""Typecode of `array.array` and of numpy for each numeric type of a .msg file; byte (octet), bool and string have none."""

CHECKS = '_check_fields'
"""Slot of rclpy's messages that says whether their properties check the values they are given."""

_IDL_NAMES = {'double': 'float64', 'float': 'float32', 'boolean': 'bool', 'octet': 'byte'}
_RCLPY_FIELD = re.compile(r'(?P<sequence>sequence<)?(?P<element>[\w/]+)[^\[]*(?P<array>\[)?')


class _Layout(NamedTuple):
    """A message class, whether it checks fields (None for rosbags), and each field's attribute, converter and default."""

    message_class: type
    is_checked: bool | None
    fields: dict[str, tuple[str, Converter, Any]]


class MessageTypes(ABC):
    """The message classes of one library."""

    def __init__(self) -> None:
        self._layouts: dict[str, _Layout] = {}

    def make(self, name: str, /, **values: Any) -> Any:
        """Create a message of type `name`, such as 'std_msgs/msg/Header'; fields that are not given have their defaults.

        Messages share the values of their fields, defaults above all, so they must not be changed. rosbags knows no defaults but
        zero: give a Quaternion its w. Raises TypeError for a field that the type does not have.
        """
        try:
            message_class, is_checked, fields = self._layouts[name]
        except KeyError:
            message_class, is_checked, fields = self._layouts[name] = self._find_layout(name)
        message: Any = object.__new__(message_class)  # the constructor is slower: it creates the default of every field
        given = 0
        if is_checked is not None:
            setattr(message, CHECKS, is_checked)
        for field, (attribute, convert, default) in fields.items():
            if field in values:
                setattr(message, attribute, convert(values[field]))
                given += 1
            else:
                setattr(message, attribute, default)
        if given < len(values):
            raise TypeError(f'{name} has no field {", ".join(sorted(set(values) - set(fields)))}')
        return message

    @abstractmethod
    def _find_layout(self, name: str) -> _Layout:
        """Return the layout of a message type."""


class RclpyTypes(MessageTypes):
    """The message classes of rclpy, each imported when it is first used."""

    def _find_layout(self, name: str) -> _Layout:
        # values are stored where the fields' properties store them; the properties are used only if they check
        kind = find_message_class(name)
        blank = kind()
        is_checked = getattr(blank, CHECKS)
        fields = {}
        for field, declared in kind.get_fields_and_field_types().items():
            match = _RCLPY_FIELD.match(declared)
            assert match is not None
            element = _IDL_NAMES.get(match['element'], match['element'])
            scalar = _to_octet if element == 'byte' else _find_scalar_converter(element)
            to_numbers = _to_array if match['sequence'] else _to_numpy
            convert = _find_converter(element, scalar, to_numbers) if match['sequence'] or match['array'] else scalar
            fields[field] = (field if is_checked else f'_{field}', convert, getattr(blank, field))
        return _Layout(kind, is_checked, fields)


class RosbagsTypes(MessageTypes):
    """The message classes of a rosbags typestore."""

    def __init__(self, typestore: Typestore) -> None:
        super().__init__()
        self.typestore = typestore

    def _find_layout(self, name: str) -> _Layout:
        definitions = self.typestore.fielddefs[name][1]
        return _Layout(self.typestore.types[name], None, {field: (field, *self._describe(kind)) for field, kind in definitions})

    def _describe(self, kind: tuple[Any, Any]) -> tuple[Converter, Any]:
        """Return the converter and the default of a field definition of the typestore."""
        node, detail = kind
        if node.name == 'BASE':
            scalar = _find_scalar_converter(detail[0])
            return scalar, scalar('' if scalar is str else 0)
        if node.name == 'NAME':
            return _keep, self.make(detail)
        element, length = detail
        name = element[1][0] if element[0].name == 'BASE' else element[1]
        count = length if node.name == 'ARRAY' else 0
        if name in TYPECODES:
            return _find_converter(name, _keep, _to_numpy), np.zeros(count, TYPECODES[name])
        convert, default = self._describe(element)
        return _find_converter(name, convert, _to_numpy), [default] * count


def find_message_class(name: str) -> Any:
    """Return rclpy's class of a message type such as 'std_msgs/msg/Header'."""
    package, _, leaf = name.split('/')
    return getattr(import_module(f'{package}.msg'), leaf)


def _find_scalar_converter(element: str) -> Converter:
    if '/' in element:
        return _keep
    if element.startswith(('string', 'wstring')):
        return str
    return float if element.startswith('float') else bool if element == 'bool' else int


def _find_converter(element: str, scalar: Converter, to_numbers: Callable[[Any, str], Any]) -> Converter:
    """Return the converter of an array or a sequence of elements."""
    if element in TYPECODES:
        return lambda value: to_numbers(value, TYPECODES[element])
    return lambda value: [scalar(item) for item in value]


def _to_octet(value: Any) -> bytes:
    """Convert an integer to rclpy's form of a byte field; rosbags takes the integer."""
    return bytes([value])


def _to_array(value: Any, typecode: str) -> array.array[Any]:
    if isinstance(value, (bytes, bytearray)):
        return array.array(typecode, bytes(value))
    return array.array(typecode, np.ascontiguousarray(value, dtype=typecode).tobytes())


def _to_numpy(value: Any, typecode: str) -> np.ndarray[Any, Any]:
    if isinstance(value, (bytes, bytearray)):
        return np.frombuffer(bytes(value), dtype=typecode)
    return np.array(value, dtype=typecode)


def _keep(value: Any) -> Any:
    return value


def stamp(types: MessageTypes, stamp_ns: int) -> Any:
    """Return a builtin_interfaces/Time of nanoseconds; beyond its 32 bits, the seconds are the first or last possible."""
    seconds, nanoseconds = divmod(stamp_ns, 1_000_000_000)
    return types.make('builtin_interfaces/msg/Time', sec=min(max(seconds, -(2**31)), 2**31 - 1), nanosec=nanoseconds)


def header(types: MessageTypes, stamp_ns: int, frame_id: str) -> Any:
    """Return a std_msgs/Header."""
    return types.make('std_msgs/msg/Header', stamp=stamp(types, stamp_ns), frame_id=frame_id)
