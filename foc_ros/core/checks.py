"""Checks of what a user passes to the public API: arrays of the right shape, finite numbers within bounds."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from .errors import SceneError
from .types import Array

FARTHEST = 1e4
"""Bound on every length, velocity and acceleration, in SI units."""


def check_array(field: str, value: ArrayLike, shape: tuple[int | None, ...]) -> Array:
    """Return a new array of finite numbers of a shape, in which None stands for any length; raise SceneError otherwise."""
    sizes = ', '.join('n' if size is None else str(size) for size in shape)
    expected = f'finite numbers of shape ({sizes}{"," if len(shape) == 1 else ""})'
    try:
        array = np.array(value, dtype=float)
    except OverflowError as error:
        raise SceneError(field, expected, 'a whole number beyond all floats') from error
    except (TypeError, ValueError) as error:
        raise SceneError(field, expected, repr(value)) from error
    if array.ndim != len(shape) or any(size not in (None, found) for size, found in zip(shape, array.shape, strict=True)):
        raise SceneError(field, expected, f'{value!r} of shape {array.shape}')
    if not (np.abs(array) <= FARTHEST).all():
        raise SceneError(field, f'numbers in [{-FARTHEST:g}, {FARTHEST:g}]', repr(value))
    return array


def check_vector(field: str, value: ArrayLike, length: int) -> Array:
    """Return a new array (length,) of finite numbers; raise SceneError otherwise."""
    return check_array(field, value, (length,))


def check_number(field: str, value: object, low: float = -FARTHEST, high: float = FARTHEST) -> float:
    """Return a finite number within bounds; raise SceneError otherwise."""
    if isinstance(value, (bool, np.bool_)) or not isinstance(value, (int, float, np.integer, np.floating)):
        raise SceneError(field, f'a number in [{low:g}, {high:g}]', repr(value))
    if not low <= value <= high:
        raise SceneError(field, f'a number in [{low:g}, {high:g}]', value)
    return float(value)
