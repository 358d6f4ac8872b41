# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Names: which obstacles the names of the classes to a goal contain, and how large the obstacles count.

The candidates of the previous prediction add hysteresis: noise then changes neither the names nor the gaps that are open.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from foc_ros.core.obstacle_table import Obstacles
from foc_ros.core.obstacles.clearance import cull_obstacles
from foc_ros.core.obstacles.geometry import measure_offsets
from foc_ros.core.solution import Candidate
from foc_ros.core.types import Array

from .graph import Rows
from .outlines import Flags, Outlines, measure_gaps, outline_obstacles
from .sides import compute_bearings, is_between

OPEN = 1e-6
"""Width of a gap that is kept open [m]."""
MIN_SIZE = 1e-6
"""Least radius of an obstacle and least distance of a goal [m]: a point has no side."""


@dataclass(frozen=True, eq=False)
class Names:
    """How n obstacles count on the way from the hand to g goals.

    radius (n,): of each with the clearance [m], less where a gap is kept open. holds_hand (n,), holds_goal (g, n): whether an
    obstacle of this size holds the hand or the goal; blocks (g, n): false for an obstacle, without the clearance, that holds the
    goal, or is it. is_named (g, n): whether the names of the paths to a goal contain an obstacle.
    """

    radius: Array
    holds_hand: Flags
    holds_goal: Flags
    blocks: Flags
    is_named: Flags


def take_near(obstacles: Obstacles, hand: Array, goals: Array) -> Obstacles:
    """Return the obstacles that names may contain and graphs consist of: the 64 with the least detour."""
    return cull_obstacles(obstacles, hand, goals, 0.0, 64)


def find_names(
    hand: Array,
    goals: Array,
    obstacles: Obstacles,
    blocks: Flags,
    clearance: float,
    previous: Sequence[Candidate],
) -> Names:
    """Find out which obstacles the names contain.

    An obstacle is named if the foot of some point of its polygon lies between hand and goal, and it either blocks the straight
    line or a path round its far side is short enough. As no other obstacle has an influence, a name stays the same if other
    obstacles appear, vanish or move.

    hand (2,), goals (g, 2) [m]; blocks (g, n): see `Names`; clearance: distance that the hand needs from an obstacle [m];
    previous: the candidates of the previous prediction.
    """
    sides = _tabulate_sides(obstacles, previous)
    radius = _keep_gaps_open(obstacles, np.maximum(obstacles.radius + clearance, MIN_SIZE), clearance, sides)
    _, distance = measure_offsets(np.vstack([hand, goals]), obstacles)
    slack = np.zeros((len(goals), len(obstacles)))
    goal_of = np.array([candidate.goal for candidate in previous], dtype=np.intp)
    for goal in {candidate.goal for candidate in previous if candidate.goal < len(goals)}:
        slack[goal] = np.where(sides[goal_of == goal].any(axis=0), 0.0, 0.005)  # a new one has to be 5 mm within the bounds
    is_named = _find_named(outline_obstacles(obstacles, radius), obstacles, hand, goals, blocks, slack)
    return Names(radius, distance[0] <= radius, distance[1:] <= radius, blocks, is_named)


def _find_named(outlines: Outlines, obstacles: Obstacles, hand: Array, goals: Array, blocks: Flags, slack: Array) -> Flags:
    """Return which obstacles are named on the way to each goal, (g, n); outlines shrink if they hold the hand or the goal."""
    own, is_named = outlines.measure_scale(hand), np.zeros_like(blocks)
    scale = np.reshape([np.minimum(own, outlines.measure_scale(goal)) for goal in goals], blocks.shape)
    goal, row = np.nonzero(blocks & (scale > MIN_SIZE))
    size, edges = scale[goal, row][:, None], obstacles.edges.take(row)
    ends = hand - obstacles.centre[row], goals[goal] - obstacles.centre[row]
    is_beside = is_between(size * edges.x, size * edges.y, *ends, slack[goal, row])
    goal, row = goal[is_beside], row[is_beside]
    near, begin, end = outlines.take(row).shrink(scale[goal, row]), np.broadcast_to(hand, (len(row), 2)), goals[goal]
    # an obstacle is out of the way if the path round its far side is longer than twice the straight line
    limit = 2.0 * np.maximum(np.hypot(*(end - begin).T), MIN_SIZE) - slack[goal, row]
    is_named[goal, row] = near.cut(begin, end) | (_measure_far_side(near, begin, end) <= limit)
    return is_named


def _tabulate_sides(obstacles: Obstacles, previous: Sequence[Candidate]) -> Rows:
    """Return on which side each previous candidate passes each obstacle (p, n), 0 if its name does not contain the obstacle."""
    table, row = np.zeros((len(previous), len(obstacles)), dtype=np.intp), {name: row for row, name in enumerate(obstacles.ids)}
    for p, candidate in enumerate(previous):
        for identity, side in candidate.sides:
            if identity in row:
                table[p, row[identity]] = side
    return table


def _keep_gaps_open(obstacles: Obstacles, radius: Array, clearance: float, sides: Rows) -> Array:
    """Return the radii (n,) [m], each reduced by half of what is missing in a gap that some candidate went through."""
    is_taken = (sides > 0).astype(int).T @ (sides < 0)
    first, second = np.nonzero(is_taken + is_taken.T)
    if not len(first):
        return radius
    missing = radius[first] + radius[second] - measure_gaps(obstacles)[0][first, second]
    is_kept = (missing > -OPEN) & (missing < min(0.004, clearance))  # narrower gaps are closed
    reduced = radius.copy()
    np.minimum.at(reduced, first[is_kept], radius[first[is_kept]] - (missing[is_kept] / 2.0 + OPEN))
    return reduced


def _measure_far_side(outlines: Outlines, hand: Array, goal: Array) -> Array:
    """Return the length (n,) [m] of the path round that side of each outline on which the straight line does not pass it."""
    bearing = compute_bearings(goal - outlines.centre) - compute_bearings(hand - outlines.centre)
    is_clockwise = np.mod(bearing, 2.0 * np.pi) < np.pi
    edges = np.hypot(*(outlines.vertices - np.roll(outlines.vertices, 1, axis=1)).transpose(2, 0, 1))
    reached = np.cumsum(edges, axis=1)
    rows, touching = np.arange(len(outlines)), []
    for point, sense in ((hand, 1.0), (goal, -1.0)):
        to = outlines.vertices - point[:, None]
        following = np.roll(to, -1, axis=1)
        turn = np.where(is_clockwise, sense, -sense)[:, None] * (to[..., 0] * following[..., 1] - to[..., 1] * following[..., 0])
        # the first vertex behind which the outline turns back, as seen from the point
        touching.append(((turn <= 0.0) & (np.roll(turn, 1, axis=1) > 0.0)).argmax(axis=1))
    first, last = touching
    arc = np.where(is_clockwise, 1.0, -1.0) * (reached[rows, first] - reached[rows, last])
    ends = [np.hypot(*(outlines.vertices[rows, row] - point).T) for row, point in ((first, hand), (last, goal))]
    length: Array = ends[0] + np.mod(arc, np.maximum(reached[:, -1], MIN_SIZE)) + ends[1]
    return length
