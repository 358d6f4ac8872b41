"""How often ways cross the rays from the centres of circles along -x, anticlockwise positive, and signatures made of that."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from foc_ros.foc.records import Array

Complex = NDArray[np.complex128]
Counts = NDArray[np.int64]
Flags = NDArray[np.bool_]

BITS, BIAS = 4, 5
"""A signature is one whole number with four bits for each obstacle: crossings + 5."""
DIGITS = 15
"""So many of them fit into 64 bits, and are packed at once."""


def straight(a: Complex, b: Complex) -> Counts:
    """Crossings by the straight line from a to b, both as seen from the centres: -1, 0 or 1."""
    up_a, up_b, left = a.imag >= 0.0, b.imag >= 0.0, a.real * b.imag - a.imag * b.real
    change = up_a ^ up_b
    crossings: Counts = (change & up_a & (left > 0.0)).astype(np.int64) - (change & up_b & (left < 0.0))
    return crossings


def along_circle(east: Complex, point: Complex, held: Flags) -> Counts:
    """Crossings on the way along a circle, anticlockwise from its easternmost point to another; both as seen from the centres.

    held: which centres lie in the circle. From those the arc sweeps between 0 and a whole turn; for the others it counts as its
    chord.
    """
    up_a, up_b, left = east.imag >= 0.0, point.imag >= 0.0, east.real * point.imag - east.imag * point.real
    crossings: Counts = np.where(held, (up_a & ~up_b) | ((up_a == up_b) & (left < 0.0)), straight(east, point))
    return crossings


def packed(crossings: Counts) -> list[int]:
    """Rows of crossings (m, n) as signed whole numbers to be added to signatures."""
    total = [0] * len(crossings)
    for first in range(0, crossings.shape[1], DIGITS):
        part = crossings[:, first : first + DIGITS]
        words: list[int] = (part @ (1 << BITS * np.arange(part.shape[1]))).tolist()
        total = [a + (b << BITS * first) for a, b in zip(total, words, strict=True)] if first else words
    return total


def unpacked(signature: int, digits: int) -> list[int]:
    """Crossings (digits,) in a signature."""
    return [(signature >> BITS * i & 15) - BIAS for i in range(digits)]


def angle_of(seen: Complex) -> Array:
    """Angle in (-pi, pi]; a negative zero counts as zero, as it does in the crossings."""
    angle: Array = np.angle(seen + 0.0j)
    return angle
