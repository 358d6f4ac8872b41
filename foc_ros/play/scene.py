"""The scene of the page: obstacles and goals that a user arranges, and random ones for the tasks."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from foc_ros.core.obstacles.geometry import measure_offsets
from foc_ros.core.obstacles.shapes import Box, Circle, collect_obstacles
from foc_ros.core.types import Array, Obstacles
from foc_ros.ros.messages.encode_inputs import encode_goals, encode_obstacles
from foc_ros.ros.messages.types import MessageTypes

FRAME = 'play'
BOUNDS = (-0.06, 0.38, -0.165, 0.165)
"""Limits of x, then of y, of the scene that the page shows [m]."""
START = (0.0, 0.0)
"""Centre of the disc from which every trial begins [m]."""
TARGET_RADIUS = 0.015
"""Radius of the start and of the goals [m]."""
RADIUS_STDDEV = 0.002
"""Standard deviation of the radius of every obstacle [m]."""
MOST_OBSTACLES, MOST_GOALS = 32, 8
RANDOM_OBSTACLES = (3, 5)
RANDOM_AREA = (0.07, 0.23, -0.11, 0.11)
"""Limits of x, then of y, for the centres of random obstacles [m]."""
GAP = 0.025
"""Width of the gap between random obstacles, and between them and start or goals, at least [m]."""
ATTEMPTS = 200

Point = tuple[float, float]


@dataclass(frozen=True)
class PlayScene:
    """Obstacles, of which each has the number of its row as name, and goals [m]."""

    obstacles: tuple[Circle | Box, ...]
    goals: tuple[Point, ...]

    def tabulate(self) -> Obstacles:
        """Return the obstacles as a table."""
        return collect_obstacles(self.obstacles)

    def measure_clearance(self, position: Point) -> float:
        """Return the distance of a position from the nearest obstacle [m], negative within it."""
        obstacles = self.tabulate()
        distance = measure_offsets(np.array([position]), obstacles)[1] - obstacles.radius
        return float(distance.min(initial=math.inf))

    def encode(self, types: MessageTypes, stamp_ns: int) -> dict[str, Any]:
        """Return the messages of the inputs `obstacles` and `goals`."""
        rows = [
            (*np.asarray(each.centre), 0.0, each.radius, each.radius_stddev, row, *_measure_box(each))
            for row, each in enumerate(self.obstacles)
        ]
        goals: Array = np.array([(*goal, 0.0) for goal in self.goals])
        return {
            'obstacles': encode_obstacles(types, stamp_ns, FRAME, rows),
            'goals': encode_goals(types, stamp_ns, FRAME, goals),
        }

    def as_json(self) -> dict[str, Any]:
        """Return the scene as the page sends it."""
        obstacles = []
        for each in self.obstacles:
            x, y = np.asarray(each.centre).tolist()
            if isinstance(each, Box):
                size_x, size_y, yaw = _measure_box(each)
                obstacles.append({'kind': 'box', 'x': x, 'y': y, 'size_x': size_x, 'size_y': size_y, 'yaw': yaw})
            else:
                obstacles.append({'kind': 'circle', 'x': x, 'y': y, 'radius': each.radius})
        return {'obstacles': obstacles, 'goals': [{'x': x, 'y': y} for x, y in self.goals]}


def _measure_box(shape: Circle | Box) -> tuple[float, float, float]:
    """Return full lengths [m] and yaw [rad] of a box, zeros for a circle."""
    if isinstance(shape, Circle):
        return 0.0, 0.0, 0.0
    size_x, size_y = np.asarray(shape.size).tolist()
    return size_x, size_y, shape.yaw


def make_circle(centre: Point, radius: float) -> Circle:
    """Return a circle with the standard deviation that all obstacles of the page have."""
    return Circle(centre, radius, RADIUS_STDDEV)


def make_box(centre: Point, size: Sequence[float], yaw: float) -> Box:
    """Return a box with the standard deviation that all obstacles of the page have."""
    return Box(centre, size, yaw, radius_stddev=RADIUS_STDDEV)


FIRST_SCENE = PlayScene(
    (make_circle((0.14, 0.015), 0.025), make_circle((0.17, -0.085), 0.02), make_box((0.2, 0.095), (0.02, 0.06), 0.3)),
    ((0.3, -0.09), (0.31, 0.0), (0.3, 0.09)),
)


def make_random_scene(random: np.random.Generator, goals: tuple[Point, ...]) -> PlayScene:
    """Return random circles and boxes between the start and some goals, with gaps that a hand fits through."""
    wanted = int(random.integers(*RANDOM_OBSTACLES, endpoint=True))
    taken = [(*START, TARGET_RADIUS), *((*goal, TARGET_RADIUS) for goal in goals)]
    obstacles: list[Circle | Box] = []
    for _ in range(ATTEMPTS):
        if len(obstacles) == wanted:
            break
        x, y = random.uniform(RANDOM_AREA[0], RANDOM_AREA[1]), random.uniform(RANDOM_AREA[2], RANDOM_AREA[3])
        lengths, yaw = random.uniform(0.02, 0.05, 2), random.uniform(-math.pi / 2.0, math.pi / 2.0)
        is_box = bool(random.random() < 1.0 / 3.0)
        extent = float(np.hypot(*lengths)) / 2.0 if is_box else float(lengths[0]) / 2.0
        if all(math.hypot(x - other_x, y - other_y) >= extent + reach + GAP for other_x, other_y, reach in taken):
            obstacles.append(make_box((x, y), lengths.tolist(), yaw) if is_box else make_circle((x, y), extent))
            taken.append((x, y, extent))
    return PlayScene(tuple(obstacles), goals)
