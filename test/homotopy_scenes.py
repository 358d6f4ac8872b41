# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Scenes for the tests of the homotopy classes: reaches among circles, made at random, turned, mirrored and reordered."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np

from foc_ros.core.classes import Search, search
from foc_ros.core.config import HomotopyConfig
from foc_ros.core.obstacle_table import Obstacles, make_obstacles

CLEARANCE = 0.005
GOAL = np.array([0.35, 0.0])
AVOIDING = Path(__file__).parents[2] / 'shared' / 'data' / 'd3il_avoiding'

ANY = 1e6
"""A detour that leaves out no class."""


def find(
    obstacles: Obstacles,
    goals=GOAL,
    hand=(0.0, 0.0),
    velocity=(0.0, 0.0),
    k=6,
    steps=100,
    previous=(),
    clearance=CLEARANCE,
    detour=ANY,
) -> Search:
    goals = np.asarray(goals, dtype=float).reshape(-1, 2)
    mean = np.array([*hand, *velocity, 0.0, 0.0])
    settings = HomotopyConfig(max_candidates=k, max_detour=detour, clearance=clearance)
    return search(mean, goals, obstacles, settings, [1.0] * len(goals), steps, previous)


def random_scene(rng: np.random.Generator, n: int, spread: float = 0.12) -> Obstacles:
    """n circles between the hand at the origin and GOAL that hold neither, and no gap within a millimetre of closing."""
    while True:
        centre = np.column_stack([rng.uniform(0.02, 0.33, n), rng.uniform(-spread, spread, n)])
        radius = rng.uniform(0.01, 0.035, n)
        apart = np.hypot(*(centre[:, None] - centre).transpose(2, 0, 1)) - radius[:, None] - radius - 2 * CLEARANCE
        np.fill_diagonal(apart, 1.0)
        ends = np.array([np.hypot(*(centre - end).T) - radius - CLEARANCE for end in (np.zeros(2), GOAL)])
        if (np.abs(apart) > 1e-3).all() and (ends > 1e-3).all():
            return make_obstacles(centre, radius)


def gap_to_circles(path: np.ndarray, obstacles: Obstacles, clearance: float = CLEARANCE) -> float:
    """Least distance of a path's points from the circles with the clearance [m]."""
    apart = np.hypot(*(path[:, None] - obstacles.centre).transpose(2, 0, 1)) - obstacles.radius - clearance
    return float(apart.min(initial=np.inf))


def avoiding() -> tuple[Obstacles, np.ndarray]:
    """The six cylinders and four goals of the Avoiding task."""
    with (AVOIDING / 'obstacles.csv').open() as file:
        rows = list(csv.DictReader(file))
    with (AVOIDING / 'goals.csv').open() as file:
        goals = [[float(row['x_m']), float(row['y_m'])] for row in csv.DictReader(file)]
    centre, radius = [[float(row['x_m']), float(row['y_m'])] for row in rows], [float(row['radius_m']) for row in rows]
    return make_obstacles(centre, radius, ids=tuple(row['obstacle'] for row in rows)), np.array(goals)
