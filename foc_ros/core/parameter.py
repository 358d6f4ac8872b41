# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""One parameter: how it is declared in a group of parameters, and how a value is checked."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from functools import cache
from typing import Any, TypeVar

from .errors import ParameterError, join_errors
from .registry import Registry


@dataclass(frozen=True)
class Bound:
    """What values a parameter may have: closed range or choices; its unit and meaning for descriptors and documents."""

    low: float | None = None
    high: float | None = None
    unit: str = ''
    meaning: str = ''
    choices: tuple[str, ...] | Registry = ()
    read_only: bool = False


def param(default: Any, meaning: str, unit: str = '', low: float | None = None, high: float | None = None, **rest: Any) -> Any:
    """Declare a parameter."""
    return field(default=default, metadata={'bound': Bound(low, high, unit, meaning, **rest)})


@dataclass(frozen=True)
class Group:
    """Base of the groups of parameters: each value is checked, and has the type of its default, once a group is created."""

    def __post_init__(self) -> None:
        """Raise ParameterError, which names all wrong values with their bounds."""
        name = type(self).__name__.removesuffix('Config').lower()
        vars(self).update(check_fields(self, f'{name}.'))


@dataclass(frozen=True)
class Parameter:
    """One flattened parameter: dotted name, default, bound."""

    name: str
    default: Any
    bound: Bound


G = TypeVar('G', bound=Group)


def clip_values(group: G, values: Mapping[str, float]) -> G:
    """Return a group of parameters with other numbers, each of which stays within its bounds."""
    bounds = {item.name: item.metadata['bound'] for item in fields(group)}
    return replace(group, **{name: min(max(value, bounds[name].low), bounds[name].high) for name, value in values.items()})


def check_fields(group: object, prefix: str = '') -> dict[str, float | int | str | bool]:
    """Return the values besides the defaults of a group, in the types of these; an error names all that are wrong."""
    errors: list[ParameterError] = []
    values = {}
    kind: Any = type(group)
    for name, default, bound in _list_fields(kind):
        value = getattr(group, name)
        if value is default:
            continue
        try:
            values[name] = check_value(Parameter(prefix + name, default, bound), value)
        except ParameterError as error:
            errors.append(error)
    if errors:
        raise join_errors(errors)
    return values


@cache
def _list_fields(group: type) -> tuple[tuple[str, Any, Bound], ...]:
    """Return name, default and bound of the parameters of a config class itself."""
    return tuple((item.name, item.default, item.metadata['bound']) for item in fields(group) if 'bound' in item.metadata)


def check_value(parameter: Parameter, value: object) -> float | int | str | bool:
    """Return a value in the type of its parameter; raise ParameterError for a wrong type or a value out of bounds."""
    name, bound = parameter.name, parameter.bound
    if hasattr(value, 'item') and getattr(value, 'shape', None) == ():
        value = value.item()  # a number of NumPy, which `--help` does without
    if isinstance(parameter.default, bool):
        if not isinstance(value, bool):
            raise ParameterError(name, 'true or false', repr(value))
        return value
    if isinstance(parameter.default, str):
        if not isinstance(value, str) or (bound.choices and value not in bound.choices):
            raise ParameterError(name, f'one of {", ".join(bound.choices)}' if bound.choices else 'a text', repr(value))
        return value
    if isinstance(value, int) and value.bit_length() > 64:  # it may be too large for a float
        raise ParameterError(name, f'a number{_describe_range(bound)}', value)
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not (math.isfinite(value) or value == bound.high):
        raise ParameterError(name, f'a finite number{_describe_range(bound)}', repr(value))
    if isinstance(parameter.default, int) and value != int(value):
        raise ParameterError(name, f'a whole number{_describe_range(bound)}', repr(value))
    if (bound.low is not None and value < bound.low) or (bound.high is not None and value > bound.high):
        raise ParameterError(name, f'a number{_describe_range(bound)}', repr(value))
    return int(value) if isinstance(parameter.default, int) else float(value)


def _describe_range(bound: Bound) -> str:
    return '' if bound.low is None else f' in [{bound.low:g}, {bound.high:g}] {bound.unit}'.rstrip()
