# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The search for classes under a deadline: it returns what it has, goals take turns, and candidates of before stay."""

import numpy as np
from homotopy_scenes import CLEARANCE, find

from foc_ros.core.classes import Turn, search
from foc_ros.core.config import HomotopyConfig
from foc_ros.core.deadline import Deadline
from foc_ros.core.obstacle_table import make_obstacles

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
