# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Homotopy classes: brute force, invariances, walls, hands and goals in margins, closed gaps, many goals, and no time."""

from itertools import pairwise

import numpy as np
import pytest
from homotopy_scenes import CLEARANCE, GOAL, HAND, find, measure_clear, random_shapes, shortest_by_pattern, turn
from hypothesis import given, settings
from hypothesis import strategies as st

from foc_ros.core.classes import SearchOrder, find_path_sides, scene, search
from foc_ros.core.config import HomotopyConfig
from foc_ros.core.deadline import Deadline
from foc_ros.core.obstacle_table import make_obstacles
from foc_ros.core.obstacles.risk import centre_trajectories
from foc_ros.core.obstacles.shapes import make_box_polygon
from foc_ros.core.solution import LEFT, RIGHT

BEST = 16
"""Number of classes to compare: the longest of 32 wind about obstacles, where limits of winding count."""
TOLERANCE = 0.01
"""Lengths may be this much above those of the shortest paths, as outlines stand out of their shapes."""


def make_scene(seed):
    rng = np.random.default_rng(seed)
    return random_shapes(rng, int(rng.integers(1, 6)), may_overlap=seed % 3 == 0)


def compare(obstacles, seed, clearance):
    found, every = find(obstacles, k=BEST, clearance=clearance), shortest_by_pattern(obstacles, clearance=clearance)
    named = [row for row, name in enumerate(obstacles.ids) if any(name == each for each, _ in found.candidates[0].sides)]
    expected = {}
    for pattern, length in every.items():
        course = tuple((obstacles.ids[row], pattern[row]) for row in named)
        expected[course] = min(expected.get(course, np.inf), length)
    ours = {one.sides: one.length for one in found.candidates}
    assert len(ours) == len(found.candidates), f'scene {seed}: a class twice'
    assert len(ours) == min(BEST, len(expected)), f'scene {seed}'
    assert list(ours.values()) == sorted(ours.values()), f'scene {seed}: not in order'
    longest = max(ours.values())
    missed = [sides for sides, length in expected.items() if sides not in ours and length < (1 - TOLERANCE) * longest]
    assert not missed, f'scene {seed}: missed {missed}'
    for sides, length in ours.items():
        assert expected[sides] * (1 - 1e-3) <= length <= expected[sides] * (1 + TOLERANCE), f'scene {seed}: {sides}'


def make_aligned_scene(seed):
    """Upright boxes and capsules on a grid of a centimetre, so that edges lie on one line and shapes share corners."""
    rng = np.random.default_rng(seed)
    n = int(rng.integers(1, 6))
    while True:
        centre = 0.01 * np.column_stack([rng.integers(5, 31, n), rng.integers(-6, 7, n)])
        polygons = [make_box_polygon(size, 0.0) for size in 0.02 * rng.integers(0, 5, (n, 2))]
        radius = [0.01 if len(polygon) < 3 else rng.choice([0.0, 0.006]) for polygon in polygons]
        obstacles = make_obstacles(centre, radius, polygons=polygons)
        if measure_clear(np.array([HAND, GOAL]), obstacles, 0.006) > 0.0:
            return obstacles


@pytest.mark.parametrize(('make', 'clearance'), [(make_scene, CLEARANCE), (make_aligned_scene, 0.0041)])
def test_brute_force_finds_no_class_that_the_search_misses(make, clearance):
    for seed in range(15):
        compare(make(seed), seed, clearance)


def summarise(found):
    return [(one.label, round(one.length, 9)) for one in found.candidates]


@pytest.mark.parametrize('seed', range(10))
def test_turned_and_shifted_scenes_and_other_orders_have_the_same_classes(seed):
    obstacles, rng = make_scene(seed), np.random.default_rng(seed)
    order = rng.permutation(len(obstacles))
    assert summarise(find(obstacles)) == summarise(find(obstacles)) == summarise(find(obstacles.take(order)))
    angle, shift, velocity = rng.uniform(-np.pi, np.pi), rng.uniform(-2, 2, 2), np.array([0.2, 0.1])
    polygons = [turn(row[:corners], angle) for row, corners in zip(obstacles.vertices, obstacles.corners, strict=True)]
    moved = make_obstacles(turn(obstacles.centre, angle) + shift, obstacles.radius, ids=obstacles.ids, polygons=polygons)
    one = find(obstacles, velocity=velocity)
    other = find(moved, turn(GOAL[None], angle) + shift, shift, turn(velocity[None], angle)[0])
    assert [a.label for a in one.candidates] == [b.label for b in other.candidates]
    for a, b in zip(one.candidates, other.candidates, strict=True):
        # the outlines of circles do not turn with the scene
        np.testing.assert_allclose(turn(a.guess, angle) + shift, b.guess, atol=2e-3)


