# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The scenes that are timed. They are drawn from seeds; each is a reach of 0.36 m in 1 s."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from foc_ros.core.config import Config
from foc_ros.core.hand.kalman import FilterState, update
from foc_ros.core.obstacle_table import Obstacles, make_obstacles
from foc_ros.core.obstacles.polygons import make_box_polygon
from foc_ros.core.ocp.problem import Problem, rest_to_goal
from foc_ros.core.plant.covariance import scale_noise
from foc_ros.core.plant.plants import build_triple_integrator_horizon
from foc_ros.core.types import HandSample

Array = NDArray[np.float64]

NOISE, ETA = 0.15, 0.9
DURATION_S, STEPS, RATE_HZ = 1.0, 50, 100.0
GOAL = np.array([0.36, 0.0])
START_NS = 1_000_000_000
DRIFT = np.array([0.01, 0.004])
"""Velocity of a hand whose movement has not begun [m/s]."""
TRACKER_STDDEV = 0.0001
"""Standard deviation of the measured positions [m]."""


def build_circles() -> Obstacles:
    """Return three circles that can all be passed on the left. All solvers end in the same minimum here."""
    return make_obstacles([[0.12, -0.01], [0.16, -0.02], [0.2, -0.05]], [0.03, 0.025, 0.025], [0.003, 0.002, 0.002])


def build_boxes() -> Obstacles:
    """Return two boxes with rounded corners that can both be passed on the left."""
    polygons = [make_box_polygon((0.06, 0.04), 0.3), make_box_polygon((0.05, 0.03), -0.2)]
    return make_obstacles([[0.12, -0.02], [0.2, -0.04]], 0.01, 0.001, polygons=polygons)


def build_guess() -> Array:
    """Return a minimum-jerk straight line bowed to the left, (N + 1, 2) [m]."""
    s = np.arange(STEPS + 1) / STEPS
    along = 10 * s**3 - 15 * s**4 + 6 * s**5
    return np.stack((GOAL[0] * along, 0.09 * np.sin(np.pi * s)), axis=1)


def build_problem(obstacles: Obstacles, initial_mean: Array | None = None, duration_s: float = DURATION_S) -> Problem:
    """Return the reaching problem of one class, by default from rest at the origin."""
    horizon = build_triple_integrator_horizon(duration_s / STEPS, STEPS)
    initial = np.zeros(6) if initial_mean is None else initial_mean
    noise = scale_noise(np.array([NOISE, NOISE]), DURATION_S / STEPS, horizon.dt)
    return rest_to_goal(horizon, initial, GOAL, obstacles, noise, ETA)


def build_rows(sizes: tuple[int, ...], seed: int = 0, radius: float = 0.008) -> Obstacles:
    """Return rows of circles along the reach, one row for each size, with gaps of about 7 cm between them.

    The circles of a row are too close together for the hand, so that there is one class more than there are rows. All rows are
    near the start, where the variance of a movement with so much noise still fits into the gaps.
    """
    generator = np.random.default_rng(seed)
    heights = 0.07 * (np.arange(len(sizes)) - (len(sizes) - 1) / 2)
    centres = [(0.12 + 2.2 * radius * i, height) for height, size in zip(heights, sizes, strict=True) for i in range(size)]
    shifted = np.array(centres) + generator.uniform(-0.002, 0.002, (len(centres), 2))
    return make_obstacles(shifted, generator.uniform(0.7 * radius, radius, len(centres)), 0.0005)


@dataclass(frozen=True, eq=False)
class Reach:
    """A hand among obstacles: parameters, obstacles, goals (g, 2) [m], and the estimated hand state of each tick."""

    config: Config
    obstacles: Obstacles
    goals: Array
    hands: tuple[FilterState, ...]


def build_reach(obstacles: Obstacles, values: dict[str, object], goals: Array = GOAL[None], ticks: int = 30) -> Reach:
    """Return ticks at 100 Hz of a hand that drifts too slowly for a movement to have begun, so that T does not change."""
    fixed = {'duration.model': 'fixed', 'duration.fixed_s': DURATION_S, 'rate_hz': RATE_HZ, 'foc.steps': STEPS}
    config = Config().with_values(fixed | values)
    generator = np.random.default_rng(3)
    state: FilterState | None = None
    hands = []
    for tick in range(ticks + 10):
        position = DRIFT * tick / RATE_HZ + generator.normal(0, TRACKER_STDDEV, 2)
        state = update(state, HandSample(START_NS + round(tick * 1e9 / RATE_HZ), position), config.estimator).state
        hands.append(state)
    return Reach(config, obstacles, goals, tuple(hands[10:]))


def build_4x8() -> Reach:
    """Return a reach with 4 classes among 8 circles."""
    values: dict[str, object] = {'foc.noise_x': NOISE, 'foc.noise_y': NOISE, 'foc.eta': ETA, 'homotopy.max_candidates': 4}
    return build_reach(build_rows((3, 2, 3)), values)


def build_4_boxes() -> Reach:
    """Return a reach to two goals among four sharp boxes, with six candidates and the default noise."""
    boxes = [((0.05, 0.03), 0.3), ((0.04, 0.04), 0.0), ((0.06, 0.02), -0.4), ((0.03, 0.05), 0.1)]
    polygons = [make_box_polygon(*each) for each in boxes]
    centres = [[0.12, 0.04], [0.14, -0.05], [0.23, 0.0], [0.25, 0.09]]
    obstacles = make_obstacles(centres, 0.0, 0.001, polygons=polygons)
    return build_reach(obstacles, {'homotopy.max_candidates': 6}, np.array([[0.36, 0.04], [0.36, -0.04]]))


def add_far_obstacles(reach: Reach, count: int) -> Reach:
    """Return a reach among circles with `count` more at 1 to 3 m from its middle."""
    generator, near = np.random.default_rng(5), reach.obstacles
    angle, distance = generator.uniform(0, 2 * np.pi, count), generator.uniform(1.0, 3.0, count)
    far = GOAL / 2 + distance[:, None] * np.stack((np.cos(angle), np.sin(angle)), axis=1)
    radius = np.concatenate((near.radius, generator.uniform(0.01, 0.03, count)))
    radius_stddev = np.concatenate((near.radius_stddev, np.full(count, 0.001)))
    return replace(reach, obstacles=make_obstacles(np.concatenate((near.centre, far)), radius, radius_stddev))
