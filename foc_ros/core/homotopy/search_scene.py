"""The scene of a search: how large each obstacle counts on the way to each goal, and which obstacles the names contain.

The candidates of the previous prediction add hysteresis: noise then changes neither the names nor the gaps that are open.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from foc_ros.core.kernels import (
    Flags,
    FlagTable,
    Indices,
    Matrix,
    Table,
    Vector,
    compiled_exactly,
    compiled_separately,
    compiled_with_caller,
    freeze,
)
from foc_ros.core.obstacles.boundary import (
    Boundaries,
    find_approach,
    find_outer_scale,
    find_segment_square,
    measure_way_round,
    tabulate_boundaries,
)
from foc_ros.core.obstacles.rounded_polygon import Polygons, find_offset, tabulate_polygons
from foc_ros.core.types import Array, Candidate, Obstacles

FAR_SIDE = 2.0
"""An obstacle is out of the way if the path round its far side is longer than this times the straight line."""
MIN_SIZE = 1e-6
"""Least radius of a shape and least distance of a goal [m]: a point has no side."""
POINT_RADIUS = 1e-12
"""Least radius [m] of a shape that shrinks; a circle of this radius blocks nothing."""
SHRINK = 1e-6
"""A radius shrinks to the distance of the hand or a goal from the polygon, less this share, a polygon that holds it likewise."""
OFF_HAND = 1e-9
"""A goal that lies on the hand is moved away by this much [m]."""
ENTER = 0.005
"""An obstacle that was in no name to a goal enters the names only if it is this much within the bounds [m]."""
NARROWER = 0.004
"""A gap that a candidate went through stays open until it is this much, or the clearance, too narrow [m]."""
OPEN = 1e-6
"""Width of a gap that is kept open [m]."""


class SearchScene(NamedTuple):
    """A hand, g goals and n obstacles, which are rounded polygons of their radius plus the clearance.

    hand (2,), goals (g, 2), centre (n, 2) [m]; polygons (n). wanted_radius (n,): radius plus clearance [m]. radius (g, n): of the
    shapes on the way to each goal [m], smaller if they would hold the hand (holds_hand (n,)) or the goal (holds_goal (g, n)).
    scale (g, n): size of the polygons on the way to each goal as a multiple of the real ones, less than 1 for a polygon that
    itself holds the hand or the goal, and 0 if only a point is left. is_goal_inside (g,): whether an obstacle, without the
    clearance, holds the goal. is_named (g, n): whether the names of the paths to a goal contain an obstacle. bearing_change
    (g, n): direction of the goal less direction of the hand, as seen from each centre [rad]. excess (g, n): a length that no path
    to a goal that touches a shape falls below, as a multiple of the straight line.
    """

    hand: Vector
    goals: Matrix
    centre: Matrix
    polygons: Polygons
    wanted_radius: Vector
    radius: Matrix
    scale: Matrix
    holds_hand: Flags
    holds_goal: FlagTable
    is_goal_inside: Flags
    is_named: FlagTable
    bearing_change: Matrix
    excess: Matrix

    def take_polygons(self, goal: int, rows: list[int] | Indices) -> Polygons:
        """Return the polygons of some obstacles on the way to a goal."""
        scale = self.scale[goal, rows]
        corners = np.where(scale > 0.0, self.polygons.corners[rows], 1)
        return freeze(Polygons(self.polygons.vertices[rows] * scale[:, None, None], corners))


class Trip(NamedTuple):
    """A straight line past a shape.

    hand, goal: from its centre [m]; radius [m]; straight: length [m]; slack [m]: see `ENTER`.
    """

    hand_x: float
    hand_y: float
    goal_x: float
    goal_y: float
    radius: float
    straight: float
    slack: float


def build_search_scene(
    hand: Array, goals: Array, obstacles: Obstacles, clearance: float, previous: Sequence[Candidate]
) -> SearchScene:
    """Build the scene for a hand (2,) and goals (g, 2) [m]; previous: the candidates of the previous prediction."""
    sides = _tabulate_sides(obstacles.ids, previous)
    centre, radius = np.ascontiguousarray(obstacles.centre, dtype=float), np.ascontiguousarray(obstacles.radius, dtype=float)
    polygons = tabulate_polygons(obstacles)
    wanted = keep_gaps_open(centre, np.maximum(radius + clearance, MIN_SIZE), polygons, float(clearance), sides)
    slack, goals = _compute_slack(len(goals), previous, sides), np.ascontiguousarray(goals, dtype=float)
    return measure_scene(np.ascontiguousarray(hand, dtype=float), goals, centre, radius, wanted, polygons, slack)


def named_obstacles(
    hand: Array, goals: Array, obstacles: Obstacles, clearance: float, previous: Sequence[Candidate]
) -> list[set[str]]:
    """Return the ids of the obstacles that the names of the paths to each goal contain.

    hand (2,), goals (g, 2) [m]; clearance [m]; previous: the candidates of the previous prediction.
    """
    scene = build_search_scene(hand, goals, obstacles, clearance, previous)
    return [{obstacles.ids[row] for row in np.flatnonzero(is_named)} for is_named in scene.is_named]


@compiled_exactly
def keep_gaps_open(centre: Matrix, radius: Vector, polygons: Polygons, clearance: float, sides: Table) -> Vector:
    """Return the radii (n,) [m], each reduced by half of what is missing in a gap that some candidate went through."""
    reduced = radius.copy()
    for i in range(len(radius)):
        for k in range(len(radius)):
            if (sides[:, i] * sides[:, k] < 0).any():
                x, y = centre[k, 0] - centre[i, 0], centre[k, 1] - centre[i, 1]
                missing = radius[i] + radius[k] - find_approach(polygons, i, k, x, y).distance
                if -OPEN < missing < min(NARROWER, clearance):
                    reduced[i] = min(reduced[i], radius[i] - (missing / 2.0 + OPEN))
    return reduced


@compiled_separately
def is_in_names(polygons: Polygons, boundaries: Boundaries, k: int, trip: Trip) -> bool:
    """Tell whether the names to a goal contain an obstacle; a kernel, as NumPy takes 70 us for the scene and this takes 3 us.

    An obstacle is named if the foot of some point of its polygon lies between hand and goal, and it either blocks the straight
    line or its far side is within reach. The shortest path round one shape consists of two tangents and an arc. Of the two such
    paths past a shape that does not block the straight line, the shorter one is that on the far side. As no other obstacle has
    an influence, a name stays the same if other obstacles appear, vanish or move.
    """
    line_x, line_y, first, last = trip.goal_x - trip.hand_x, trip.goal_y - trip.hand_y, np.inf, -np.inf
    for vertex in polygons.vertices[k, : polygons.corners[k]]:
        foot = ((vertex[0] - trip.hand_x) * line_x + (vertex[1] - trip.hand_y) * line_y) / trip.straight
        first, last = min(first, foot), max(last, foot)
    if not (trip.slack < last and first < trip.straight - trip.slack):
        return False
    line_x, line_y, bar = line_x / trip.straight, line_y / trip.straight, trip.radius * trip.radius
    if find_segment_square(polygons, k, trip.hand_x, trip.hand_y, line_x, line_y, trip.straight) < bar:
        return True
    reach = FAR_SIDE * trip.straight - trip.slack
    hand, goal = (trip.hand_x, trip.hand_y), (trip.goal_x, trip.goal_y)
    clockwise = measure_way_round(polygons, boundaries, k, trip.radius, hand, goal, -1)
    return bool(min(clockwise, measure_way_round(polygons, boundaries, k, trip.radius, hand, goal, 1)) <= reach)


@compiled_with_caller
def measure_distance(polygons: Polygons, k: int, scale: float, x: float, y: float) -> float:
    """Return the signed distance [m] of a point from a polygon of another size; x, y: from its centre [m]."""
    if scale == 0.0:
        return float(np.hypot(x, y))
    offset = find_offset(polygons, k, x / scale, y / scale)
    return float(np.hypot(offset.x, offset.y) * offset.side * scale)


@compiled_exactly
def measure_scene(
    hand: Vector,
    goals: Matrix,
    centre: Matrix,
    radius: Vector,
    wanted: Vector,
    polygons: Polygons,
    slack: Matrix,
) -> SearchScene:
    """Measure the scene; radius (n,): without the clearance [m]; wanted (n,): with it; slack (g, n) [m]: see `ENTER`."""
    (g, n), goals, boundaries = slack.shape, goals.copy(), tabulate_boundaries(polygons)
    on_way, scale, hand_distance, hand_scale = np.empty((g, n)), np.empty((g, n)), np.empty(n), np.ones(n)
    holds_hand, holds_goal, excess = np.empty(n, np.bool_), np.empty((g, n), np.bool_), np.empty((g, n))
    is_inside, is_named, bearing_change = np.zeros(g, np.bool_), np.zeros((g, n), np.bool_), np.empty((g, n))
    for k in range(n):
        hand_x, hand_y = hand[0] - centre[k, 0], hand[1] - centre[k, 1]
        hand_distance[k] = measure_distance(polygons, k, 1.0, hand_x, hand_y)
        holds_hand[k] = hand_distance[k] <= wanted[k]
        if hand_distance[k] <= 0.0:
            hand_scale[k] = (1.0 - SHRINK) * find_outer_scale(polygons, k, hand_x, hand_y)
    for goal in range(g):
        if np.hypot(goals[goal, 0] - hand[0], goals[goal, 1] - hand[1]) < OFF_HAND:
            goals[goal, 0], goals[goal, 1] = hand[0] + OFF_HAND, hand[1]
        straight = max(np.hypot(goals[goal, 0] - hand[0], goals[goal, 1] - hand[1]), MIN_SIZE)
        for k in range(n):
            hand_x, hand_y = hand[0] - centre[k, 0], hand[1] - centre[k, 1]
            goal_x, goal_y = goals[goal, 0] - centre[k, 0], goals[goal, 1] - centre[k, 1]
            goal_distance, shape, size = measure_distance(polygons, k, 1.0, goal_x, goal_y), wanted[k], hand_scale[k]
            holds_goal[goal, k] = goal_distance <= wanted[k]
            if goal_distance <= 0.0:
                size = min(size, (1.0 - SHRINK) * find_outer_scale(polygons, k, goal_x, goal_y))
            if holds_hand[k]:
                shape = max(measure_distance(polygons, k, size, hand_x, hand_y) * (1.0 - SHRINK), POINT_RADIUS)
            if holds_goal[goal, k]:
                distance = measure_distance(polygons, k, size, goal_x, goal_y)
                shape = min(max(distance * (1.0 - SHRINK), POINT_RADIUS), shape)
            on_way[goal, k], scale[goal, k] = shape, size
            is_inside[goal] |= goal_distance < radius[k]
            if size > 0.0:
                ends = hand_x / size, hand_y / size, goal_x / size, goal_y / size
                trip = Trip(ends[0], ends[1], ends[2], ends[3], shape / size, straight / size, slack[goal, k] / size)
                is_named[goal, k] = is_in_names(polygons, boundaries, k, trip)
            # a negative zero counts as zero, as it does in `count_crossing`
            bearing_change[goal, k] = np.arctan2(goal_y + 0.0, goal_x + 0.0) - np.arctan2(hand_y + 0.0, hand_x + 0.0)
            excess[goal, k] = max(hand_distance[k] + goal_distance - 2.0 * shape, straight) / straight
    return SearchScene(
        hand,
        goals,
        centre,
        polygons,
        wanted,
        on_way,
        scale,
        holds_hand,
        holds_goal,
        is_inside,
        is_named,
        bearing_change,
        excess,
    )


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
