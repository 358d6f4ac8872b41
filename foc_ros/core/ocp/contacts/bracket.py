"""Search for the time of a minimum by parabolas through three times, closer and closer."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from foc_ros.core.kernels import compiled_with_caller

PARABOLAS = 8
"""Most parabolas that are fitted in a search."""


class Bracket(NamedTuple):
    """Times a < b < c in steps, and the values there, of which the one at b is the least."""

    a: float
    b: float
    c: float
    at_a: float
    at_b: float
    at_c: float


@compiled_with_caller
def find_vertex(bracket: Bracket, tolerance: float) -> float:
    """Return the time of the vertex of the parabola through the three values.

    Infinite where it is outside the bracket, or nearer to b than a tolerance.
    """
    a, b, c, at_a, at_b, at_c = bracket
    bend = (b - a) * (at_b - at_c) - (b - c) * (at_b - at_a)
    if bend == 0.0:
        return np.inf
    time = b - 0.5 * ((b - a) ** 2 * (at_b - at_c) - (b - c) ** 2 * (at_b - at_a)) / bend
    return time if a < time < c and abs(time - b) >= tolerance else np.inf


@compiled_with_caller
def narrow(bracket: Bracket, time: float, value: float) -> Bracket:
    """Return the narrower bracket with the value at a time in it."""
    a, b, c, at_a, at_b, at_c = bracket
    if value <= at_b:
        return Bracket(a, time, b, at_a, value, at_b) if time < b else Bracket(b, time, c, at_b, value, at_c)
    return Bracket(time, b, c, value, at_b, at_c) if time < b else Bracket(a, b, time, at_a, at_b, value)
