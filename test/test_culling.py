"""Culling keeps the obstacles near the straight paths, wherever they are in the table, and those that move towards them."""

from __future__ import annotations

import numpy as np

from foc_ros.core.obstacles.clearance import cull_obstacles
from foc_ros.core.types import make_obstacles

HAND, GOALS = np.zeros(2), np.array([[0.3, 0.0], [0.0, 0.3]])
RNG = np.random.default_rng(3)
FAR = np.array([2.0, 2.0]) + RNG.uniform(-1.0, 1.0, (50, 2))


def kept(centre: object, radius: object = 0.02, velocity: object = 0.0, most: int = 2) -> tuple[str, ...]:
    return cull_obstacles(make_obstacles(centre, radius, velocity=velocity), HAND, GOALS, 1.0, most).ids


def test_few_obstacles_are_returned_unchanged() -> None:
    obstacles = make_obstacles(FAR, 0.02)
    assert cull_obstacles(obstacles, HAND, GOALS, 1.0, 50) is obstacles


def test_obstacles_on_the_path_to_any_goal_are_kept_in_their_order() -> None:
    centre = np.insert(FAR, [7, 30], [[0.0, 0.15], [0.15, 0.0]], axis=0)
    assert kept(centre) == ('7', '31')


def test_larger_and_faster_obstacles_are_kept() -> None:
    centre = [[0.15, 0.5], [0.15, 0.6], [0.15, 0.7]]
    assert kept(centre, most=1) == ('0',)
    assert kept(centre, radius=[0.02, 0.3, 0.02], most=1) == ('1',)
    assert kept(centre, velocity=[[0.0, 0.0], [0.0, 0.0], [0.0, -1.0]], most=1) == ('2',)


def test_of_equal_obstacles_the_first_rows_are_kept() -> None:
    assert kept([[0.15, 0.4]] * 5, most=3) == ('0', '1', '2')


def test_the_order_of_the_table_has_no_influence() -> None:
    centre = RNG.uniform(-1.0, 1.0, (200, 2))
    turned = RNG.permutation(200)
    first = {tuple(centre[int(each)]) for each in kept(centre, most=20)}
    second = {tuple(centre[turned][int(each)]) for each in kept(centre[turned], most=20)}
    assert first == second
