# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Candidates for hands and goals in margins, closed gaps, empty scenes and crowds."""

import numpy as np
import pytest
from homotopy_scenes import find, gap_to_circles

from foc_ros.core.classes import find_path_sides, search
from foc_ros.core.config import HomotopyConfig
from foc_ros.core.errors import SceneError
from foc_ros.core.obstacle_table import make_obstacles

NOTHING = make_obstacles()


def pass_as_named(found, obstacles):
    """Whether each guess passes the named obstacles as its name says."""
    return all(dict(one.sides).items() <= find_path_sides(one.guess, obstacles).items() for one in found.candidates)


def test_no_obstacles_one_straight_candidate_per_goal():
    found = find(NOTHING, goals=[[0.3, 0.0], [0.0, 0.2]])
    assert [one.label for one in found.candidates] == ['goal1:', 'goal0:']
    assert [one.length for one in found.candidates] == pytest.approx([0.2, 0.3])
    assert np.abs(found.candidates[1].guess[:, 1]).max() < 1e-12


def test_obstacle_exactly_on_the_line_is_passed_on_both_sides_the_same():
    obstacles = make_obstacles([[0.15, 0.0]], 0.03)
    found = find(obstacles)
    assert [one.label for one in found.candidates] == ['goal0:+0', 'goal0:-0']
    left, right = found.candidates
    np.testing.assert_allclose(left.guess * [1, -1], right.guess, atol=1e-12)
    assert left.guess[:, 1].max() > 0.034


def test_hand_between_two_obstacles_too_near_to_each_other_gets_out():
    found = find(make_obstacles([[0.0, 0.032], [0.0, -0.032]], 0.03))
    assert found.notes == {'hand_inside': 2}
    assert [one.label for one in found.candidates] == ['goal0:']


def test_the_one_gap_in_a_ring_is_found_and_a_turn_back_is_long():
    angle = 2 * np.pi * np.arange(12) / 12
    ring = 0.1 * np.column_stack([np.cos(angle), np.sin(angle)])
    obstacles = make_obstacles(np.delete(ring, 6, axis=0), 0.03)
    found = find(obstacles, k=4)
    assert len(found.candidates) == 2 and pass_as_named(found, obstacles)
    assert all(one.length > 0.1 + 0.1 * np.pi + 0.2 for one in found.candidates)
    assert all(gap_to_circles(one.guess, obstacles) > -1e-9 for one in found.candidates)


def test_obstacles_out_of_the_way_have_no_part_in_the_name():
    out = [[-0.1, 0.0], [0.45, 0.0], [0.15, 0.9]]
    assert [one.label for one in find(make_obstacles(out, 0.02)).candidates] == ['goal0:']
    found = find(make_obstacles([*out, [0.15, 0.01]], 0.02))
    assert [one.label for one in found.candidates] == ['goal0:-3', 'goal0:+3']


def test_the_guess_begins_at_the_present_speed_and_ends_at_rest():
    found = find(NOTHING, velocity=(0.3, 0.0), steps=100)
    speed = np.hypot(*np.diff(found.candidates[0].guess, axis=0).T) * 100
    assert speed[0] == pytest.approx(0.3, rel=0.02)
    assert speed[-1] < 0.01
    assert (np.diff(found.candidates[0].guess[:, 0]) > 0).all()


def test_each_goal_comes_in_and_of_very_many_the_nearest():
    obstacles = make_obstacles([[0.05, 0.01], [0.1, -0.01], [0.1, 0.03]], 0.01)
    goals = [[0.2, 0.0], [0.6, 0.1], [0.6, -0.3]]
    assert {one.goal for one in find(obstacles, goals=goals, k=3).candidates} == {0, 1, 2}
    assert [one.goal for one in find(obstacles, goals=goals, k=2).candidates] == [0, 1, 2]
    many = [[0.2 + 0.001 * i, 0.0] for i in range(70)]
    assert [one.goal for one in find(obstacles, goals=many, k=2).candidates] == list(range(64))


def test_a_wall_of_three_hundred_obstacles_is_noted():
    wall = np.column_stack([np.full(301, 0.15), np.linspace(-1.5, 1.5, 301)])
    found = find(make_obstacles(wall, 0.01))
    assert found.candidates == ()
    assert found.notes['no_way'] == 1 and found.notes['left_out'] > 0


def test_arguments_that_do_not_fit_are_named():
    settings = HomotopyConfig()
    with pytest.raises(SceneError, match='hand_mean'):
        search(np.zeros(2), np.array([[0.3, 0.0]]), NOTHING, settings, [1.0], 50)
    with pytest.raises(SceneError, match='duration_s: expected one for each of the 1 goals, got 2'):
        search(np.zeros(6), np.array([[0.3, 0.0]]), NOTHING, settings, [1.0, 1.0], 50)
