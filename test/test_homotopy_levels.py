"""Narrowing many obstacles down gives the answer of looking at all of them."""

import numpy as np
import pytest
from homotopy_scenes import GOAL, find

from foc_ros.core.homotopy import classes, levels, roadmap
from foc_ros.core.homotopy.tangents import LENGTH
from foc_ros.core.homotopy.ways import shortest_ways
from foc_ros.core.types import make_obstacles


def crowd(seed, n, size, wide):
    rng = np.random.default_rng(seed)
    centre = rng.uniform([-wide, -wide], [0.35 + wide, wide], (n, 2))
    radius = rng.uniform(0.3 * size, size, n)
    keep = np.all([np.hypot(*(centre - end).T) > radius + 0.006 for end in (np.zeros(2), GOAL)], axis=0)
    return make_obstacles(centre[keep], radius[keep])


@pytest.mark.parametrize('seed', range(8))
@pytest.mark.parametrize(('n', 'size', 'wide'), [(30, 0.03, 0.15), (60, 0.01, 0.2), (40, 0.03, 0.8)])
def test_narrowed_down_or_not(monkeypatch, seed, n, size, wide):
    obstacles = crowd(seed, n, size, wide)
    narrow = find(obstacles, velocity=(0.1, 0.05))
    monkeypatch.setattr(levels, 'FEW', 1000)
    monkeypatch.setattr(levels, 'MOST', 1000)
    monkeypatch.setattr(classes, 'MOST', 1000)
    everything = find(obstacles, velocity=(0.1, 0.05))
    assert [a.label for a in narrow.candidates] == [b.label for b in everything.candidates]
    assert [a.length for a in narrow.candidates] == pytest.approx([b.length for b in everything.candidates], rel=1e-9)


def test_a_way_that_meets_an_obstacle_left_aside_takes_it_in():
    # a screen beside the hand blocks the way round the one obstacle in front; all of it is behind the hand, so it has no name
    screen = [[-0.012, 0.02 + 0.02 * k] for k in range(20)]
    obstacles = make_obstacles([[0.1, 0.0], *screen], [0.05] + [0.012] * 20)
    found = find(obstacles)
    assert {one.label for one in found.candidates} == {'goal0:+0', 'goal0:-0'}
    for one in found.candidates:
        apart = np.hypot(*(one.guess[:, None] - obstacles.centre).transpose(2, 0, 1)) - obstacles.radius - 0.005
        assert apart.min() > -1e-6


def test_roadmap_of_two_circles_in_closed_form():
    field = roadmap.roadmap(np.array([0.0 + 0.0j, 1.0 + 0.0j]), np.array([0.3, 0.1]), np.array([3.0 + 0.0j]))
    between = np.flatnonzero(field.runs.head < 4)
    outer, inner = np.sqrt(1.0 - 0.2**2), np.sqrt(1.0 - 0.4**2)
    length = field.runs.spans[:, LENGTH]
    assert sorted(length[between]) == pytest.approx([inner] * 4 + [outer] * 4)
    to_goal = np.flatnonzero(field.runs.head == 2 * 2 + 1)
    # the second circle is smaller: it is in the way of neither tangent from the first one
    assert sorted(length[to_goal]) == pytest.approx(sorted([np.sqrt(4.0 - 0.01)] * 2 + [np.sqrt(9.0 - 0.09)] * 2))


@pytest.mark.parametrize('most', [1, 3, 11])
def test_of_more_ways_the_first_are_those_that_fewer_would_have_been(most):
    obstacles = crowd(3, 30, 0.03, 0.15)
    centre, goal = obstacles.centre.view(complex)[:, 0], complex(*GOAL)
    field, turned = roadmap.roadmap(centre, obstacles.radius, np.array([goal])), np.angle(goal - centre) - np.angle(-centre)
    asked = *field.circles, *field.runs, 0.0j, 0.1 + 0.0j, 0, np.arange(len(centre)), turned, True, np.inf
    keys, _, pieces, ends, cut = shortest_ways(*asked, 5000, 12)
    few, _, laid, stops, _ = shortest_ways(*asked, 5000, most)
    assert not cut and len(keys) == 12 and (keys == np.sort(keys)).all()
    assert (few == keys[:most]).all() and (stops == ends[:most]).all() and (laid == pieces[: stops[-1]]).all()
    keys, *_, cut = shortest_ways(*asked, 20, 12)
    assert cut and len(keys) < 12


@pytest.mark.parametrize(('rows', 'columns'), [(3, 6), (4, 5), (5, 5), (2, 9)])
def test_a_peg_board_has_ways_of_equal_length_and_no_trouble_with_them(rows, columns):
    pegs = [[0.05 * (1 + row), 0.05 * (column - (columns - 1) / 2)] for row in range(rows) for column in range(columns)]
    found = find(make_obstacles(pegs, 0.02), goals=[[0.3, 0.0]], k=4, clearance=0.005)
    labels = [one.label for one in found.candidates]
    assert len(labels) == len(set(labels)) > 0
