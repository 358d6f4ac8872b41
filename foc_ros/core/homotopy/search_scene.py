"""The scene of a search: how large each obstacle counts on the way to each goal, and which obstacles the names contain.

The candidates of the previous prediction add hysteresis: noise then changes neither the names nor the gaps that are open.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from foc_ros.core.kernels import Flags, FlagTable, Matrix, Table, Vector, compiled_exactly
from foc_ros.core.types import Array, Candidate, Obstacles

from .sides import TURN

FAR_SIDE = 2.0
"""An obstacle is out of the way if the path round its far side is longer than this times the straight line."""
MIN_SIZE = 1e-6
"""Least radius of a circle and least distance of a goal [m]: a point has no side."""
POINT_RADIUS = 1e-12
"""Radius [m] of a circle whose centre is the hand or the goal; such a circle blocks nothing."""
SHRINK = 1e-6
"""A circle that holds the hand or a goal shrinks to its distance from it, less this share."""
OFF_HAND = 1e-9
"""A goal that lies on the hand is moved away by this much [m]."""
ENTER = 0.005
"""An obstacle that was in no name to a goal enters the names only if it is this much within the bounds [m]."""
NARROWER = 0.004
"""A gap that a candidate went through stays open until it is this much, or the clearance, too narrow [m]."""
OPEN = 1e-6
"""Width of a gap that is kept open [m]."""


class SearchScene(NamedTuple):
    """A hand, g goals and n obstacles, which are circles of their radius plus the clearance.

    hand (2,), goals (g, 2), centre (n, 2) [m]. wanted_radius (n,): radius plus clearance [m]. radius (g, n): the circles on the
    way to each goal [m], smaller if they would hold the hand (holds_hand (n,)) or the goal (holds_goal (g, n)).
    is_goal_inside (g,): whether an obstacle, without the clearance, holds the goal. is_named (g, n): whether the names of the
    paths to a goal contain an obstacle. bearing_change (g, n): direction of the goal less direction of the hand, as seen from
    each centre [rad]. excess (g, n): least length of a path to a goal that touches a circle, as a multiple of the straight line.
    """

    hand: Vector
    goals: Matrix
    centre: Matrix
    wanted_radius: Vector
    radius: Matrix
    holds_hand: Flags
    holds_goal: FlagTable
    is_goal_inside: Flags
    is_named: FlagTable
    bearing_change: Matrix
    excess: Matrix


def build_search_scene(
    hand: Array, goals: Array, obstacles: Obstacles, clearance: float, previous: Sequence[Candidate]
) -> SearchScene:
    """Build the scene for a hand (2,) and goals (g, 2) [m]; previous: the candidates of the previous prediction."""
    sides = _tabulate_sides(obstacles.ids, previous)
    centre, radius = np.ascontiguousarray(obstacles.centre, dtype=float), np.ascontiguousarray(obstacles.radius, dtype=float)
    wanted = keep_gaps_open(centre, np.maximum(radius + clearance, MIN_SIZE), float(clearance), sides)
    slack, goals = _compute_slack(len(goals), previous, sides), np.ascontiguousarray(goals, dtype=float)
    return measure_scene(np.ascontiguousarray(hand, dtype=float), goals, centre, radius, wanted, slack)


def named_obstacles(
    hand: Array, goals: Array, obstacles: Obstacles, clearance: float, previous: Sequence[Candidate]
) -> list[set[str]]:
    """Return the ids of the obstacles that the names of the paths to each goal contain.

    hand (2,), goals (g, 2) [m]; clearance [m]; previous: the candidates of the previous prediction.
    """
    scene = build_search_scene(hand, goals, obstacles, clearance, previous)
    return [{obstacles.ids[row] for row in np.flatnonzero(is_named)} for is_named in scene.is_named]


@compiled_exactly
def keep_gaps_open(centre: Matrix, radius: Vector, clearance: float, sides: Table) -> Vector:
    """Return the radii (n,) [m], each reduced by half of what is missing in a gap that some candidate went through."""
    reduced = radius.copy()
    for i in range(len(radius)):
        for k in range(len(radius)):
            missing = radius[i] + radius[k] - np.hypot(centre[i, 0] - centre[k, 0], centre[i, 1] - centre[k, 1])
            if -OPEN < missing < min(NARROWER, clearance) and (sides[:, i] * sides[:, k] < 0).any():
                reduced[i] = min(reduced[i], radius[i] - (missing / 2.0 + OPEN))
    return reduced


@compiled_exactly
def is_in_names(hand_x: float, hand_y: float, goal_x: float, goal_y: float, radius: float, straight: float, slack: float) -> bool:
    """Tell whether the names to a goal contain an obstacle; a kernel, as NumPy takes 70 us for the scene and this takes 3 us.

    An obstacle is named if the foot of its centre lies between hand and goal, and it either blocks the straight line or its far
    side is within reach. The shortest path round one circle consists of two tangents and an arc of the angle p - acos(r / a) -
    acos(r / b), where a and b are the distances of the ends from the centre and p is the angle between them. The circle blocks
    the straight line if this is positive. On the far side, 2 pi - p takes the place of p. As no other obstacle has an influence,
    a name stays the same if other obstacles appear, vanish or move.

    hand, goal: from the centre [m]; straight: distance of the goal from the hand [m]; slack [m].
    """
    foot = (hand_x * (hand_x - goal_x) + hand_y * (hand_y - goal_y)) / straight
    if not slack < foot < straight - slack:
        return False
    a, b = max(np.hypot(hand_x, hand_y), radius), max(np.hypot(goal_x, goal_y), radius)
    tangent_angles = np.arccos(radius / a) + np.arccos(radius / b)
    angle = abs(np.arctan2(hand_x * goal_y - hand_y * goal_x, hand_x * goal_x + hand_y * goal_y))
    tangents = np.sqrt(a * a - radius * radius) + np.sqrt(b * b - radius * radius)
    far_side = tangents + radius * (TURN - angle - tangent_angles)
    return bool(angle > tangent_angles or far_side <= FAR_SIDE * straight - slack)


@compiled_exactly
def measure_scene(hand: Vector, goals: Matrix, centre: Matrix, radius: Vector, wanted: Vector, slack: Matrix) -> SearchScene:
    """Measure the scene; radius (n,): without the clearance [m]; wanted (n,): with it; slack (g, n) [m]: see `is_in_names`."""
    (g, n), goals = slack.shape, goals.copy()
    on_way, holds_hand, holds_goal = np.empty((g, n)), np.empty(n, np.bool_), np.empty((g, n), np.bool_)
    is_inside, is_named, bearing_change = np.zeros(g, np.bool_), np.empty((g, n), np.bool_), np.empty((g, n))
    excess = np.empty((g, n))
    for k in range(n):
        holds_hand[k] = np.hypot(hand[0] - centre[k, 0], hand[1] - centre[k, 1]) <= wanted[k]
    for goal in range(g):
        if np.hypot(goals[goal, 0] - hand[0], goals[goal, 1] - hand[1]) < OFF_HAND:
            goals[goal, 0], goals[goal, 1] = hand[0] + OFF_HAND, hand[1]
        straight = max(np.hypot(goals[goal, 0] - hand[0], goals[goal, 1] - hand[1]), MIN_SIZE)
        for k in range(n):
            hand_x, hand_y = hand[0] - centre[k, 0], hand[1] - centre[k, 1]
            goal_x, goal_y = goals[goal, 0] - centre[k, 0], goals[goal, 1] - centre[k, 1]
            hand_distance, goal_distance, circle = np.hypot(hand_x, hand_y), np.hypot(goal_x, goal_y), wanted[k]
            if holds_hand[k]:
                circle = max(hand_distance * (1.0 - SHRINK), POINT_RADIUS)
            holds_goal[goal, k] = goal_distance <= wanted[k]
            if holds_goal[goal, k]:
                circle = min(max(goal_distance * (1.0 - SHRINK), POINT_RADIUS), circle)
            on_way[goal, k] = circle
            is_inside[goal] |= goal_distance < radius[k]
            is_named[goal, k] = is_in_names(hand_x, hand_y, goal_x, goal_y, circle, straight, slack[goal, k])
            # a negative zero counts as zero, as it does in `count_crossing`
            bearing_change[goal, k] = np.arctan2(goal_y + 0.0, goal_x + 0.0) - np.arctan2(hand_y + 0.0, hand_x + 0.0)
            excess[goal, k] = max(hand_distance + goal_distance - 2.0 * circle, straight) / straight
    return SearchScene(hand, goals, centre, wanted, on_way, holds_hand, holds_goal, is_inside, is_named, bearing_change, excess)


def _tabulate_sides(ids: tuple[str, ...], previous: Sequence[Candidate]) -> Table:
    """Return on which side each previous candidate passes each obstacle (p, n), 0 if its name does not contain the obstacle."""
    table, row = np.zeros((len(previous), len(ids)), dtype=np.intp), {identity: row for row, identity in enumerate(ids)}
    for p, candidate in enumerate(previous):
        for identity, side in candidate.sides:
            if identity in row:
                table[p, row[identity]] = side
    return table


def _compute_slack(goals: int, previous: Sequence[Candidate], sides: Table) -> Matrix:
    """Return ENTER for the obstacles that were not in the names to a goal that had candidates, else 0; (g, n) [m]."""
    slack, goal_of = np.zeros((goals, sides.shape[1])), np.array([candidate.goal for candidate in previous], dtype=np.intp)
    for goal in {candidate.goal for candidate in previous if candidate.goal < goals}:
        slack[goal] = np.where(sides[goal_of == goal].any(axis=0), 0.0, ENTER)
    return slack
