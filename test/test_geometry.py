"""Convex polygons against brute force: the nearest point, its side and its normal; and what shapes refuse."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from foc_ros.core.errors import SceneError
from foc_ros.core.obstacles.geometry import SMALLEST_DISTANCE, Offset, find_offset, measure_offsets, tabulate_edges
from foc_ros.core.obstacles.shapes import Box, Capsule, Circle, Hull, collect_obstacles, make_box_polygon, make_hull_polygon
from foc_ros.core.types import make_obstacles

SEEDS = st.integers(0, 10_000)
MANY = settings(max_examples=200, deadline=None, derandomize=True)
FINE = 20_001
"""Points on each edge in the brute-force search for the nearest one."""


def random_polygon(generator: np.random.Generator) -> np.ndarray:
    """Return one vertex, two, a box at any angle, or the hull of some points, with its centre elsewhere than at zero."""
    kind = generator.integers(4)
    if kind < 2:
        return generator.uniform(-0.1, 0.1, (1 + kind, 2))
    if kind == 2:
        return make_box_polygon(generator.uniform(0.01, 0.2, 2), generator.uniform(-4, 4)) + generator.uniform(-0.02, 0.02, 2)
    return make_hull_polygon(generator.uniform(-0.1, 0.1, (generator.integers(3, 9), 2)))[1]


def locate(polygon: np.ndarray, points: np.ndarray, spare: int = 3) -> Offset:
    """Return where points (..., 2) are relative to a polygon, which its table holds with some unused vertices."""
    vertices = np.concatenate((polygon, np.zeros((spare, 2))))
    return find_offset(points[..., 0], points[..., 1], tabulate_edges(vertices, np.array(len(polygon))))


def find_nearest(polygon: np.ndarray, point: np.ndarray) -> tuple[np.ndarray, float, bool]:
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


@MANY
@given(SEEDS)
def test_the_normal_is_the_gradient_of_the_signed_distance(seed):
    generator, h = np.random.default_rng(seed), 1e-6
    polygon, point = random_polygon(generator), generator.uniform(-0.2, 0.2, 2)
    found = locate(polygon, point)
    beside = locate(polygon, point + h * np.array([[1, 0], [-1, 0], [0, 1], [0, -1]]))
    assert np.hypot(found.normal_x, found.normal_y) == pytest.approx(1.0)
    gradient = (beside.distance[::2] - beside.distance[1::2]) / (2 * h)
    is_one_feature = len({*zip(beside.distance > 0.0, beside.is_on_edge, strict=True)}) == 1
    if is_one_feature and np.hypot(*gradient) > 0.999:  # not across the line inside from which two edges are equally near
        np.testing.assert_allclose([found.normal_x, found.normal_y], gradient, atol=1e-4)


@pytest.mark.parametrize('corners', [[[0.0, 0.0]], [[0.0, 0.0], [0.1, 0.0]], make_box_polygon((0.2, 0.2), 0.0) + 0.1])
def test_a_point_on_the_polygon_has_a_normal_all_the_same(corners):
    found = locate(np.asarray(corners), np.zeros(2))
    assert abs(found.distance) == pytest.approx(SMALLEST_DISTANCE)
    assert np.hypot(found.normal_x, found.normal_y) == pytest.approx(1.0)


def test_many_points_about_many_polygons_are_as_each_alone():
    generator = np.random.default_rng(4)
    polygons, points = [random_polygon(generator) for _ in range(6)], generator.uniform(-0.2, 0.2, (5, 6, 2))
    table = make_obstacles(np.zeros((6, 2)), np.full(6, 0.01), polygons=polygons)
    found = find_offset(points[..., 0], points[..., 1], tabulate_edges(table.vertices, table.corners))
    for j, polygon in enumerate(polygons):
        for many, one in zip(found, locate(polygon, points[:, j]), strict=True):
            np.testing.assert_array_equal(many[:, j], one)


@pytest.mark.parametrize('yaw', [0.0, 0.3, np.pi / 2, -2.0])
def test_the_places_about_a_box(yaw):
    """A point beyond each corner, beside each edge, and inside, near each edge."""
    turn = np.array([[np.cos(yaw), -np.sin(yaw)], [np.sin(yaw), np.cos(yaw)]])
    expected = {
        (0.13, 0.09): (0.05, (0.6, 0.8), False),
        (-0.13, -0.09): (0.05, (-0.6, -0.8), False),
        (0.14, 0.01): (0.04, (1.0, 0.0), True),
        (-0.05, -0.08): (0.03, (0.0, -1.0), True),
        (0.09, 0.0): (-0.01, (1.0, 0.0), True),
        (0.02, -0.03): (-0.02, (0.0, -1.0), True),
    }
    for point, (distance, normal, is_on_edge) in expected.items():
        found = locate(make_box_polygon((0.2, 0.1), yaw), turn @ point)
        assert found.distance == pytest.approx(distance, abs=1e-15)
        np.testing.assert_allclose([found.normal_x, found.normal_y], turn @ normal, atol=1e-14)
        assert found.is_on_edge == is_on_edge


def test_offsets_of_points_follow_centres_that_move():
    generator = np.random.default_rng(1)
    made = make_obstacles(
        generator.uniform(-0.1, 0.1, (3, 2)), np.full(3, 0.02), polygons=[random_polygon(generator) for _ in range(3)]
    )
    points, moved = generator.uniform(-0.2, 0.2, (5, 2)), generator.uniform(-0.2, 0.2, (5, 3, 2))
    offset, distance = measure_offsets(points, made, moved)
    for i in range(5):
        for j in range(3):
            alone = replace(made.take([j]), centre=moved[i, [j]])
            one, length = measure_offsets(points[i], alone)
            np.testing.assert_array_equal(offset[i, j], one[0, 0])
            assert distance[i, j] == length[0, 0]


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


@pytest.mark.parametrize('spread', [0.0, 0.1])
def test_a_hull_of_points_on_one_line_is_a_line_or_a_point(spread):
    points = np.array([0.2, 0.1]) + spread * np.linspace(-1, 1, 5)[[2, 0, 3, 4, 1], None] * [0.6, 0.8]
    centre, corners = make_hull_polygon(points)
    np.testing.assert_allclose(centre, [0.2, 0.1], atol=1e-15)
    expected = spread * np.array([[-0.6, -0.8], [0.6, 0.8]]) if spread else np.zeros((1, 2))
    np.testing.assert_allclose(corners[np.argsort(corners[:, 0])], expected, atol=1e-15)


def test_a_box_has_four_corners_two_or_one():
    assert [len(make_box_polygon(size, 0.4)) for size in ((0.2, 0.1), (0.2, 0.0), (0.0, 0.1), (0.0, 0.0))] == [4, 2, 2, 1]
    np.testing.assert_allclose(make_box_polygon((0.2, 0.0), np.pi / 2), [[0.0, 0.1], [0.0, -0.1]], atol=1e-15)
    np.testing.assert_allclose(make_box_polygon((0.0, 0.2), 0.0), [[0.0, 0.1], [0.0, -0.1]], atol=1e-15)
    corners = make_box_polygon((0.2, 0.1), 0.7)
    assert np.cross(np.append(corners[1] - corners[0], 0), np.append(corners[2] - corners[1], 0))[2] > 0.0, 'anticlockwise'


def test_tables_hold_the_polygons_of_shapes():
    table = collect_obstacles(
        [
            Circle((0.1, 0.2), radius=0.03),
            Capsule((0.0, 0.0), (0.2, 0.0), radius=0.01),
            Box((0.5, 0.5), size=(0.2, 0.1), radius=0.02),
            Hull([(0.0, 0.0), (0.3, 0.0), (0.0, 0.3), (0.05, 0.05)]),
        ]
    )
    assert table.corners.tolist() == [1, 2, 4, 3]
    np.testing.assert_allclose(table.centre, [[0.1, 0.2], [0.1, 0.0], [0.5, 0.5], [0.1, 0.1]], atol=1e-15)
    np.testing.assert_allclose(table.extent, [0.03, 0.11, 0.02 + np.hypot(0.1, 0.05), np.hypot(0.2, 0.1)])
    grown = table.grow(0.01)
    np.testing.assert_allclose(grown.extent, table.extent + 0.01)
    np.testing.assert_array_equal(grown.vertices, table.vertices)


def make_circle_of_points(corners: int) -> np.ndarray:
    turns = 2 * np.pi * np.arange(corners) / corners
    return 0.1 * np.stack((np.cos(turns), np.sin(turns)), axis=1)


REFUSED = {
    'a negative length': (lambda: Box((0, 0), size=(-0.1, 0.2)), 'obstacle.size'),
    'a length that is not a number': (lambda: Box((0, 0), size=(np.nan, 0.2)), 'obstacle.size'),
    'one length only': (lambda: Box((0, 0), size=(0.2,)), 'obstacle.size'),
    'an angle that is not a number': (lambda: Box((0, 0), size=(0.1, 0.2), yaw=np.nan), 'obstacle.yaw'),
    'an infinite angle': (lambda: Box((0, 0), size=(0.1, 0.2), yaw=np.inf), 'obstacle.yaw'),
    'a box without size and radius': (lambda: Box((0, 0), size=(0, 0)), 'obstacle.radius'),
    'a circle without radius': (lambda: Circle((0, 0), radius=0.0), 'obstacle.radius'),
    'a capsule without length and radius': (lambda: Capsule((0.1, 0.1), (0.1, 0.1), radius=0.0), 'obstacle.radius'),
    'a hull without size and radius': (lambda: Hull([(0.1, 0.1), (0.1, 0.1)]), 'obstacle.radius'),
    'a negative radius': (lambda: Box((0, 0), size=(0.1, 0.1), radius=-0.01), 'obstacle.radius'),
    'a radius that is not a number': (lambda: Capsule((0, 0), (0.1, 0), radius=np.nan), 'obstacle.radius'),
    'a negative deviation': (lambda: Hull([(0, 0), (0.1, 0)], radius_stddev=-0.01), 'obstacle.radius_stddev'),
    'a negative deviation of the centre': (lambda: Box((0, 0), size=(0.1, 0), centre_stddev=-1.0), 'obstacle.centre_stddev'),
    'a hull of no points': (lambda: Hull(np.zeros((0, 2))), 'obstacle.points'),
    'a hull of 17 corners': (lambda: Hull(make_circle_of_points(17)), 'obstacle.points'),
    'points in space': (lambda: Hull([(0, 0, 0), (1, 0, 0)]), 'obstacle.points'),
    'an end in space': (lambda: Capsule((0, 0, 0), (0.1, 0), radius=0.1), 'obstacle.start'),
    'an end that is not a number': (lambda: Capsule((0, 0), (0.1, np.nan), radius=0.1), 'obstacle.end'),
    'a velocity of one number': (lambda: Box((0, 0), size=(0.1, 0.1), velocity=(1.0,)), 'obstacle.velocity'),
}


@pytest.mark.parametrize('case', REFUSED)
def test_shapes_refuse_by_the_name_of_the_field(case):
    make, field = REFUSED[case]
    with pytest.raises(SceneError, match=f'^{field}'):
        make()


def test_shapes_at_the_bounds_are_taken():
    assert len(Hull(make_circle_of_points(16)).polygon) == 16
    assert len(Hull(np.repeat(make_circle_of_points(16), 3, axis=0)).polygon) == 16
    assert len(Box((0, 0), size=(0.0, 0.1)).polygon) == 2, 'a line without radius'
    assert len(Capsule((0.1, 0.1), (0.1, 0.1), radius=0.02).polygon) == 1
