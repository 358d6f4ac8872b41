"""The scene of a search: how large each obstacle counts on the way to each goal, and which obstacles the names contain.

The candidates of the previous prediction add hysteresis: noise then changes neither the names nor the gaps that are open.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from foc_ros.core.kernels import Flags, FlagTable, Matrix, Table, Vector
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
    each centre [rad]. excess (n,): least length of a path to any goal that touches a circle, as a multiple of the straight line.
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
    excess: Vector


def build_search_scene(
    hand: Array, goals: Array, obstacles: Obstacles, clearance: float, previous: Sequence[Candidate]
) -> SearchScene:
    """Build the scene for a hand (2,) and goals (g, 2) [m]; previous: the candidates of the previous prediction."""
    sides = _tabulate_sides(obstacles.ids, previous)
    centre, wanted = obstacles.centre, np.maximum(obstacles.radius + clearance, MIN_SIZE)
    wanted = _keep_gaps_open(centre, wanted, clearance, sides)
    on_hand = np.hypot(*(goals - hand).T) < OFF_HAND
    goals = np.where(on_hand[:, None], hand + np.array([OFF_HAND, 0.0]), goals)
    straight = np.maximum(np.hypot(*(goals - hand).T), MIN_SIZE)[:, None]
    to_hand, to_goal = hand - centre, goals[:, None] - centre
    hand_distance, goal_distance = np.hypot(*to_hand.T), np.hypot(to_goal[..., 0], to_goal[..., 1])
    holds_hand, holds_goal = hand_distance <= wanted, goal_distance <= wanted
    radius = np.where(holds_hand, np.maximum(hand_distance * (1.0 - SHRINK), POINT_RADIUS), wanted)
    radius = np.where(holds_goal, np.minimum(np.maximum(goal_distance * (1.0 - SHRINK), POINT_RADIUS), radius), radius)
    is_inside = np.any(goal_distance < obstacles.radius, axis=1)
    is_named = _find_named(to_hand, to_goal, radius, straight, _compute_slack(len(goals), previous, sides))
    bearing_change = _compute_bearings(to_goal) - _compute_bearings(to_hand)
    detour = np.maximum(hand_distance + goal_distance - 2.0 * radius, straight) / straight
    excess, holds = detour.min(axis=0, initial=np.inf), (holds_hand, holds_goal)
    return SearchScene(hand, goals, centre, wanted, radius, *holds, is_inside, is_named, bearing_change, excess)


def named_obstacles(
    hand: Array, goals: Array, obstacles: Obstacles, clearance: float, previous: Sequence[Candidate]
) -> list[set[str]]:
    """Return the ids of the obstacles that the names of the paths to each goal contain.

    hand (2,), goals (g, 2) [m]; clearance [m]; previous: the candidates of the previous prediction.
    """
    scene = build_search_scene(hand, goals, obstacles, clearance, previous)
    return [{obstacles.ids[row] for row in np.flatnonzero(is_named)} for is_named in scene.is_named]


def _find_named(to_hand: Matrix, to_goal: Array, radius: Matrix, straight: Matrix, slack: Matrix) -> FlagTable:
    """Tell which obstacles the names to each goal contain (g, n).

    An obstacle is named if the foot of its centre lies between hand and goal, and it either blocks the straight line or its far
    side is within reach. The shortest path round one circle consists of two tangents and an arc of the angle p - acos(r / a) -
    acos(r / b), where a and b are the distances of the ends from the centre and p is the angle between them. The circle blocks
    the straight line if this is positive. On the far side, 2 pi - p takes the place of p. As no other obstacle has an influence,
    a name stays the same if other obstacles appear, vanish or move.

    to_hand (n, 2), to_goal (g, n, 2): from the centres [m]; straight (g, 1): distance of the goals [m]; slack (g, n) [m].
    """
    (hand_x, hand_y), (goal_x, goal_y) = to_hand.T, (to_goal[..., 0], to_goal[..., 1])
    foot = (hand_x * (hand_x - goal_x) + hand_y * (hand_y - goal_y)) / straight
    a, b = np.maximum(np.hypot(hand_x, hand_y), radius), np.maximum(np.hypot(goal_x, goal_y), radius)
    tangent_angles = np.arccos(radius / a) + np.arccos(radius / b)
    angle = np.abs(np.arctan2(hand_x * goal_y - hand_y * goal_x, hand_x * goal_x + hand_y * goal_y))
    tangents = np.sqrt(a * a - radius * radius) + np.sqrt(b * b - radius * radius)
    is_within_reach = tangents + radius * (TURN - angle - tangent_angles) <= FAR_SIDE * straight - slack
    is_named: FlagTable = (slack < foot) & (foot < straight - slack) & ((angle > tangent_angles) | is_within_reach)
    return is_named


def _compute_bearings(seen: Array) -> Array:
    """Compute the directions of points (..., 2) relative to a centre, in (-pi, pi]; a negative zero counts as zero."""
    bearings: Array = np.arctan2(seen[..., 1] + 0.0, seen[..., 0] + 0.0)
    return bearings


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


def _keep_gaps_open(centre: Matrix, radius: Vector, clearance: float, sides: Table) -> Vector:
    """Return the radii (n,) [m], each reduced by half of what is missing in a gap that some candidate went through."""
    if not len(sides):
        return radius
    apart = centre[:, None] - centre
    missing = radius[:, None] + radius - np.hypot(apart[..., 0], apart[..., 1])
    is_between = (sides[:, :, None] * sides[:, None, :]).min(axis=0) < 0
    is_kept = is_between & (missing > -OPEN) & (missing < min(NARROWER, clearance))
    reduced: Vector = radius - np.where(is_kept, missing / 2.0 + OPEN, 0.0).max(axis=1, initial=0.0)
    return reduced