@pytest.mark.parametrize('seed', range(15))
def test_guesses_are_clear_and_pass_as_their_names_say(seed):
    obstacles = make_scene(seed)
    for one in find(obstacles, steps=300).candidates:
        np.testing.assert_allclose(one.guess[[0, -1]], [HAND, GOAL], atol=1e-12)
        assert measure_clear(one.guess, obstacles) > -1e-9
        assert dict(one.sides).items() <= find_path_sides(one.guess, obstacles).items()
        assert np.hypot(*np.diff(one.guess, axis=0).T).sum() == pytest.approx(one.length, rel=0.02)


WALLS = [make_box_polygon(size, 0.0) for size in ((0.6, 0.02), (0.6, 0.02), (0.02, 0.32), (0.02, 0.32))]
WALL_CENTRES = [[0.175, 0.15], [0.175, -0.15], [-0.115, 0.0], [0.465, 0.0]]


@pytest.mark.parametrize('yaw', [0.0, 0.2])
def test_in_a_closed_workspace_all_ways_stay_inside(yaw):
    boxes = [*WALLS, make_box_polygon((0.05, 0.08), 0.4)]
    centre = turn(np.array([*WALL_CENTRES, [0.17, 0.01]]), yaw)
    obstacles = make_obstacles(centre, 0.0, ids=('n', 's', 'w', 'e', 'box'), polygons=[turn(box, yaw) for box in boxes])
    found = find(obstacles, turn(GOAL[None], yaw), k=8)
    assert len(found.candidates) == 2 and not found.notes
    assert {dict(one.sides)['box'] for one in found.candidates} == {1, -1}
    for one in found.candidates:
        assert measure_clear(one.guess, obstacles) > -1e-9
        inside = np.abs(turn(one.guess, -yaw) - [0.175, 0.0])
        assert (inside < [0.28, 0.14]).all()
    assert find(obstacles, turn(np.array([[0.7, 0.0]]), yaw)).notes['no_way'] == 1


@pytest.mark.parametrize('centre', [(0.033, 0.0), (0.028, 0.004), (0.01, 0.002), (0.02, -0.01)])
def test_a_hand_in_a_box_or_in_its_margin_gets_out_on_both_sides(centre):
    obstacles = make_obstacles([centre], 0.0, polygons=[make_box_polygon((0.06, 0.04), 0.1)])
    found = find(obstacles)
    assert found.notes == {'hand_inside': 1}
    assert {one.label for one in found.candidates} == {'goal0:+0', 'goal0:-0'}
    depth = -measure_clear(HAND[None], obstacles)
    for one in found.candidates:
        assert dict(one.sides).items() <= find_path_sides(one.guess, obstacles).items()
        assert measure_clear(one.guess, obstacles) >= -1.05 * depth


def test_a_goal_in_a_box_is_reached_and_so_is_one_in_its_margin():
    box = make_box_polygon((0.04, 0.04), 0.3)
    inside = find(make_obstacles([GOAL + 0.01], 0.0, polygons=[box]))
    assert [one.label for one in inside.candidates] == ['goal0:'] and inside.notes == {'goal_inside': 1}
    assert inside.candidates[0].length == pytest.approx(GOAL[0])
    obstacles = make_obstacles([GOAL + np.array([0.0, 0.025])], 0.0, polygons=[make_box_polygon((0.04, 0.04), 0.0)])
    near = find(obstacles, clearance=0.01)
    assert near.notes == {'goal_near': 1} and near.candidates
    assert all(measure_clear(one.guess, obstacles, 0.0) > 0.0 for one in near.candidates)


def test_a_gap_that_was_taken_stays_open_while_it_is_a_little_too_narrow():
    y = 0.03 + CLEARANCE
    boxes = [make_box_polygon((0.04, 0.06), 0.0)] * 2
    before = find(make_obstacles([[0.15, y + 1e-4], [0.15, -y]], 0.0, polygons=boxes), k=3)
    narrow = make_obstacles([[0.15, y - 2e-3], [0.15, -y]], 0.0, polygons=boxes)
    assert {'0': -1, '1': 1} not in [dict(one.sides) for one in find(narrow, k=3).candidates]
    assert {'0': -1, '1': 1} in [dict(one.sides) for one in find(narrow, k=3, previous=before.candidates).candidates]


@pytest.mark.parametrize('angle', np.linspace(0.0, np.pi, 5))
@pytest.mark.parametrize(('gap', 'through'), [(2 * CLEARANCE - 1e-5, False), (2 * CLEARANCE + 1e-5, True)])
def test_a_gap_in_any_direction_is_open_from_twice_the_clearance(angle, gap, through):
    apart = turn(np.array([[0.0, 0.03 + gap / 2]]), 0.8 * (angle - np.pi / 2))[0]
    obstacles = make_obstacles(np.array([0.17, 0.0]) + np.array([apart, -apart]), 0.03)
    sides = [tuple(side for _, side in one.sides) for one in find(obstacles, k=4).candidates]
    assert ((1, -1) in sides or (-1, 1) in sides) is through


