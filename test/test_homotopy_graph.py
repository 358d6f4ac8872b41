"""The tangent graph and the search over it: closed forms, signatures, and crowds in which the graph holds some of the circles."""

from collections import Counter
from itertools import chain

import numpy as np
import pytest
from homotopy_scenes import GOAL, find

from foc_ros.core.homotopy import class_search, compute_swept_angles
from foc_ros.core.homotopy.guesses import lay_out
from foc_ros.core.homotopy.path_search import PathQuery, find_shortest_paths
from foc_ros.core.homotopy.search_scene import build_search_scene
from foc_ros.core.homotopy.tangent_graph import build_tangent_graph, connect_hand
from foc_ros.core.types import make_obstacles

VELOCITY = np.array([0.1, 0.05])


def crowd(seed, n, size, wide):
    rng = np.random.default_rng(seed)
    centre = rng.uniform([-wide, -wide], [0.35 + wide, wide], (n, 2))
    radius = rng.uniform(0.3 * size, size, n)
    keep = np.all([np.hypot(*(centre - end).T) > radius + 0.006 for end in (np.zeros(2), GOAL)], axis=0)
    return make_obstacles(centre[keep], radius[keep])


@pytest.mark.parametrize('seed', range(8))
@pytest.mark.parametrize(('n', 'size', 'wide'), [(30, 0.03, 0.15), (60, 0.01, 0.2), (40, 0.03, 0.8)])
def test_a_graph_of_some_circles_gives_the_candidates_of_a_graph_of_all(monkeypatch, seed, n, size, wide):
    obstacles = crowd(seed, n, size, wide)
    partial = find(obstacles, velocity=VELOCITY)
    monkeypatch.setattr(class_search, 'FEW', 1000)
    monkeypatch.setattr(class_search, 'MOST', 1000)
    complete = find(obstacles, velocity=VELOCITY)
    assert [a.label for a in partial.candidates] == [b.label for b in complete.candidates]
    assert [a.length for a in partial.candidates] == pytest.approx([b.length for b in complete.candidates], rel=1e-9)


def test_an_obstacle_that_a_path_meets_enters_the_graph():
    # a screen beside the hand blocks the path round the one obstacle in front; it is behind the hand, so no name contains it
    screen = [[-0.012, 0.02 + 0.02 * k] for k in range(20)]
    obstacles = make_obstacles([[0.1, 0.0], *screen], [0.05] + [0.012] * 20)
    found = find(obstacles)
    assert {one.label for one in found.candidates} == {'goal0:+0', 'goal0:-0'}
    for one in found.candidates:
        apart = np.hypot(*(one.guess[:, None] - obstacles.centre).transpose(2, 0, 1)) - obstacles.radius - 0.005
        assert apart.min() > -1e-6


def test_graph_of_two_circles_in_closed_form():
    graph = build_tangent_graph(np.array([[0.0, 0.0], [1.0, 0.0]]), np.array([0.3, 0.1]), np.array([[3.0, 0.0]]))
    head, length = graph.runs.head, graph.runs.length
    outer, inner = np.sqrt(1.0 - 0.2**2), np.sqrt(1.0 - 0.4**2)
    assert sorted(length[head < 4]) == pytest.approx([inner] * 4 + [outer] * 4)
    # the second circle is smaller, so it blocks none of the tangents from the first one
    assert sorted(length[head == 5]) == pytest.approx(sorted([np.sqrt(4.0 - 0.01)] * 2 + [np.sqrt(9.0 - 0.09)] * 2))


def search_paths(obstacles, max_states=5000):
    """The graph of all obstacles, and the paths over it in the order of their keys."""
    scene = build_search_scene(np.zeros(2), GOAL[None], obstacles, 0.0, ())
    graph, notes = connect_hand(build_tangent_graph(obstacles.centre, scene.radius[0], GOAL[None]), np.zeros(2)), Counter()
    named = np.arange(len(obstacles))
    query = PathQuery(0, VELOCITY, named, scene.bearing_change[0], True, np.inf, max_states, 1 << len(named))
    return graph, chain.from_iterable(find_shortest_paths(graph, query, 4, notes)), notes


@pytest.mark.parametrize(('seed', 'n', 'size'), [(0, 6, 0.03), (1, 10, 0.03), (2, 12, 0.06), (3, 30, 0.03)])
def test_signatures_give_the_angles_that_the_paths_sweep(seed, n, size):
    obstacles = crowd(seed, n, size, 0.15)
    graph, paths, _ = search_paths(obstacles, 400)
    found = list(paths)
    assert len(found) > 5
    assert [one.key for one in found] == sorted(one.key for one in found)
    for one in found:
        points = lay_out(graph, one.runs).space_points(2000)
        assert one.swept == pytest.approx(compute_swept_angles(points, obstacles.centre).tolist(), abs=1e-9)
        assert max(map(abs, one.swept)) < 2.0 * np.pi


def test_the_search_ends_at_the_largest_number_of_states_and_says_so():
    obstacles = crowd(3, 30, 0.03, 0.15)
    _, paths, notes = search_paths(obstacles, 20)
    few = list(paths)
    assert notes == {'search_cut': 1}
    _, paths, notes = search_paths(obstacles)
    assert [one.key for one in few] == [next(paths).key for _ in few]


@pytest.mark.parametrize(('rows', 'columns'), [(3, 6), (4, 5), (5, 5), (2, 9)])
def test_paths_of_equal_length_through_a_peg_board_are_distinct(rows, columns):
    pegs = [[0.05 * (1 + row), 0.05 * (column - (columns - 1) / 2)] for row in range(rows) for column in range(columns)]
    found = find(make_obstacles(pegs, 0.02), goals=[[0.3, 0.0]], k=4, clearance=0.005)
    labels = [one.label for one in found.candidates]
    assert len(labels) == len(set(labels)) > 0
