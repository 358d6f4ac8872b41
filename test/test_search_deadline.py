"""The search for classes under a deadline: it returns what it has, goals take turns, and steady candidates stay."""

import numpy as np
import pytest
from homotopy_scenes import CLEARANCE, find, random_scene

from foc_ros.core.classes import Turn, search
from foc_ros.core.config import HomotopyConfig
from foc_ros.core.deadline import Deadline
from foc_ros.core.types import make_obstacles

GOALS = np.column_stack([np.full(6, 0.4), np.linspace(-0.2, 0.2, 6)])
CROWD = np.random.default_rng(2).uniform([0.05, -0.2], [0.35, 0.2], (40, 2))


def search_within(seconds, obstacles, goals=GOALS, previous=(), first_goal=0, k=6, hand=(0.0, 0.0)):
    settings = HomotopyConfig(max_candidates=k, clearance=CLEARANCE)
    turn = Turn(Deadline(seconds), first_goal)
    return search(np.array([*hand, 0.0, 0.0, 0.0, 0.0]), goals, obstacles, settings, [1.0] * len(goals), 20, previous, turn)


def describe(found):
    return [(each.label, each.length) for each in found.candidates]


@pytest.mark.parametrize('obstacles', [make_obstacles(CROWD, 0.012), make_obstacles(CROWD[:5], 0.02)], ids=['crowd', 'few'])
def test_a_deadline_that_is_not_reached_changes_nothing(obstacles):
    free = find(obstacles, GOALS, steps=20)
    timed = search_within(60.0, obstacles)
    assert describe(timed) == describe(free)
    assert (timed.notes, timed.next_goal) == (free.notes, 0)


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


def test_the_first_class_to_each_goal_is_found_whatever_the_time():
    for seed in range(5):
        obstacles, goals = random_scene(np.random.default_rng(seed), 8), np.array([[0.35, 0.0], [0.34, 0.2], [0.1, -0.3]])
        found = search_within(-1.0, obstacles, goals=goals)
        for goal in range(3):
            best = find(obstacles, goals[goal], steps=20, k=1).candidates[0]
            assert (best.label[6:], best.length) in [
                (each.label[6:], each.length) for each in found.candidates if each.goal == goal
            ]


def test_the_number_of_candidates_is_bounded_without_time_too():
    goals = np.column_stack([np.full(64, 0.4), np.linspace(-0.2, 0.2, 64)])
    previous, goal = (), 0
    for _ in range(70):
        found = search_within(-1.0, make_obstacles(CROWD[:3], 0.02), goals, previous, goal, k=16)
        previous, goal = found.candidates, found.next_goal
        assert len(previous) <= 64
        assert len({each.label for each in previous}) == len(previous)
    assert {each.goal for each in previous} == set(range(64))


def test_the_best_class_of_a_goal_stays_under_noise_where_each_goal_has_one():
    """Two goals behind one obstacle each, and room for two candidates: noise swaps the sides without memory, not with it."""
    goals, centre, rng = np.array([[0.3, 0.1], [0.3, -0.1]]), np.array([[0.15, 0.05], [0.15, -0.05]]), np.random.default_rng(4)
    changes = {}
    for remember in (False, True):
        previous, last, changes[remember] = (), None, 0
        for _ in range(200):
            found = find(make_obstacles(centre, 0.02), goals, rng.normal(0.0, 0.0005, 2), k=2, steps=20, previous=previous)
            labels = {each.label for each in found.candidates}
            changes[remember] += last is not None and labels != last
            previous, last = found.candidates if remember else (), labels
    assert changes[False] > 20, 'the scene is no test'
    assert changes[True] == 0


def test_a_much_better_class_takes_the_place_of_the_best_one_of_before():
    goals = np.array([[0.3, 0.0]])
    before = find(make_obstacles([[0.15, 0.03]], 0.05), goals, k=1)
    after = find(make_obstacles([[0.15, -0.03]], 0.05), goals, k=1, previous=before.candidates)
    assert {each.label for each in before.candidates} != {each.label for each in after.candidates}
