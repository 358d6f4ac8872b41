"""The outlines of obstacles, the visibility graph of many obstacles, what is kept between searches, and smooth guesses."""

import numpy as np
import pytest
from homotopy_scenes import CLEARANCE, GOAL, find, random_scene
from homotopy_shapes import random_shapes, turn

from foc_ros.core.classes import compute_swept_angles, scene
from foc_ros.core.classes.outlines import STAND_OUT, outline_obstacles
from foc_ros.core.config import HomotopyConfig
from foc_ros.core.deadline import NEVER
from foc_ros.core.obstacles.geometry import measure_offsets
from foc_ros.core.types import LEFT, make_obstacles

VELOCITY = np.array([0.1, 0.05])


def crowd(seed, n, size, wide):
    rng = np.random.default_rng(seed)
    centre = rng.uniform([-wide, -wide], [0.35 + wide, wide], (n, 2))
    radius = rng.uniform(0.3 * size, size, n)
    keep = np.all([np.hypot(*(centre - end).T) > radius + 0.006 for end in (np.zeros(2), GOAL)], axis=0)
    return make_obstacles(centre[keep], radius[keep])


def find_paths(obstacles, k=4):
    mean = np.array([0.0, 0.0, *VELOCITY, 0.0, 0.0])
    settings = HomotopyConfig(max_candidates=k, clearance=CLEARANCE)
    return list(scene.SearchScene(mean, GOAL[None], obstacles, settings, ()).find_classes(0, NEVER))


@pytest.mark.parametrize('seed', range(20))
def test_outlines_hold_their_shapes_and_stand_out_by_a_millimetre_at_most(seed):
    obstacles = random_shapes(np.random.default_rng(seed), 3)
    outlines = outline_obstacles(obstacles, obstacles.radius)
    for row, count in enumerate(outlines.count):
        _, distance = measure_offsets(outlines.vertices[row, :count], obstacles.take([row]))
        out = distance[:, 0] - obstacles.radius[row]
        assert (out > -2e-9).all() and (out < STAND_OUT + 1e-9).all()
        edges = (outlines.vertices[row, :count] + np.roll(outlines.vertices[row, :count], 1, axis=0)) / 2.0
        assert (measure_offsets(edges, obstacles.take([row]))[1] > obstacles.radius[row] - 2e-9).all()


@pytest.mark.parametrize('angle', np.linspace(0.0, np.pi, 9))
@pytest.mark.parametrize(('gap', 'through'), [(2 * CLEARANCE - 1e-5, False), (2 * CLEARANCE + 1e-5, True)])
def test_a_gap_in_any_direction_is_open_from_twice_the_clearance(angle, gap, through):
    apart = turn(np.array([[0.0, 0.03 + gap / 2]]), 0.8 * (angle - np.pi / 2))[0]
    obstacles = make_obstacles(np.array([0.17, 0.0]) + np.array([apart, -apart]), 0.03)
    sides = [tuple(side for _, side in one.sides) for one in find(obstacles, k=4).candidates]
    assert ((1, -1) in sides or (-1, 1) in sides) is through


def test_what_depends_on_the_obstacles_alone_is_kept_while_they_are_the_same():
    one, same, other = crowd(0, 12, 0.02, 0.15), crowd(0, 12, 0.02, 0.15), crowd(1, 12, 0.02, 0.15)
    kept = outline_obstacles(one, one.radius)
    assert outline_obstacles(same, same.radius) is kept
    assert outline_obstacles(other, other.radius) is not kept
    assert outline_obstacles(same, same.radius + 1e-3) is not kept


@pytest.mark.parametrize(('seed', 'n', 'size'), [(0, 6, 0.03), (1, 10, 0.03), (2, 12, 0.06), (3, 30, 0.03)])
def test_names_give_the_sides_on_which_the_paths_pass(seed, n, size):
    obstacles = crowd(seed, n, size, 0.15)
    found = find_paths(obstacles)
    assert len(found) > 3
    assert [one.key for one in found] == sorted(one.key for one in found)
    for one in found:
        share = np.linspace(0.0, 1.0, 200)[:-1, None]
        points = np.concatenate([a + share * (b - a) for a, b in zip(one.points, one.points[1:], strict=False)])
        angles = dict(zip(obstacles.ids, compute_swept_angles(np.vstack([points, GOAL]), obstacles.centre), strict=True))
        assert all((angles[name] < 0.0) == (side == LEFT) and abs(angles[name]) < 2.0 * np.pi for name, side in one.sides)
        assert (measure_offsets(points, obstacles)[1] - obstacles.radius - CLEARANCE).min() > -1e-8


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


@pytest.mark.parametrize(('rows', 'columns'), [(3, 6), (4, 5), (5, 5), (2, 9)])
def test_paths_of_equal_length_through_a_peg_board_are_distinct(rows, columns):
    pegs = [[0.05 * (1 + row), 0.05 * (column - (columns - 1) / 2)] for row in range(rows) for column in range(columns)]
    found = find(make_obstacles(pegs, 0.02), goals=[[0.3, 0.0]], k=4, clearance=0.005)
    labels = [one.label for one in found.candidates]
    assert len(labels) == len(set(labels)) > 0


@pytest.mark.parametrize('size', [0.0, 0.01, 0.05, 0.2])
def test_a_path_does_not_bend_aside_to_leave_along_the_velocity(size):
    # the obstacle lies beside the straight path, where the velocity points
    obstacles = make_obstacles([[0.05 + size, 0.06 + size]], 0.02 + size)
    for velocity in ((0.2, 0.1), (0.1, 0.3), (-0.1, 0.3)):
        assert min(one.length for one in find(obstacles, velocity=velocity).candidates) == pytest.approx(0.35)


@pytest.mark.parametrize('seed', range(30))
def test_guesses_are_as_smooth_as_hands_on_exact_paths(seed):
    rng = np.random.default_rng(seed)
    for one in find(random_scene(rng, int(rng.integers(1, 6))), steps=50).candidates:
        bend = np.hypot(*np.diff(one.guess, 2, axis=0).T).max() * 50**2
        # minimum jerk on a straight line has 5.8 L / T^2; a circle of radius r adds v^2 / r
        assert bend < 5.8 * one.length + 1.4 * (1.875 * one.length) ** 2 / 0.015
