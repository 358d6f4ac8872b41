"""How often ways cross the rays from the centres of circles along -x, anticlockwise positive."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from foc_ros.core.kernels import compiled_exactly
from foc_ros.core.types import LEFT, RIGHT

TURN = 2.0 * np.pi
Complex = NDArray[np.complex128]


@compiled_exactly
def straight(a: complex, b: complex) -> int:
    """Crossings by the straight line from a to b, both as seen from the centre: -1, 0 or 1."""
    left = a.real * b.imag - a.imag * b.real
    if a.imag >= 0.0:
        return 1 if b.imag < 0.0 and left > 0.0 else 0
    return -1 if b.imag >= 0.0 and left < 0.0 else 0


@compiled_exactly
def along_circle(east: complex, point: complex, held: bool) -> int:
    """Crossings on the way along a circle, anticlockwise from its easternmost point to another; both as seen from the centre.

    held: whether the centre lies in the circle. The arc then sweeps between 0 and a whole turn; else it counts as its chord.
    """
    if not held:
        return straight(east, point)
    if (east.imag >= 0.0) == (point.imag >= 0.0):
        return 1 if east.real * point.imag - east.imag * point.real < 0.0 else 0
    return 1 if east.imag >= 0.0 else 0


@compiled_exactly
def direction(seen: complex) -> float:
    """Return the angle of a point in (-pi, pi]; a negative zero counts as zero, as it does in the crossings."""
    angle: float = np.arctan2(seen.imag + 0.0, seen.real + 0.0)
    return angle


@compiled_exactly
def side(angle: float) -> int:
    """Return on which side a path passes a centre about which it sweeps an angle: LEFT, RIGHT, 0 where it winds about it."""
    if abs(angle) >= TURN:
        return 0
    return LEFT if angle < 0.0 else RIGHT
