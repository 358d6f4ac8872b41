# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Checks of what a user passes to the public API, and the count of what was refused."""

from __future__ import annotations

import reprlib
from collections import Counter
from collections.abc import Iterable, Mapping
from numbers import Number
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from .config import Config
from .errors import InputError, SceneError
from .solution import Goal, name_goal
from .types import NANOSECONDS, Array

FARTHEST = 1e4
"""Bound on every length, velocity and acceleration, in SI units."""


def check_array(field: str, value: ArrayLike, shape: tuple[int | None, ...]) -> Array:
    """Return a new array of finite numbers of a shape, in which None stands for any length; raise SceneError otherwise."""
    sizes = ', '.join('n' if size is None else str(size) for size in shape)
    expected = f'finite numbers of shape ({sizes}{"," if len(shape) == 1 else ""})'
    try:
        given = np.asarray(value)
        array = given.astype(float, casting='unsafe' if given.dtype == object else 'same_kind')  # no texts, no complex numbers
    except OverflowError as error:
        raise SceneError(field, expected, 'a whole number beyond all floats') from error
    except (TypeError, ValueError) as error:
        raise SceneError(field, expected, repr(value)) from error
    if array.ndim != len(shape) or any(size not in (None, found) for size, found in zip(shape, array.shape, strict=True)):
        raise SceneError(field, expected, f'{reprlib.repr(value)} of shape {array.shape}')
    if not (np.abs(array) <= FARTHEST).all():
        raise SceneError(field, f'numbers in [{-FARTHEST:g}, {FARTHEST:g}]', repr(value))
    return array


def check_vector(field: str, value: ArrayLike, length: int) -> Array:
    """Return a new array (length,) of finite numbers; raise SceneError otherwise."""
    return check_array(field, value, (length,))


def check_position(field: str, value: ArrayLike) -> Array:
    """Return a new array (2,) or (3,) of a position in the plane [m], with or without a height; raise SceneError otherwise."""
    if find_shape(value) not in ((2,), (3,)):
        raise SceneError(field, 'two numbers [m] in the task plane, or three with the height over it', repr(value))
    return check_vector(field, value, find_shape(value)[0])


class GoalTable(NamedTuple):
    """Goals that a user gave: positions (g, 2) [m], heights (g,) [m] or None, names (g,), objects (g,) or none."""

    positions: Array
    heights: Array | None
    names: tuple[str, ...]
    objects: tuple[str | None, ...]


def collect_goals(field: str, goals: ArrayLike | Goal | Iterable[Goal | ArrayLike]) -> GoalTable:
    """Return the table of goals, each a position (2,) or (3,) or a `Goal`, or of one that is given without a list.

    Raises SceneError for anything else, for goals of which only some have a height, and for a name that occurs twice.
    """
    if not isinstance(goals, (Goal, Iterable)) or isinstance(goals, (str, Mapping)):
        raise SceneError(field, 'positions or Goals', repr(goals))
    rows: list[tuple[str, Any]] = [(field, goals)]
    if not isinstance(goals, Goal):
        shape, values = find_shape(goals), list(goals)
        if len(shape) != 1 or not values or not all(isinstance(each, Number) for each in values):  # it is no position
            rows = [(f'{field}[{row}]', each) for row, each in enumerate(values)]
    given = [each if isinstance(each, Goal) else Goal(check_position(name, each)) for name, each in rows]
    if not given:
        raise SceneError(field, 'at least one position', 'none')
    sizes = {len(np.asarray(each.position)) for each in given}
    if len(sizes) > 1:
        raise SceneError(field, 'a height for all goals or for none', 'heights for some')
    points = np.array([each.position for each in given])
    names = tuple(each.name or name_goal(row) for row, each in enumerate(given))
    if len(set(names)) < len(names):
        twice = next(name for name in names if names.count(name) > 1)
        raise SceneError(field, 'a different name for each goal', f'{twice!r} twice')
    has_names = any(each.name for each in given)
    objects = tuple(each.object for each in given) if any(each.object for each in given) else ()
    return GoalTable(points[:, :2], points[:, 2] if sizes == {3} else None, names if has_names else (), objects)


def check_number(field: str, value: object, low: float = -FARTHEST, high: float = FARTHEST) -> float:
    """Return a finite number within bounds; raise SceneError otherwise."""
    if isinstance(value, (bool, np.bool_)) or not isinstance(value, (int, float, np.integer, np.floating)):
        raise SceneError(field, f'a number in [{low:g}, {high:g}]', repr(value))
    if not low <= value <= high:
        raise SceneError(field, f'a number in [{low:g}, {high:g}]', value)
    return float(value)


def find_shape(given: object) -> tuple[int, ...]:
    """Return the shape of anything that may be an array, without a check of its numbers."""
    return np.shape(np.asarray(given, dtype=object))


def check_config(config: Config | None) -> Config:
    """Return a config, the defaults for None; raise InputError for anything else."""
    if not isinstance(config, (Config, type(None))):
        raise InputError('config', 'a Config', repr(config))
    return Config() if config is None else config


class Rejections:
    """Attributes: counts, by kind; refused, number of rejections; last, the text of the last one, None before the first."""

    def __init__(self) -> None:
        self.counts: Counter[str] = Counter()
        self.refused = 0
        self.last: str | None = None

    def count(self, kind: str) -> None:
        """Count an event that is no rejection."""
        self.counts[kind] += 1

    def reject(self, kind: str, message: str) -> None:
        """Count a rejection and keep its text."""
        self.counts[kind] += 1
        self.refused += 1
        self.last = message

    def reject_stamp(self, kind: str, topic: str, stamp_ns: int, newest_ns: int) -> None:
        """Reject a stamp [ns] that is not after the newest one."""
        if stamp_ns == newest_ns:
            self.reject(kind, f'{topic}: stamps repeat: {stamp_ns} ns is that of the message before')
            return
        seconds = (newest_ns - stamp_ns) / NANOSECONDS
        self.reject(kind, f'{topic}: the stamp {stamp_ns} ns is {seconds:g} s behind the newest one, {newest_ns} ns')

    def accept_frame(self, kind: str, topic: str, frame_id: str, working: str | None) -> bool:
        """Return whether a frame is the working one, or none is fixed yet; otherwise reject it and name both."""
        if working is None or frame_id == working:
            return True
        self.reject(kind, str(InputError(f'{topic}.header.frame_id', f"the working frame '{working}'", f"'{frame_id}'")))
        return False
