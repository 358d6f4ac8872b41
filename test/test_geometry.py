# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Convex polygons against brute force: the nearest point, its side and its normal; and what shapes refuse."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from foc_ros.core.errors import SceneError
from foc_ros.core.obstacle_table import make_obstacles, tabulate_edges
from foc_ros.core.obstacles.geometry import SMALLEST_DISTANCE, find_limits, find_offset, measure_offsets, trace_obstacle
from foc_ros.core.obstacles.shapes import Box, Capsule, Circle, Hull, collect_obstacles, make_box_polygon, make_hull_polygon

SEEDS = st.integers(0, 10_000)
MANY = settings(max_examples=100, deadline=None, derandomize=True)
FINE = 20_001
"""Points on each edge in the brute-force search for the nearest one."""


def random_polygon(generator):
    """Return one vertex, two, a box at any angle, or the hull of some points, with its centre elsewhere than at zero."""
    kind = generator.integers(4)
    if kind < 2:
        return generator.uniform(-0.1, 0.1, (1 + kind, 2))
    if kind == 2:
        return make_box_polygon(generator.uniform(0.01, 0.2, 2), generator.uniform(-4, 4)) + generator.uniform(-0.02, 0.02, 2)
    return make_hull_polygon(generator.uniform(-0.1, 0.1, (generator.integers(3, 9), 2)))[1]


def locate(polygon, points, spare=3):
    """Return where points (..., 2) are relative to a polygon, which its table holds with some unused vertices."""
    vertices = np.concatenate((polygon, np.zeros((spare, 2))))
    return find_offset(points[..., 0], points[..., 1], tabulate_edges(vertices, np.array(len(polygon))))


def find_nearest(polygon, point):
    """Return the nearest of many points of the boundary, the side of the point, and whether it is near a vertex."""
    shares = np.linspace(0.0, 1.0, FINE)[:, None]
    edges = [a + shares * (b - a) for a, b in zip(polygon, np.roll(polygon, -1, axis=0), strict=True)]
    boundary = np.concatenate(edges)
    nearest = boundary[np.hypot(*(boundary - point).T).argmin()]
    turns = np.arctan2(*(polygon - point).T[::-1])
    swept = (np.diff(np.append(turns, turns[0])) + np.pi) % (2 * np.pi) - np.pi
    is_inside = len(polygon) > 2 and abs(swept.sum()) > np.pi
    return nearest, -1.0 if is_inside else 1.0, bool(np.hypot(*(polygon - nearest).T).min() < 2e-5)


@MANY
@given(SEEDS)
def test_the_offset_is_that_of_the_nearest_point_of_the_boundary(seed):
    generator = np.random.default_rng(seed)
    polygon, point = random_polygon(generator), generator.uniform(-0.2, 0.2, 2)
    found = locate(polygon, point)
    nearest, side, is_at_vertex = find_nearest(polygon, point)
    distance = np.hypot(*(point - nearest))
    away = found.distance * np.array([found.normal_x, found.normal_y])
    assert np.sign(found.distance) == side
    assert abs(found.distance) == pytest.approx(distance, abs=1e-8)
    assert abs(found.distance) <= distance + 1e-12
    assert is_at_vertex or found.is_on_edge
    if not found.is_on_edge:
        assert np.hypot(*(polygon - point + away).T).min() < 1e-12
    if distance > 1e-3:
        np.testing.assert_allclose(away, point - nearest, atol=2e-5)


@pytest.mark.parametrize('corners', [[[0.0, 0.0]], [[0.0, 0.0], [0.1, 0.0]], make_box_polygon((0.2, 0.2), 0.0) + 0.1])
def test_a_point_on_the_polygon_has_a_normal_all_the_same(corners):
    found = locate(np.asarray(corners), np.zeros(2))
    assert abs(found.distance) == pytest.approx(SMALLEST_DISTANCE)
    assert np.hypot(found.normal_x, found.normal_y) == pytest.approx(1.0)


@MANY
@given(SEEDS)
def test_a_hull_is_convex_and_holds_its_points(seed):
    generator = np.random.default_rng(seed)
    points = generator.uniform(-0.3, 0.3, (generator.integers(3, 12), 2))
    centre, corners = make_hull_polygon(points)
    edges = np.roll(corners, -1, axis=0) - corners
    after = np.roll(edges, -1, axis=0)
    assert (edges[:, 0] * after[:, 1] - edges[:, 1] * after[:, 0] > 0.0).all(), 'anticlockwise'
    assert np.abs(corners.mean(axis=0)).max() < 1e-12
    assert all(np.hypot(*(points - centre - each).T).min() < 1e-12 for each in corners)
    _, distance = measure_offsets(points, make_obstacles([centre], [0.01], polygons=[corners]))
    assert distance.max() < 1e-9


