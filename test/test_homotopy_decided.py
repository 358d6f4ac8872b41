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


def test_an_obstacle_that_holds_a_goal_does_not_block_the_paths_to_it_but_those_to_others():
    obstacles = make_obstacles([[0.3, 0.01], [0.15, 0.0]], 0.03, ids=('bin', 'post'))
    found = find(obstacles, goals=[[0.3, 0.0], [0.4, 0.0]], k=16)
    assert {one.label for one in found.candidates if one.goal == 0} == {'goal0:+post', 'goal0:-post'}
    assert {len(one.sides) for one in found.candidates if one.goal == 1} == {2}
    assert found.notes == {'goal_inside': 1}
    for one in found.candidates:
        rows = [0, 1] if one.goal else [1]
        assert gap_to_circles(one.guess, obstacles.take(rows)) > -1e-9
        np.testing.assert_allclose(one.guess[-1], [[0.3, 0.0], [0.4, 0.0]][one.goal], atol=1e-12)


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


def test_a_turn_back_is_found_but_ranks_late():
    obstacles = make_obstacles([[0.15, 0.01]], 0.03)
    assert find(obstacles).candidates[0].label == 'goal0:-0'
    turned = find(obstacles, velocity=(0.1, 0.5))
    assert [one.label for one in turned.candidates] == ['goal0:+0', 'goal0:-0']
    assert turned.candidates[0].length > turned.candidates[1].length


def test_long_detours_are_seen_and_not_followed_but_of_each_goal_the_shortest_way_is():
    obstacles = make_obstacles([[0.05, 0.0], [0.15, 0.0]], 0.03)
    whole, few = (find(obstacles, goals=[[0.1, 0.0], [0.2, 0.0]], detour=each) for each in (1e6, 1.1))
    assert {one.goal for one in few.candidates} == {0, 1} and not whole.unfollowed
    shortest = {goal: min(one.length for one in whole.candidates if one.goal == goal) for goal in (0, 1)}
    within = [one.label for one in whole.candidates if one.length <= 1.1 * shortest[one.goal]]
    assert [one.label for one in few.candidates] == within and 2 < len(within) < len(whole.candidates)
    left_out = {one.label for one in whole.candidates} - set(within)
    assert {one.label for one in few.unfollowed} & left_out
    before = next(one for one in whole.candidates if one.length > 1.1 * shortest[one.goal])
    near = find(
        obstacles, goals=[[0.1, 0.0], [0.2, 0.0]], detour=0.97 * before.length / shortest[before.goal], previous=(before,)
    )
    assert before.label in [one.label for one in near.candidates], 'a class that was followed stays a little longer'


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