def test_the_search_ends_at_the_largest_number_of_states_and_says_so(monkeypatch):
    obstacles = make_obstacles(np.random.default_rng(3).uniform([0.05, -0.15], [0.3, 0.15], (20, 2)), 0.015)
    whole = find(obstacles, k=32)
    monkeypatch.setattr(scene, 'STATES', 100)
    monkeypatch.setattr(scene, 'STATES_PER_CANDIDATE', 0)
    few = find(obstacles, k=32)
    assert few.notes == {'search_cut': 1} and 0 < len(few.candidates) < len(whole.candidates)
    assert [one.label for one in few.candidates] == [one.label for one in whole.candidates][: len(few.candidates)]


def count_changes(centre, radius, k, remember):
    """How often the set of labels changes under 1 mm of noise on hand and obstacles."""
    rng, previous, seen = np.random.default_rng(5), (), []
    for _ in range(60):
        obstacles = make_obstacles(centre + rng.normal(0.0, 0.001, np.shape(centre)), radius)
        hand, velocity = rng.normal(0.0, 0.001, 2), rng.normal(0.0, 0.02, 2)
        found = find(obstacles, (0.3, 0.0), hand, velocity, k=k, previous=previous)
        previous = found.candidates if remember else ()
        seen.append({one.label for one in found.candidates})
    return sum(one != other for one, other in pairwise(seen))


@pytest.mark.parametrize(
    ('centre', 'radius', 'k'),
    [
        pytest.param([(0.0, 0.05), (0.15, 0.0)], 0.02, 4, id='obstacle abeam of the hand'),
        pytest.param([(0.15, 0.035), (0.15, -0.035)], 0.03, 4, id='gap about to close'),
        pytest.param([(0.08, 0.0), (0.15, 0.0), (0.22, 0.0)], 0.02, 3, id='room for one of two equally long classes'),
    ],
)
def test_candidates_stay_under_noise(centre, radius, k):
    assert count_changes(centre, radius, k, remember=False) > 15, 'the scene is no test'
    assert count_changes(centre, radius, k, remember=True) <= 3


def test_a_clearly_better_class_replaces_one_that_was_there():
    centre, radius = np.array([[0.1, 0.0], [0.2, 0.05], [0.2, -0.05]]), 0.02
    before = find(make_obstacles(centre, radius), (0.3, 0.0), k=2)
    moved = make_obstacles(centre + np.array([0.0, 0.06]), radius)
    after = find(moved, (0.3, 0.0), k=2, previous=before.candidates)
    fresh = find(moved, (0.3, 0.0), k=2)
    assert {one.label for one in after.candidates} == {one.label for one in fresh.candidates}


def test_obstacle_exactly_on_the_line_is_passed_on_both_sides_the_same():
    left, right = find(make_obstacles([[0.15, 0.0]], 0.03)).candidates
    assert (left.label, right.label) == ('goal0:+0', 'goal0:-0')
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


SIX_GOALS = np.column_stack([np.full(6, 0.4), np.linspace(-0.2, 0.2, 6)])
CROWD = np.random.default_rng(2).uniform([0.05, -0.2], [0.35, 0.2], (40, 2))


def search_within(seconds, obstacles, goals=SIX_GOALS, previous=(), first_goal=0, k=6):
    settings = HomotopyConfig(max_candidates=k, clearance=CLEARANCE)
    order = SearchOrder(Deadline(seconds), first_goal)
    return search(np.zeros(6), goals, obstacles, settings, [1.0] * len(goals), 20, previous, order)


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


def test_without_time_there_are_a_few_classes_more_and_they_do_not_become_more():
    counts, previous, goal = [], (), 0
    for _ in range(7):
        found = search_within(-1.0, make_obstacles(CROWD[:12], 0.012), previous=previous, first_goal=goal, k=24)
        previous, goal = found.candidates, found.next_goal
        counts.append(len(previous))
    assert counts == [10] * 7


def test_without_time_previous_candidates_stay_unless_their_obstacles_or_goals_are_gone():
    before = find(make_obstacles(CROWD[:4], 0.02), SIX_GOALS, k=12, steps=20).candidates
    assert {each.goal for each in before} == set(range(6))
    same = search_within(-1.0, make_obstacles(CROWD[:4], 0.02), previous=before, k=12)
    assert {each.label for each in same.candidates} >= {each.label for each in before if each.goal}
    fewer = search_within(-1.0, make_obstacles(CROWD[:4], 0.02), goals=SIX_GOALS[:3], previous=before, k=12)
    assert {each.goal for each in fewer.candidates} == {0, 1, 2}
    without = search_within(-1.0, make_obstacles(CROWD[1:4], 0.02, ids=('1', '2', '3')), previous=before, k=12)
    assert not any(identity == '0' for each in without.candidates for identity, _ in each.sides)
