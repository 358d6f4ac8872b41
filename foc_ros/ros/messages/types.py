"""One way to make a message, for two kinds of message classes: rclpy's (node) and rosbags' (bags without ROS).

Neither kind checks what it is given unless asked to, and both then pass memory on as it lies: an int in a float field arrives as
5e-324. So every value goes through the converter of its field's declared type here, and nowhere else.
"""

from __future__ import annotations

import array
from collections.abc import Callable, Hashable, Iterable
from functools import cache
from importlib import import_module
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

if TYPE_CHECKING:
    from rosbags.typesys.store import Typestore

Converter = Callable[[Any], Any]

TYPECODES = {
    'float64': 'd',
    'float32': 'f',
    'int8': 'b',
    'uint8': 'B',
    'int16': 'h',
    'uint16': 'H',
    'int32': 'i',
    'uint32': 'I',
    'int64': 'q',
    'uint64': 'Q',
}
"""Typecode of `array.array` and of numpy alike, per type name of a .msg file. byte (octet), bool and string have none."""

CHECKS = '_check_fields'
"""Slot of rclpy's messages that says whether their properties check what they are given."""

_IDL_NAMES = {'double': 'float64', 'float': 'float32', 'boolean': 'bool', 'octet': 'byte'}


class MessageTypes(Hashable, Protocol):
    """Makes messages by type name."""

    def make(self, name: str, /, **values: Any) -> Any:
        """Return a message of type `name` ('std_msgs/msg/Header'); fields not given have their defaults.

        Messages may share what is in them, defaults above all, so none is to be changed. Raises TypeError for a field the type
        does not have.
        """


class RclpyTypes:
    """The message classes of rclpy, imported when first used."""

    def make(self, name: str, /, **values: Any) -> Any:
        """Return a message of type `name`; see :class:`MessageTypes`."""
        kind, checks, fields = _rclpy_type(name)
        message, given = object.__new__(kind), 0  # its constructor would make the defaults of all fields, those given too
        setattr(message, CHECKS, checks)
        for field, (attribute, convert, default) in fields.items():
            if field in values:
                setattr(message, attribute, convert(values[field]))
                given += 1
            else:
                setattr(message, attribute, default)
        if given < len(values):
            _refuse_unknown(name, values, fields)
        return message


class RosbagsTypes:
    """The message classes of a rosbags typestore, which knows no defaults but zero: give a Quaternion its w."""

    def __init__(self, typestore: Typestore) -> None:
        self.typestore = typestore
        self._known: dict[str, dict[str, tuple[Converter, Converter]]] = {}

    def make(self, name: str, /, **values: Any) -> Any:
        """Return a message of type `name`; see :class:`MessageTypes`."""
        if name not in self._known:
            self._known[name] = {field: self._of_field(kind) for field, kind in self.typestore.fielddefs[name][1]}
        known = self._known[name]
        _refuse_unknown(name, values, known)
        made = {
            field: convert(values[field]) if field in values else default(None) for field, (convert, default) in known.items()
        }
        return self.typestore.types[name](**made)

    def _of_field(self, kind: tuple[Any, Any]) -> tuple[Converter, Converter]:
        """Return the converter of a value and the maker of the default for one field definition of the typestore."""
        node, detail = kind
        if node.name == 'BASE':
            scalar = _scalar(detail[0])
            empty = '' if detail[0] == 'string' else 0
            return scalar, lambda _: scalar(empty)
        if node.name == 'NAME':
            return _same, lambda _: self.make(detail)
        (element, element_detail), length = detail
        count = length if node.name == 'ARRAY' else 0
        if element.name == 'BASE' and element_detail[0] in TYPECODES:
            dtype = np.dtype(TYPECODES[element_detail[0]])
            return lambda value: _numpy(value, dtype), lambda _: np.zeros(count, dtype)
        convert, default = self._of_field((element, element_detail))
        return lambda value: [convert(item) for item in value], lambda _: [default(None) for _ in range(count)]


@cache
def _rclpy_type(name: str) -> tuple[type[Any], bool, dict[str, tuple[str, Converter, Any]]]:
    """Return a message class, whether rclpy checks fields, and by field where its value goes, its converter, its default.

    A value goes where the field's property would put it; through the property only where that has something to check.
    """
    package, _, leaf = name.split('/')
    kind = getattr(import_module(f'{package}.msg'), leaf)
    blank = kind()
    checks, declared = getattr(blank, CHECKS), kind.get_fields_and_field_types()
    fields = {
        field: (field if checks else f'_{field}', _rclpy_converter(declared[field]), getattr(blank, field)) for field in declared
    }
    return kind, checks, fields


def _rclpy_converter(kind: str) -> Converter:
    """Return the converter for a field type such as 'double', 'sequence<uint8>', 'double[36]' or 'std_msgs/Header'."""
    element = kind.removeprefix('sequence<').removesuffix('>').split(',')[0].split('[')[0]
    element = _IDL_NAMES.get(element, element)
    if '/' in element:
        return list if kind.startswith('sequence<') else _same
    if kind.startswith('sequence<') and element in TYPECODES:
        return lambda value: _array(value, TYPECODES[element])
    if '[' in kind and element in TYPECODES:
        return lambda value: _numpy(value, np.dtype(TYPECODES[element]))
    scalar = _octet if element == 'byte' else _scalar(element)
    return scalar if element == kind or kind in _IDL_NAMES else lambda value: [scalar(item) for item in value]


def _scalar(kind: str) -> Converter:
    if kind.startswith(('string', 'wstring')):
        return str
    return float if kind.startswith('float') else bool if kind == 'bool' else int


def _octet(value: Any) -> bytes:
    """rclpy wants a byte field as bytes of length 1, rosbags as an int; callers give an int."""
    return bytes([value])


def _array(value: Any, typecode: str) -> array.array[Any]:
    if isinstance(value, (bytes, bytearray)):
        return array.array(typecode, bytes(value))
    return array.array(typecode, np.ascontiguousarray(value, dtype=typecode).tobytes())


def _numpy(value: Any, dtype: np.dtype[Any]) -> np.ndarray[Any, Any]:
    if isinstance(value, (bytes, bytearray)):
        return np.frombuffer(bytes(value), dtype=dtype)
    return np.array(value, dtype=dtype)


def _same(value: Any) -> Any:
    return value


def _refuse_unknown(name: str, values: Iterable[str], known: Iterable[str]) -> None:
    unknown = set(values) - set(known)
    if unknown:
        raise TypeError(f'{name} has no field {", ".join(sorted(unknown))}')


def stamp(types: MessageTypes, stamp_ns: int) -> Any:
    """Return a builtin_interfaces/Time of nanoseconds, held at the ends of what its 32 bits can say."""
    seconds, nanoseconds = divmod(stamp_ns, 1_000_000_000)
    return types.make('builtin_interfaces/msg/Time', sec=min(max(seconds, -(2**31)), 2**31 - 1), nanosec=nanoseconds)


def header(types: MessageTypes, stamp_ns: int, frame_id: str) -> Any:
    """Return a std_msgs/Header."""
    return types.make('std_msgs/msg/Header', stamp=stamp(types, stamp_ns), frame_id=frame_id)
