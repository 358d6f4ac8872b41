"""What of the scene matters on the way from the hand to one goal, as circles; obstacles near the ends have a decided answer."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from foc_ros.foc.records import Array
from .roadmap import Complex

REACH = 2.0
"""An obstacle is out of the way when passing it on its far side alone takes more than this times the straight way."""
SMALLEST = 1e-6
"""Least radius of a circle [m]: a point has no side."""
TOUCH = 1e-6
"""A circle that holds the hand or the goal shrinks until its edge passes within this part of its radius."""


def shrunk(point: complex, centre: Complex, radius: Array) -> tuple[Array, NDArray[np.bool_]]:
    """Shrink the circles that hold a point until it lies just outside; returns radii (n,) [m] and which were shrunk (n,)."""
    distance = np.abs(centre - point)
    held = distance <= radius
    return np.where(held, np.maximum(distance * (1.0 - TOUCH), SMALLEST), radius), held


def between(hand: complex, goal: complex, centre: Complex) -> NDArray[np.bool_]:
    """Which centres have their foot strictly between hand and goal: neither behind the hand nor beyond the goal."""
    axis = goal - hand
    foot = ((centre - hand) * np.conj(axis)).real
    inside: NDArray[np.bool_] = (foot > 0.0) & (foot < abs(axis) ** 2)
    return inside


def detours(hand: complex, goal: complex, centre: Complex, radius: Array) -> tuple[Array, Array]:
    """Lengths of the shortest ways round each circle alone, on its near side and on its far side (n,) [m].

    Two tangents and the arc between them. With the angle g in [0, pi] between hand and goal as seen from the centre, the arc is
    g - acos(r / a) - acos(r / b) on the near side, and nothing is in the way where that is negative; 2 pi - g instead of g is the far
    side. Hand and goal lie outside.
    """
    a, b = hand - centre, goal - centre
    far_a, far_b = np.maximum(np.abs(a), SMALLEST), np.maximum(np.abs(b), SMALLEST)
    tangents = np.sqrt((far_a**2 - radius**2).clip(0.0)) + np.sqrt((far_b**2 - radius**2).clip(0.0))
    saved = np.arccos((radius / far_a).clip(0.0, 1.0)) + np.arccos((radius / far_b).clip(0.0, 1.0))
    angle = np.abs(np.angle(b * a.conj()))
    near = np.where(angle > saved, tangents + radius * (angle - saved), abs(goal - hand))
    return near, tangents + radius * (2.0 * np.pi - angle - saved)


def matters(hand: complex, goal: complex, centre: Complex, radius: Array) -> NDArray[np.bool_]:
    """Which obstacles take part in the names of the ways to this goal (n,).

    Those whose foot lies between hand and goal and that block the straight way or have a far side within reach. It depends on no other
    obstacle, so a name stays when obstacles appear, vanish or move elsewhere.
    """
    straight = abs(goal - hand)
    near, far = detours(hand, goal, centre, radius)
    named: NDArray[np.bool_] = between(hand, goal, centre) & ((near > straight) | (far <= REACH * straight))
    return named


def excess(hand: complex, goals: Complex, centre: Complex, radius: Array) -> Array:
    """Least length of a path to any goal that touches the circle, over the straight length to that goal (n,)."""
    straight = np.abs(goals - hand)[:, None]
    through = np.abs(centre - hand) + np.abs(centre - goals[:, None]) - 2.0 * radius
    ratio: Array = (np.maximum(through, straight) / np.maximum(straight, SMALLEST)).min(axis=0)
    return ratio
