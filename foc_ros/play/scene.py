# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The scene of the page: obstacles and goals that a user arranges, random ones for the tasks, and the predictions in it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Annotated, Any, ClassVar, Literal, NamedTuple

import numpy as np
from pydantic import Field

from foc_ros.core.obstacle_table import Obstacles
from foc_ros.core.obstacles.geometry import measure_offsets
from foc_ros.core.obstacles.shapes import Box, Circle, collect_obstacles
from foc_ros.core.prediction import Prediction
from foc_ros.core.types import Array
from foc_ros.io.fields import Fields
from foc_ros.reporting.encode import encode_candidates, encode_unsolved
from foc_ros.reporting.views import list_unsolved
from foc_ros.ros.messages.encode_inputs import encode_goals, encode_obstacles
from foc_ros.ros.messages.ranking import order_candidates
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

Point = tuple[float, float]
X = Annotated[float, Field(ge=BOUNDS[0], le=BOUNDS[1])]
Y = Annotated[float, Field(ge=BOUNDS[2], le=BOUNDS[3])]
Size = Annotated[float, Field(ge=0.002, le=0.3)]
"""Radius or full length of an obstacle [m]."""


class PlacedPoint(Fields):
    """A goal [m]."""

    x: X
    y: Y


class PlacedCircle(PlacedPoint):
    """An obstacle [m]."""

    kind: Literal['circle'] = 'circle'
    radius: Size
    box: ClassVar = (0.0, 0.0, 0.0)

    @property
    def shape(self) -> Circle:
        """The obstacle with the standard deviation that all obstacles of the page have."""
        return Circle((self.x, self.y), self.radius, RADIUS_STDDEV)


class PlacedBox(PlacedPoint):
    """An obstacle: full lengths [m], and angle [rad] of the first of them."""

    kind: Literal['box'] = 'box'
    size_x: Size
    size_y: Size
    yaw: Annotated[float, Field(ge=-math.pi, le=math.pi)]

    @property
    def box(self) -> tuple[float, float, float]:
        """Full lengths [m] and angle [rad]."""
        return self.size_x, self.size_y, self.yaw

    @property
    def shape(self) -> Box:
        """The obstacle with the standard deviation that all obstacles of the page have."""
        return Box((self.x, self.y), (self.size_x, self.size_y), self.yaw, radius_stddev=RADIUS_STDDEV)


Placed = Annotated[PlacedCircle | PlacedBox, Field(discriminator='kind')]


class PlayScene(Fields):
    """Obstacles, of which each has the number of its row as name, and goals."""

    obstacles: Annotated[list[Placed], Field(max_length=MOST_OBSTACLES)]
    goals: Annotated[list[PlacedPoint], Field(min_length=1, max_length=MOST_GOALS)]

    @property
    def points(self) -> list[Point]:
        """The goals [m]."""
        return [(each.x, each.y) for each in self.goals]

    def tabulate(self) -> Obstacles:
        """Return the obstacles as a table."""
        return collect_obstacles([each.shape for each in self.obstacles])

    def measure_clearance(self, position: Point) -> float:
        """Return the distance of a position from the nearest obstacle [m], negative within it."""
        obstacles = self.tabulate()
        distance = measure_offsets(np.array([position]), obstacles)[1] - obstacles.radius
        return float(distance.min(initial=math.inf))

    def encode(self, types: MessageTypes, stamp_ns: int) -> dict[str, Any]:
        """Return the messages of the inputs `obstacles` and `goals`."""
        rows = [
            (each.x, each.y, 0.0, each.shape.radius, RADIUS_STDDEV, row, *each.box) for row, each in enumerate(self.obstacles)
        ]
        goals: Array = np.array([(*point, 0.0) for point in self.points])
        return {
            'obstacles': encode_obstacles(types, stamp_ns, FRAME, rows),
            'goals': encode_goals(types, stamp_ns, FRAME, goals),
        }


FIRST_SCENE = PlayScene(
    obstacles=[
        PlacedCircle(x=0.14, y=0.015, radius=0.025),
        PlacedCircle(x=0.17, y=-0.085, radius=0.02),
        PlacedBox(x=0.2, y=0.095, size_x=0.02, size_y=0.06, yaw=0.3),
    ],
    goals=[PlacedPoint(x=0.3, y=-0.09), PlacedPoint(x=0.31, y=0.0), PlacedPoint(x=0.3, y=0.09)],
)


def make_random_scene(random: np.random.Generator, goals: Sequence[PlacedPoint]) -> PlayScene:
    """Return three to five random circles and boxes between the start and some goals, with gaps of at least 25 mm for a hand."""
    wanted = int(random.integers(3, 5, endpoint=True))
    taken = [(*START, TARGET_RADIUS), *((goal.x, goal.y, TARGET_RADIUS) for goal in goals)]
    obstacles: list[PlacedCircle | PlacedBox] = []
    for _ in range(200):
        if len(obstacles) == wanted:
            break
        x, y = random.uniform(0.07, 0.23), random.uniform(-0.11, 0.11)
        lengths, yaw = random.uniform(0.02, 0.05, 2).tolist(), random.uniform(-math.pi / 2.0, math.pi / 2.0)
        is_box = bool(random.random() < 1.0 / 3.0)
        extent = math.hypot(*lengths) / 2.0 if is_box else lengths[0] / 2.0
        if all(math.hypot(x - other_x, y - other_y) >= extent + reach + 0.025 for other_x, other_y, reach in taken):
            box = PlacedBox(x=x, y=y, size_x=lengths[0], size_y=lengths[1], yaw=yaw)
            obstacles.append(box if is_box else PlacedCircle(x=x, y=y, radius=extent))
            taken.append((x, y, extent))
    return PlayScene(obstacles=obstacles, goals=list(goals))


class View(NamedTuple):
    """A prediction, the candidate first that is called most likely, and its candidates as the page draws them."""

    prediction: Prediction
    candidates: list[dict[str, Any]]


def view_prediction(prediction: Prediction) -> View:
    """Return a prediction for the page; raises FocError if it holds a number that is not finite.

    A candidate has, besides what `reporting.encode` says, its class number (way), goal and likelihood, None where it is unknown.
    """
    shown, lost = order_candidates(prediction), list_unsolved(prediction)
    ordered = replace(prediction, candidates=(*shown, *lost))
    views: list[dict[str, Any]] = [
        {'way': each.way, 'goal': each.candidate.goal, 'likelihood': round(each.likelihood, 4), **encoded}
        for each, encoded in zip(shown, encode_candidates(ordered), strict=True)
    ]
    no_likelihood = {'way': None, 'likelihood': None}
    views += [{'goal': each.candidate.goal, **no_likelihood, **encode_unsolved(ordered, each)} for each in lost]
    return View(ordered, views)
