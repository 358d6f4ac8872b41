"""What of the scene matters on the ways from the hand to each goal; obstacles at the ends of a way have a decided answer."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from foc_ros.foc.records import Array, Candidate, Obstacles

from .circles import GRAZE
from .crossing import Complex, Flags
from .hysteresis import kept_open, strangers

REACH = 2.0
"""An obstacle is out of the way when passing it on its far side alone takes more than this times the straight way."""
SMALLEST = 1e-6
"""Least radius of a circle, least length of a way [m]: a point has no side."""
POINT = 1e-12
"""Radius of a circle about the very place of the hand or a goal [m], which bars nothing."""
TOUCH = 1e-6
"""A circle that holds the hand or a goal shrinks to this part less than its distance."""


@dataclass(frozen=True, eq=False)
class Scene:
    """n obstacles as circles of radius + clearance, g goals, as seen from the hand.

    hand, goals (g,), centre (n,): complex [m]; radius (g, n) on the way to each goal [m], smaller where a circle would hold the
    hand (held (n,)) or that goal (near (g, n)); wanted (n,): radius + clearance [m]; inside (g,): goals inside an obstacle;
    named (g, n): who takes part in the names of the ways to each goal; excess (n,): least length of a path to any goal that
    touches the circle, as a multiple of the straight way to it.
    """

    hand: complex
    goals: Complex
    centre: Complex
    radius: Array
    wanted: Array
    held: Flags
    near: Flags
    inside: Flags
    named: Flags
    excess: Array


def scene(hand: complex, goals: Complex, obstacles: Obstacles, clearance: float, previous: Sequence[Candidate]) -> Scene:
    """Look at the obstacles from the hand; previous: the candidates of the tick before."""
    centre = obstacles.centre[:, 0] + 1j * obstacles.centre[:, 1]
    wanted = kept_open(obstacles.ids, centre, np.maximum(obstacles.radius + clearance, SMALLEST), clearance, previous)
    from_hand, from_goal = hand - centre, goals[:, None] - centre
    a, b = np.abs(from_hand), np.abs(from_goal)
    held, near = a <= wanted, b <= wanted
    radius = np.where(held, np.maximum(a * (1.0 - TOUCH), POINT), wanted)
    radius = np.where(near, np.minimum(np.maximum(b * (1.0 - TOUCH), POINT), radius), radius)
    goals = np.where(np.abs(goals - hand) < GRAZE, hand + GRAZE, goals)
    straight = np.maximum(np.abs(goals - hand), SMALLEST)[:, None]
    named = _named(from_hand, from_goal, a, b, radius, straight, strangers(obstacles.ids, len(goals), previous))
    excess = (np.maximum(a + b - 2.0 * radius, straight) / straight).min(axis=0, initial=np.inf)
    return Scene(hand, goals, centre, radius, wanted, held, near, np.asarray((b < obstacles.radius).any(axis=1)), named, excess)


def _named(from_hand: Complex, from_goal: Complex, a: Array, b: Array, radius: Array, straight: Array, slack: Array) -> Flags:
    """Tell who takes part in the names (g, n): whose foot lies between hand and goal, and who blocks the way or is in reach.

    With the angle between hand and goal as seen from the centre, a path round the circle alone is two tangents and an arc of
    angle - acos(r / a) - acos(r / b); it blocks the way where that is positive, and 2 pi - angle in its place is the far side.
    No other obstacle has a say, so a name stays when obstacles appear, vanish or move elsewhere.
    """
    foot = (from_hand * (from_hand - from_goal).conj()).real / straight
    between = (foot > slack) & (foot < straight - slack)
    a, b = np.maximum(a, radius), np.maximum(b, radius)
    saved = np.arccos(radius / a) + np.arccos(radius / b)
    angle = np.abs(np.angle(from_goal * from_hand.conj()))
    far = np.sqrt(a**2 - radius**2) + np.sqrt(b**2 - radius**2) + radius * (2.0 * np.pi - angle - saved)
    return np.asarray(between & ((angle > saved) | (far <= REACH * straight - slack)))
