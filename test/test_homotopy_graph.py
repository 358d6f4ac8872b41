# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The visibility graph of many obstacles: gaps, obstacles beside the way, the limit of the search, and smooth guesses."""

import numpy as np
import pytest
from homotopy_scenes import CLEARANCE, GOAL, find, random_scene
from homotopy_shapes import turn

from foc_ros.core.classes import scene
from foc_ros.core.obstacle_table import make_obstacles

VELOCITY = np.array([0.1, 0.05])


def crowd(seed, n, size, wide):
    rng = np.random.default_rng(seed)
    centre = rng.uniform([-wide, -wide], [0.35 + wide, wide], (n, 2))
    radius = rng.uniform(0.3 * size, size, n)
    keep = np.all([np.hypot(*(centre - end).T) > radius + 0.006 for end in (np.zeros(2), GOAL)], axis=0)
    return make_obstacles(centre[keep], radius[keep])


@pytest.mark.parametrize('angle', np.linspace(0.0, np.pi, 5))
@pytest.mark.parametrize(('gap', 'through'), [(2 * CLEARANCE - 1e-5, False), (2 * CLEARANCE + 1e-5, True)])
def test_a_gap_in_any_direction_is_open_from_twice_the_clearance(angle, gap, through):
    apart = turn(np.array([[0.0, 0.03 + gap / 2]]), 0.8 * (angle - np.pi / 2))[0]
    obstacles = make_obstacles(np.array([0.17, 0.0]) + np.array([apart, -apart]), 0.03)
    sides = [tuple(side for _, side in one.sides) for one in find(obstacles, k=4).candidates]
    assert ((1, -1) in sides or (-1, 1) in sides) is through


def test_an_obstacle_in_no_name_still_blocks():
    # a screen beside the hand blocks the path round the one obstacle in front; it is behind the hand, so no name contains it
    screen = [[-0.012, 0.02 + 0.02 * k] for k in range(20)]
    obstacles = make_obstacles([[0.1, 0.0], *screen], [0.05] + [0.012] * 20)
    found = find(obstacles)
    assert {one.label for one in found.candidates} == {'goal0:+0', 'goal0:-0'}
    for one in found.candidates:
        apart = np.hypot(*(one.guess[:, None] - obstacles.centre).transpose(2, 0, 1)) - obstacles.radius - 0.005
        assert apart.min() > -1e-6


def test_the_search_ends_at_the_largest_number_of_states_and_says_so(monkeypatch):
    obstacles = crowd(3, 30, 0.03, 0.15)
    whole = find(obstacles, velocity=VELOCITY, k=32)
    monkeypatch.setattr(scene, 'STATES', 100)
    monkeypatch.setattr(scene, 'STATES_PER_CANDIDATE', 0)
    few = find(obstacles, velocity=VELOCITY, k=32)
    assert few.notes == {'search_cut': 1} and 0 < len(few.candidates) < len(whole.candidates)
    assert [one.label for one in few.candidates] == [one.label for one in whole.candidates][: len(few.candidates)]


@pytest.mark.parametrize('seed', range(10))
def test_guesses_are_as_smooth_as_hands_on_exact_paths(seed):
    rng = np.random.default_rng(seed)
    for one in find(random_scene(rng, int(rng.integers(1, 6))), steps=50).candidates:
        bend = np.hypot(*np.diff(one.guess, 2, axis=0).T).max() * 50**2
        # minimum jerk on a straight line has 5.8 L / T^2; a circle of radius r adds v^2 / r
        assert bend < 5.8 * one.length + 1.4 * (1.875 * one.length) ** 2 / 0.015