REFUSED = {
    'a negative length': (lambda: Box((0, 0), size=(-0.1, 0.2)), 'size'),
    'one length only': (lambda: Box((0, 0), size=(0.2,)), 'size'),
    'an angle that is not a number': (lambda: Box((0, 0), size=(0.1, 0.2), yaw=np.nan), 'yaw'),
    'a box without size and radius': (lambda: Box((0, 0), size=(0, 0)), 'radius'),
    'a circle without radius': (lambda: Circle((0, 0), radius=0.0), 'radius'),
    'a hull without size and radius': (lambda: Hull([(0.1, 0.1), (0.1, 0.1)]), 'radius'),
    'a negative radius': (lambda: Box((0, 0), size=(0.1, 0.1), radius=-0.01), 'radius'),
    'a negative deviation': (lambda: Hull([(0, 0), (0.1, 0)], radius_stddev=-0.01), 'radius_stddev'),
    'a negative deviation of the centre': (lambda: Box((0, 0), size=(0.1, 0), centre_stddev=-1.0), 'centre_stddev'),
    'a hull of no points': (lambda: Hull(np.zeros((0, 2))), 'points'),
    'a hull of 17 corners': (lambda: Hull([(np.cos(turn), np.sin(turn)) for turn in 2 * np.pi * np.arange(17) / 17]), 'points'),
    'an end in space': (lambda: Capsule((0, 0, 0), (0.1, 0), radius=0.1), 'start'),
    'a height that is not a number': (lambda: Circle((0, 0), 0.1, heights=(0.0, np.nan)), 'heights: expected numbers'),
    'one height only': (lambda: Hull([(0, 0), (0.1, 0)], 0.1, heights=(0.1,)), 'heights: expected finite numbers of shape'),
    'heights in the wrong order': (lambda: Circle((0, 0), 0.1, heights=(0.2, 0.1)), 'heights: expected the lowest point below'),
    'a velocity of one number': (lambda: Box((0, 0), size=(0.1, 0.1), velocity=(1.0,)), 'velocity'),
}


@pytest.mark.parametrize('case', REFUSED)
def test_shapes_refuse_by_the_name_of_the_field(case):
    make, field = REFUSED[case]
    with pytest.raises(SceneError, match=rf'^obstacle\.{field}'):
        make()


STAR = np.column_stack([turn(0.8 * np.pi * np.arange(5)) for turn in (np.cos, np.sin)])
SQUARE = np.array([[0, 0], [1, 0], [1, 1], [0, 1]])
TABLES_REFUSED = {
    'a centre that is not a number': ({'centre': [[np.nan, 0]]}, r'centre: expected numbers in'),
    'a radius without end': ({'radius': [np.inf]}, r'radius: expected numbers in'),
    'two radii': ({'radius': [0.1, 0.2]}, r'radius: expected finite numbers of shape \(1,\)'),
    'a negative radius': ({'radius': [-0.1]}, r'radius\[0\]: expected a number >= 0, got -0.1'),
    'a negative deviation': ({'radius_stddev': [-1.0]}, r'radius_stddev\[0\]'),
    'a negative variance': ({'centre_covariance': [-np.eye(2)]}, r'centre_covariance\[0\]: expected a symmetric'),
    'a covariance that is not symmetric': ({'centre_covariance': [[[1, 1], [0, 1]]]}, r'centre_covariance\[0\]'),
    'more corners than vertices': ({'corners': [5]}, r'corners\[0\]: expected a number in \[1, 4\], got 5'),
    'a clockwise polygon': ({'vertices': [SQUARE[::-1]]}, r'vertices\[0\]: expected a convex polygon, anticlockwise'),
    'a hollow polygon': ({'vertices': [[[0, 0], [1, 0], [0.1, 0.1], [0, 1]]]}, r'vertices\[0\]: expected a convex'),
    'a polygon that goes round twice': ({'vertices': [STAR], 'corners': [5]}, r'vertices\[0\]: expected a convex'),
    'heights in the wrong order': ({'heights': [[0.2, 0.1]]}, r'heights\[0\]: expected the lowest point below'),
    'one height': ({'heights': [0.2]}, r'heights: expected numbers of shape \(1, 2\)'),
}


@pytest.mark.parametrize('case', TABLES_REFUSED)
def test_tables_refuse_by_the_name_of_the_field(case):
    changed, message = TABLES_REFUSED[case]
    table = make_obstacles([[0, 0]], 0.1, polygons=[SQUARE])
    assert collect_obstacles(table) is table
    with pytest.raises(SceneError, match=rf'^obstacles\.{message}'):
        collect_obstacles(replace(table, **{field: np.array(value) for field, value in changed.items()}))


def test_tables_refuse_a_name_that_occurs_twice():
    with pytest.raises(SceneError, match=r"^obstacles\.ids: expected a different name for each obstacle, got \('a', 'a'\)"):
        collect_obstacles(make_obstacles([[0, 0], [1, 0]], 0.1, ids=('a', 'a')))


@given(st.lists(st.tuples(st.floats(-1, 1), st.floats(-1, 1)), min_size=1, max_size=12), st.floats(1e-3, 0.1))
def test_the_limits_are_those_of_the_outline(points, radius):
    obstacles = collect_obstacles([Hull(points, radius), Circle((2.0, 2.0), radius=1.0)])
    low, high = find_limits(obstacles, np.array([0.01, 0.0]))
    outline = trace_obstacle(obstacles, 0, 0.01, points=2000)
    np.testing.assert_allclose([low[0], high[0]], [outline.min(axis=0), outline.max(axis=0)], atol=1e-6)
    np.testing.assert_array_equal([low[1], high[1]], [[1.0, 1.0], [3.0, 3.0]])
