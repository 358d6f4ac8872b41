"""The scene of a prediction as lines of text, for a terminal."""

from __future__ import annotations

import numpy as np

from foc_ros.core.obstacles.geometry import measure_offsets
from foc_ros.core.types import Array
from foc_ros.reporting.draw import Bounds, compute_bounds
from foc_ros.reporting.views import Snapshot

WIDTH, HEIGHT = 72, 13
"""Size of the drawing [characters]; with the table it fits into 24 lines."""
OBSTACLE, GOAL, HAND = '▒', '*', '@'
LEGEND = f'{HAND} hand   {GOAL} goal   {OBSTACLE} obstacle   1 2 3 candidates, most likely first'


def extend_bounds(snapshot: Snapshot, hand: Array, before: Bounds | None) -> Bounds:
    """Return limits [m] around obstacles, goals and hand (2,) [m], and around those before, so that the drawing rarely moves."""
    left, right, bottom, top = compute_bounds(snapshot.obstacles, snapshot.goals, (), hand[None], margin=0.02)
    if before is None:
        return left, right, bottom, top
    return min(left, before[0]), max(right, before[1]), min(bottom, before[2]), max(top, before[3])


def draw_scene(snapshot: Snapshot, hand: Array, bounds: Bounds) -> str:
    """Return the drawing; hand (2,) [m]; bounds: left, right, bottom and top [m]."""
    left, right, bottom, top = bounds
    x, y = np.linspace(left, right, WIDTH), np.linspace(top, bottom, HEIGHT)
    cells = np.full((HEIGHT, WIDTH), ' ')
    if len(snapshot.obstacles):
        points = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
        is_inside = (measure_offsets(points, snapshot.obstacles)[1] <= snapshot.obstacles.radius).any(axis=1)
        cells[is_inside.reshape(cells.shape)] = OBSTACLE
    marks = [(_fill(each.curve), str(row + 1)) for row, each in reversed([*enumerate(snapshot.candidates[:9])])]
    for points, mark in [*marks, (snapshot.goals, GOAL), (hand[None], HAND)]:
        column = np.rint((points[:, 0] - left) / (right - left) * (WIDTH - 1)).astype(int)
        row = np.rint((top - points[:, 1]) / (top - bottom) * (HEIGHT - 1)).astype(int)
        is_visible = (column >= 0) & (column < WIDTH) & (row >= 0) & (row < HEIGHT)
        cells[row[is_visible], column[is_visible]] = mark
    return '\n'.join(''.join(line).rstrip() for line in cells)


def _fill(points: Array) -> Array:
    """Return more points along a line (m, 2) [m], so that it is drawn without gaps."""
    rows = np.linspace(0.0, len(points) - 1.0, 4 * WIDTH)
    return np.column_stack([np.interp(rows, np.arange(len(points)), axis) for axis in points.T])
