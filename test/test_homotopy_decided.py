# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Candidates for hands and goals in margins, closed gaps, empty scenes and crowds."""

import numpy as np
import pytest
from homotopy_scenes import CLEARANCE, find
from hypothesis import given, settings
from hypothesis import strategies as st

from foc_ros.core.classes import Turn, find_path_sides, search
from foc_ros.core.config import HomotopyConfig
from foc_ros.core.deadline import Deadline
from foc_ros.core.obstacle_table import make_obstacles
from foc_ros.core.obstacles.risk import centre_trajectories
from foc_ros.core.solution import LEFT, RIGHT


def test_no_obstacles_one_straight_candidate_per_goal():
    found = find(make_obstacles(), goals=[[0.3, 0.0], [0.0, 0.2]])
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


def test_obstacles_out_of_the_way_have_no_part_in_the_name():
    out = [[-0.1, 0.0], [0.45, 0.0], [0.15, 0.9]]
    assert [one.label for one in find(make_obstacles(out, 0.02)).candidates] == ['goal0:']
    found = find(make_obstacles([*out, [0.15, 0.01]], 0.02))
    assert [one.label for one in found.candidates] == ['goal0:-3', 'goal0:+3']


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
    detour = 0.97 * before.length / shortest[before.goal]
    near = find(obstacles, goals=[[0.1, 0.0], [0.2, 0.0]], detour=detour, previous=(before,))
    assert before.label in [one.label for one in near.candidates], 'a class that was followed stays a little longer'


def test_a_way_that_is_followed_to_one_goal_is_followed_unless_its_own_goal_has_no_candidate():
    obstacles, goals = make_obstacles([[0.1, 0.0]], 0.03), [[0.3, 0.01], [0.3, -0.01]]
    whole, few, one = (find(obstacles, goals=goals, k=count) for count in (4, 2, 1))
    assert [len(each.candidates) for each in (whole, few, one)] == [4, 2, 2] and not whole.unfollowed
    assert {each.label for each in few.candidates} == {'goal0:+0', 'goal1:-0'} and not few.unfollowed
    three = find(obstacles, goals=[*goals, [0.3, 0.012]], k=3)
    assert {each.label for each in three.candidates} == {'goal0:+0', 'goal1:-0', 'goal2:+0'} and not three.unfollowed
    beside = find(obstacles, goals=[[0.3, 0.01], [0.3, 0.02]], k=2)
    assert {each.label for each in beside.candidates} == {'goal0:+0', 'goal1:+0'}
    assert {each.label for each in beside.unfollowed} == {'goal0:-0', 'goal1:-0'}


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


@pytest.mark.parametrize('end', [-0.15, -0.05, 0.05, 0.15])
def test_a_moving_obstacle_has_two_classes_which_pass_it_on_both_sides_when_the_hand_is_there(end):
    """The post crosses the straight line from the left, and is at `end` when the hand has gone half of the way."""
    post = make_obstacles([[0.5, 0.4]], 0.1, ids=('post',), velocity=[[0.0, (end - 0.4) / 0.5]])
    found = search(np.zeros(6), np.array([[1.0, 0.0]]), post, HomotopyConfig(), [1.0], 50).candidates
    assert sorted(dict(each.sides)['post'] for each in found) == [RIGHT, LEFT]
    for each in found:
        centres = centre_trajectories(post.centre, post.velocity / 50, 50)
        abreast = np.abs(each.guess[:, 0] - 0.5).argmin()
        assert (each.guess[abreast, 1] > centres[abreast, 0, 1]) == (dict(each.sides)['post'] == LEFT)
        assert find_path_sides(each.guess, post, centres) == dict(each.sides)


@settings(max_examples=80, deadline=None, derandomize=True)
@given(st.floats(-0.9, 0.9), st.floats(-3.0, 3.0), st.floats(0.05, 0.95), st.floats(-0.8, 0.8))
def test_a_bowed_path_passes_what_is_beside_it_and_not_what_is_behind_its_start_or_beyond_its_end(amplitude, angle, x, y):
    share = np.linspace(0.0, 1.0, 400)
    path = np.column_stack([share, amplitude * np.sin(np.pi * share)])
    height = amplitude * np.sin(np.pi * x)
    if abs(y - height) < 1e-3:
        return
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    obstacles = make_obstacles(np.array([[x, y], [-0.1, 0.05], [1.2, 0.0]]) @ turn.T, 0.01)
    assert find_path_sides(path @ turn.T, obstacles) == {'0': LEFT if height > y else RIGHT}


GOALS = np.column_stack([np.full(6, 0.4), np.linspace(-0.2, 0.2, 6)])
CROWD = np.random.default_rng(2).uniform([0.05, -0.2], [0.35, 0.2], (40, 2))


def search_within(seconds, obstacles, goals=GOALS, previous=(), first_goal=0, k=6, hand=(0.0, 0.0)):
    settings = HomotopyConfig(max_candidates=k, clearance=CLEARANCE)
    turn = Turn(Deadline(seconds), first_goal)
    return search(np.array([*hand, 0.0, 0.0, 0.0, 0.0]), goals, obstacles, settings, [1.0] * len(goals), 20, previous, turn)


def test_without_time_each_goal_has_a_candidate_at_once_and_one_goal_after_the_other_is_searched_again():
    obstacles, next_goals, previous, goal = make_obstacles(CROWD[:12], 0.012), [], (), 0
    for _ in range(7):
        found = search_within(-1.0, obstacles, previous=previous, first_goal=goal)
        searched = len({id(each) for each in found.candidates} - {id(each) for each in previous})
        assert searched == (1 if previous else 6), 'the others are as they were'
        previous, goal = found.candidates, found.next_goal
        next_goals.append(goal)
        assert {each.goal for each in previous} == set(range(6))
    assert next_goals == [0, 1, 2, 3, 4, 5, 0]


def test_without_time_previous_candidates_stay_unless_their_obstacles_or_goals_are_gone():
    before = find(make_obstacles(CROWD[:4], 0.02), GOALS, k=12).candidates
    assert {each.goal for each in before} == set(range(6))
    same = search_within(-1.0, make_obstacles(CROWD[:4], 0.02), previous=before, k=12)
    assert {each.label for each in same.candidates} >= {each.label for each in before if each.goal}
    fewer = search_within(-1.0, make_obstacles(CROWD[:4], 0.02), goals=GOALS[:3], previous=before, k=12)
    assert {each.goal for each in fewer.candidates} == {0, 1, 2}
    without = search_within(-1.0, make_obstacles(CROWD[1:4], 0.02, ids=('1', '2', '3')), previous=before, k=12)
    assert not any(identity == '0' for each in without.candidates for identity, _ in each.sides)
