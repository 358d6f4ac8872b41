"""What of the scene matters on the ways from the hand to each goal; obstacles at the ends of a way have a decided answer."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from foc_ros.core.kernels import Flags, FlagTable, Indices, Matrix, Points, Table, Vector, compiled_exactly
from foc_ros.core.types import Candidate, Obstacles

from .circles import GRAZE
from .crossing import TURN, Complex, direction
from .hysteresis import kept_open, strangers
from .names import names_of, passed_before

REACH = 2.0
"""An obstacle is out of the way when passing it on its far side alone takes more than this times the straight way."""
SMALLEST = 1e-6
"""Least radius of a circle, least length of a way [m]: a point has no side."""
POINT = 1e-12
"""Radius of a circle about the very place of the hand or a goal [m], which bars nothing."""
TOUCH = 1e-6
"""A circle that holds the hand or a goal shrinks to this part less than its distance."""


class SearchScene(NamedTuple):
    """n obstacles as circles of radius + clearance, g goals, as seen from the hand.

    hand, goals (g,), centre (n,): complex [m]; wanted (n,): radius + clearance [m]; radius (g, n) on the way to each goal [m],
    smaller where a circle would hold the hand (held (n,)) or that goal (near (g, n)); inside (g,): goals inside an obstacle;
    named (g, n): who takes part in the names of the ways to each goal; turned (g, n): from the direction of the hand to that of
    the goal, as seen from each centre [rad]; excess (n,): least length of a path to any goal that touches the circle, as a
    multiple of the straight way to it; close: how many goals are near, but not inside.
    """

    hand: complex
    centre: Complex
    goals: Points
    wanted: Vector
    radius: Matrix
    held: Flags
    near: FlagTable
    inside: Flags
    named: FlagTable
    turned: Matrix
    excess: Vector
    close: int


def scene(hand: complex, goals: Complex, obstacles: Obstacles, clearance: float, previous: Sequence[Candidate]) -> SearchScene:
    """Look at the obstacles from the hand; previous: the candidates of the tick before."""
    centre: Complex = obstacles.centre.view(complex)[:, 0]
    before = passed_before(names_of(obstacles.ids), previous)
    return SearchScene(hand, centre, *looked_at(hand, goals, centre, obstacles.radius, clearance, *before))


@compiled_exactly
def matters(hand: complex, goal: complex, radius: float, straight: float, slack: float) -> bool:
    """Tell whether an obstacle has a part in a name: its foot is between hand and goal, and it blocks the way or is in reach.

    hand, goal: as seen from its centre. With the angle between them, a path round the circle alone is two tangents and an arc of
    angle - acos(r / a) - acos(r / b); it blocks the way where that is positive, and 2 pi - angle in its place is the far side.
    No other obstacle has a say, so a name stays when obstacles appear, vanish or move elsewhere.
    """
    foot = (hand * (hand - goal).conjugate()).real / straight
    if not slack < foot < straight - slack:
        return False
    a, b = max(abs(hand), radius), max(abs(goal), radius)
    saved = np.arccos(radius / a) + np.arccos(radius / b)
    turn = goal * hand.conjugate()
    angle = abs(np.arctan2(turn.imag, turn.real))
    far = np.sqrt(a * a - radius * radius) + np.sqrt(b * b - radius * radius) + radius * (TURN - angle - saved)
    return bool(angle > saved or far <= REACH * straight - slack)


@compiled_exactly
def looked_at(
    hand: complex, goals: Points, centre: Points, hard: Vector, clearance: float, before: Indices, sides: Table
) -> tuple[Points, Vector, Matrix, Flags, FlagTable, Flags, FlagTable, Matrix, Vector, int]:
    """Return goals, wanted, ..., close of `Scene`; goals on the hand are moved off it.

    hard (n,): radii without clearance [m]; before, sides: see `hysteresis`.
    """
    wanted = kept_open(centre, np.maximum(hard + clearance, SMALLEST), clearance, sides)
    slack = strangers(len(goals), before, sides)
    n, g = len(centre), len(goals)
    apart = np.where(np.abs(goals - hand) < GRAZE, hand + GRAZE, goals)
    radius, turned, excess, held = np.empty((g, n)), np.empty((g, n)), np.full(n, np.inf), np.zeros(n, np.bool_)
    near, inside, named = np.zeros((g, n), np.bool_), np.zeros(g, np.bool_), np.zeros((g, n), np.bool_)
    for k in range(n):
        away = abs(hand - centre[k])
        held[k] = away <= wanted[k]
        beside = max(away * (1.0 - TOUCH), POINT) if held[k] else wanted[k]
        for goal in range(g):
            left = abs(goals[goal] - centre[k])
            near[goal, k] = left <= wanted[k]
            inside[goal] |= left < hard[k]
            r = min(max(left * (1.0 - TOUCH), POINT), beside) if near[goal, k] else beside
            straight = max(abs(apart[goal] - hand), SMALLEST)
            radius[goal, k] = r
            named[goal, k] = matters(hand - centre[k], goals[goal] - centre[k], r, straight, slack[goal, k])
            turned[goal, k] = direction(apart[goal] - centre[k]) - direction(hand - centre[k])
            excess[k] = min(excess[k], max(away + left - 2.0 * r, straight) / straight)
    close = 0
    for goal in range(g):
        close += near[goal].any() and not inside[goal]
    return apart, wanted, radius, held, near, inside, named, turned, excess, close
