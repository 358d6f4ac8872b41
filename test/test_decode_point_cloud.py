# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""PointCloud2 as a table of obstacles: layouts, optional columns, and errors."""

from __future__ import annotations

import itertools
import math
import re

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from message_helpers import SECOND, both_kinds, cloud, message_types, obstacle_table

from foc_ros.core.errors import MessageError
from foc_ros.core.obstacles.shapes import Box, make_box_polygon
from foc_ros.ros.messages.decode_point_cloud import MAX_ROWS, decode_point_cloud
from foc_ros.ros.messages.encode_inputs import encode_obstacles
from foc_ros.ros.messages.types import MessageTypes

BAGS = message_types('rosbags')
FULL = [(name, '<f4') for name in ('x', 'y', 'z', 'radius', 'radius_stddev', 'vx', 'vy', 'vz')] + [('id', '<u4')]


@both_kinds
def test_rows_become_obstacles(types: MessageTypes) -> None:
    table = obstacle_table(
        [(0.5, 0.25, 0.125, 0.0625, 0.5, 1.0, 2.0, 3.0, 7), (1.0, 2.0, 3.0, 4.0, 0.0, 0.0, 0.0, 0.0, 4000000000)], FULL
    )
    scene = decode_point_cloud(cloud(types, table, 3 * SECOND, 'base'), 'xz')
    assert (scene.stamp_ns, scene.frame_id, scene.dropped) == (3 * SECOND, 'base', {})
    assert scene.obstacles.ids == ('7', '4000000000')
    np.testing.assert_array_equal(scene.obstacles.centre, [[0.5, 0.125], [1.0, 3.0]])
    np.testing.assert_array_equal(scene.obstacles.radius, [0.0625, 4.0])
    np.testing.assert_array_equal(scene.obstacles.radius_stddev, [0.5, 0.0])
    np.testing.assert_array_equal(scene.obstacles.velocity, [[1.0, 3.0], [0.0, 0.0]])


@both_kinds
def test_absent_columns_are_zero_and_row_numbers_are_the_ids(types: MessageTypes) -> None:
    obstacles = decode_point_cloud(cloud(types, obstacle_table([(1, 2, 3, 4), (5, 6, 7, 8)])), 'xy').obstacles
    assert obstacles.ids == ('0', '1')
    assert not obstacles.radius_stddev.any()
    assert not obstacles.velocity.any()


@both_kinds
def test_no_rows_are_an_empty_scene(types: MessageTypes) -> None:
    for message in (types.make('sensor_msgs/msg/PointCloud2'), cloud(types, obstacle_table([]))):
        scene = decode_point_cloud(message, 'xy')
        assert len(scene.obstacles) == 0
        assert scene.obstacles.centre.shape == (0, 2)


@pytest.mark.parametrize(
    ('order', 'real', 'whole'), [*itertools.product('<>', ('f4', 'f8'), ('i1', 'u1', 'i2', 'u2', 'i4', 'u4'))]
)
def test_every_number_type_and_byte_order(order: str, real: str, whole: str) -> None:
    dtype = [('id', order + whole), ('y', order + real), ('x', order + real), ('radius', order + real), ('z', order + real)]
    obstacles = decode_point_cloud(cloud(BAGS, obstacle_table([(100, 0.5, 0.25, 0.125, 9.0)], dtype)), 'xy').obstacles
    assert obstacles.ids == ('100',)
    np.testing.assert_array_equal(obstacles.centre, [[0.25, 0.5]])
    np.testing.assert_array_equal(obstacles.radius, [0.125])


def test_other_fields_and_padding_are_skipped() -> None:
    dtype = {
        'names': ['x', 'rgb', 'y', 'z', 'radius'],
        'formats': ['<f4', '<u4', '<f4', '<f4', '<f8'],
        'offsets': [4, 8, 12, 16, 24],
        'itemsize': 40,
    }
    table = np.zeros(2, dtype=dtype)
    table['x'], table['y'], table['radius'], table['rgb'] = [1, 2], [3, 4], [5, 6], 0xFFFFFFFF
    obstacles = decode_point_cloud(cloud(BAGS, table), 'xy').obstacles
    np.testing.assert_array_equal(obstacles.centre, [[1, 3], [2, 4]])
    np.testing.assert_array_equal(obstacles.radius, [5, 6])


def test_organised_rows_with_padding() -> None:
    table = obstacle_table([(i, 0, 0, 1) for i in range(6)])
    lines = [table[:3].tobytes() + b'\xff' * 5, table[3:].tobytes() + b'\xff' * 5]
    message = cloud(BAGS, table, height=2, width=3, row_step=3 * 16 + 5, data=b''.join(lines))
    np.testing.assert_array_equal(decode_point_cloud(message, 'xy').obstacles.centre[:, 0], range(6))


def test_a_single_row_needs_no_row_step() -> None:
    assert len(decode_point_cloud(cloud(BAGS, obstacle_table([(1, 2, 3, 4)] * 2), row_step=0), 'xy').obstacles) == 2


@both_kinds
@pytest.mark.parametrize('value', [math.nan, math.inf, -math.inf])
@pytest.mark.parametrize('column', ['x', 'y', 'z', 'radius', 'radius_stddev', 'vx'])
def test_rows_that_are_not_finite_are_dropped_and_counted(types: MessageTypes, column: str, value: float) -> None:
    table = np.zeros(3, dtype=FULL)
    table['id'] = [10, 11, 12]
    table[column][1] = value
    scene = decode_point_cloud(cloud(types, table), 'xy')
    assert scene.obstacles.ids == ('10', '12')
    assert scene.dropped == {'not_finite': 1}


@pytest.mark.parametrize('order', ['<', '>'])
def test_a_signalling_nan_is_dropped_without_a_warning(order: str) -> None:
    table = np.zeros(2, dtype=[(name, f'{order}f4') for name in ('x', 'y', 'z', 'radius')])
    table['x'].view(f'{order}u4')[1] = 0x7FA00000
    scene = decode_point_cloud(cloud(BAGS, table), 'xy')
    assert (scene.obstacles.ids, scene.dropped) == (('0',), {'not_finite': 1})


def test_a_scene_without_a_finite_row_is_empty_and_counted() -> None:
    scene = decode_point_cloud(cloud(BAGS, obstacle_table([(math.nan, 0, 0, 1)] * 4)), 'xy')
    assert len(scene.obstacles) == 0
    assert scene.dropped == {'not_finite': 4}


def test_the_last_finite_row_of_an_id_is_used() -> None:
    table = np.zeros(5, dtype=FULL)
    table['id'] = [3, 1, 3, 2, 1]
    table['x'] = [0, 1, 2, 3, math.nan]
    scene = decode_point_cloud(cloud(BAGS, table), 'xy')
    assert scene.obstacles.ids == ('1', '3', '2')
    np.testing.assert_array_equal(scene.obstacles.centre[:, 0], [1, 2, 3])
    assert scene.dropped == {'not_finite': 1, 'duplicate_id': 1}


@pytest.mark.parametrize(
    ('column', 'value', 'words'),
    [
        ('radius', -0.5, 'radius[1]: expected a number in [0, 10000] m, got -0.5'),
        ('radius', 2e4, 'radius[1]: expected a number in [0, 10000] m, got 20000'),
        ('radius_stddev', -0.5, 'radius_stddev[1]: expected a number in [0, 10000] m, got -0.5'),
        ('x', -2e4, 'x[1]: expected a number in [-10000, 10000] m, got -20000'),
        ('vz', 2e4, 'vz[1]: expected a number in [-10000, 10000] m/s, got 20000'),
    ],
)
def test_a_scene_with_a_number_out_of_bounds_is_refused(column: str, value: float, words: str) -> None:
    table = np.zeros(3, dtype=FULL)
    table[column][1] = value
    with pytest.raises(MessageError, match=re.escape(words)):
        decode_point_cloud(cloud(BAGS, table), 'xy')


BOX = [(name, '<f4') for name in ('x', 'y', 'z', 'radius', 'size_x', 'size_y', 'yaw')]


@both_kinds
def test_rows_with_a_size_are_boxes_capsules_and_circles(types: MessageTypes) -> None:
    rows = [(1, 2, 0, 0, 0.5, 0.25, 0), (3, 4, 0, 0.125, 0.5, 0, 0), (5, 6, 0, 0.125, 0, 0.5, 0), (7, 8, 0, 0.125, 0, 0, 1)]
    obstacles = decode_point_cloud(cloud(types, obstacle_table(rows, BOX)), 'xy').obstacles
    assert obstacles.corners.tolist() == [4, 2, 2, 1]
    np.testing.assert_array_equal(obstacles.centre, [[1, 2], [3, 4], [5, 6], [7, 8]])
    np.testing.assert_array_equal(obstacles.vertices[0], [[0.25, 0.125], [-0.25, 0.125], [-0.25, -0.125], [0.25, -0.125]])
    np.testing.assert_array_equal(obstacles.vertices[1, :2], [[0.25, 0], [-0.25, 0]])
    np.testing.assert_allclose(obstacles.vertices[2, :2], [[0, 0.25], [0, -0.25]], atol=1e-17)
    np.testing.assert_array_equal(obstacles.radius, [0, 0.125, 0.125, 0.125])


@given(st.lists(st.tuples(st.floats(0, 10), st.floats(0, 10), st.floats(-7, 7)), min_size=1, max_size=6))
def test_boxes_of_a_cloud_are_those_of_the_public_interface(rows: list[tuple[float, float, float]]) -> None:
    table = obstacle_table([(0, 0, 0, 1, *row) for row in rows], [(name, '<f8') for name, _ in BOX])
    obstacles = decode_point_cloud(cloud(BAGS, table), 'xy').obstacles
    for row, (size_x, size_y, yaw) in enumerate(rows):
        polygon = Box((0, 0), (size_x, size_y), yaw, radius=1.0).polygon
        assert obstacles.corners[row] == len(polygon)
        np.testing.assert_array_equal(obstacles.vertices[row, : len(polygon)], polygon)


@pytest.mark.parametrize(
    ('row', 'words'),
    [
        ((0, 0, 0, 0, -0.5, 1, 0), 'size_x[1]: expected a number in [0, 10000] m, got -0.5'),
        ((0, 0, 0, 0, 1, 2e4, 0), 'size_y[1]: expected a number in [0, 10000] m, got 20000'),
        ((0, 0, 0, 0, 1, 1, -2e4), 'yaw[1]: expected a number in [-10000, 10000] rad, got -20000'),
        ((0, 0, 0, 0, 0, 0, 1), 'radius[1]: expected a number > 0 m where size_x and size_y are 0, got 0'),
    ],
)
def test_a_box_out_of_bounds_is_refused(row: tuple[float, ...], words: str) -> None:
    with pytest.raises(MessageError, match=re.escape(words)):
        decode_point_cloud(cloud(BAGS, obstacle_table([(0, 0, 0, 1, 0, 0, 0), row], BOX)), 'xy')


@pytest.mark.parametrize('column', ['size_x', 'size_y', 'yaw'])
def test_a_box_that_is_not_finite_is_dropped_and_counted(column: str) -> None:
    table = obstacle_table([(0, 0, 0, 1, 1, 1, 0)] * 2, BOX)
    table[column][0] = math.nan
    scene = decode_point_cloud(cloud(BAGS, table), 'xy')
    assert (scene.obstacles.ids, scene.dropped) == (('1',), {'not_finite': 1})


@pytest.mark.parametrize('size', [(), (0.0, 0.0, 0.0), (0.25, 0.5, 0.75)])
def test_encoded_obstacles_are_decoded(size: tuple[float, ...]) -> None:
    message = encode_obstacles(BAGS, SECOND, 'world', [(1.0, 2.0, 3.0, 0.5, 0.125, 7, *size), (4.0, 5.0, 6.0, 1.0, 0.0, 8)])
    assert ('size_x' in [field.name for field in message.fields]) == any(size)
    obstacles = decode_point_cloud(message, 'xy').obstacles
    assert obstacles.ids == ('7', '8') and obstacles.corners.tolist() == [4 if any(size) else 1, 1]
    np.testing.assert_array_equal(obstacles.centre, [[1, 2], [4, 5]])
    polygon = make_box_polygon(size[:2] or (0, 0), size[2] if size else 0)
    np.testing.assert_allclose(obstacles.vertices[0, : len(polygon)], polygon)


@pytest.mark.parametrize('missing', ['x', 'y', 'z', 'radius'])
def test_a_missing_field_is_named(missing: str) -> None:
    names = [name for name in ('x', 'y', 'z', 'radius') if name != missing]
    table = np.zeros(1, dtype=[(name, '<f4') for name in names])
    words = f'fields: expected a field {missing} (needed are x, y, z, radius), got {", ".join(names)}'
    with pytest.raises(MessageError, match=re.escape(words)):
        decode_point_cloud(cloud(BAGS, table), 'xy')


@both_kinds
@pytest.mark.parametrize(
    ('changes', 'words'),
    [
        ({'data': b'\0' * 31}, 'data: expected 32 bytes (1 rows of row_step 32 and 2 points of point_step 16), got 31'),
        ({'data': b'\0' * 33}, 'data: expected 32 bytes (1 rows of row_step 32 and 2 points of point_step 16), got 33'),
        ({'data': b''}, 'data: expected 32 bytes'),
        ({'width': 4_000_000_000}, 'height * width: expected at most 20000 obstacles, got 4000000000'),
        ({'width': 3}, 'data: expected 48 bytes'),
        ({'width': 0}, 'data: expected 0 bytes'),
        ({'height': 0}, 'data: expected 0 bytes'),
        ({'height': 2, 'width': 1, 'row_step': 8}, 'data: expected 32 bytes'),
        ({'point_step': 0, 'data': b''}, 'fields[x].offset: expected 4 bytes inside point_step 0, got 0'),
        ({'point_step': 12, 'data': b'\0' * 24}, 'fields[radius].offset: expected 4 bytes inside point_step 12, got 12'),
        ({'fields': []}, 'got no fields'),
    ],
)
def test_a_layout_that_does_not_fit_is_refused(types: MessageTypes, changes: dict[str, object], words: str) -> None:
    with pytest.raises(MessageError, match=re.escape(words)):
        decode_point_cloud(cloud(types, obstacle_table([(1, 2, 3, 4)] * 2), **changes), 'xy')


@pytest.mark.parametrize(
    ('field', 'attribute', 'value', 'words'),
    [
        ('x', 'datatype', 5, 'fields[x].datatype: expected 7 or 8, got 5'),
        ('radius', 'datatype', 0, 'fields[radius].datatype: expected 7 or 8, got 0'),
        ('id', 'datatype', 7, 'fields[id].datatype: expected an integer (1-6), got 7'),
        ('id', 'datatype', 99, 'fields[id].datatype: expected an integer (1-6), got 99'),
        ('y', 'count', 3, 'fields[y].count: expected 1, got 3'),
        ('z', 'name', 'x', 'fields: expected a field z'),
        ('radius_stddev', 'name', 'x', 'fields: expected one field x, got 2'),
    ],
)
def test_a_field_of_the_wrong_kind_is_refused(field: str, attribute: str, value: object, words: str) -> None:
    message = cloud(BAGS, np.zeros(2, dtype=FULL))
    entry = next(each for each in message.fields if each.name == field)
    setattr(entry, attribute, value)
    with pytest.raises(MessageError, match=re.escape(words)):
        decode_point_cloud(message, 'xy')


def test_a_negative_stamp_is_refused_and_an_unset_one_is_accepted() -> None:
    table = obstacle_table([(1, 2, 3, 4)])
    assert decode_point_cloud(cloud(BAGS, table, 0), 'xy').stamp_ns == 0
    with pytest.raises(MessageError, match=re.escape('header.stamp.sec: expected at least 0, got -1')):
        decode_point_cloud(cloud(BAGS, table, -SECOND), 'xy')


def test_the_largest_scene_is_accepted() -> None:
    assert len(decode_point_cloud(cloud(BAGS, np.zeros(MAX_ROWS, dtype=FULL[:4])), 'xy').obstacles) == MAX_ROWS


finite = st.floats(-1e4, 1e4, width=32)
size = st.floats(0, 1e4, width=32)
rows = st.lists(st.tuples(finite, finite, finite, size, size, finite, finite, finite, st.integers(0, 2**32 - 1)), max_size=8)


@given(rows)
def test_every_table_in_bounds_is_decoded_as_it_was_encoded(table: list[tuple[float, ...]]) -> None:
    obstacles = decode_point_cloud(cloud(BAGS, obstacle_table(table, FULL)), 'xy').obstacles
    expected = {row[-1]: row for row in table}
    assert set(obstacles.ids) == {str(identity) for identity in expected}
    for i, name in enumerate(obstacles.ids):
        row = expected[int(name)]
        assert (*obstacles.centre[i], obstacles.radius[i], obstacles.radius_stddev[i]) == (row[0], row[1], row[3], row[4])
        assert tuple(obstacles.velocity[i]) == (row[5], row[6])


fields = st.lists(
    st.tuples(
        st.sampled_from(['x', 'y', 'z', 'radius', 'radius_stddev', 'id', 'vx', 'size_x', 'yaw', 'rgb']),
        st.integers(0, 24),
        st.integers(0, 9),
        st.integers(0, 2),
    ),
    max_size=7,
)


@given(
    fields, st.binary(max_size=96), st.integers(0, 4), st.integers(0, 6), st.integers(0, 24), st.integers(0, 48), st.booleans()
)
def test_any_bytes_are_decoded_or_refused(
    layout: list[tuple[str, int, int, int]], data: bytes, height: int, width: int, step: int, row_step: int, big: bool
) -> None:
    made = [
        BAGS.make('sensor_msgs/msg/PointField', name=name, offset=offset, datatype=datatype, count=count)
        for name, offset, datatype, count in layout
    ]
    sizes = {'height': height, 'width': width, 'point_step': step, 'row_step': row_step}
    message = BAGS.make('sensor_msgs/msg/PointCloud2', fields=made, data=data, is_bigendian=big, **sizes)
    try:
        scene = decode_point_cloud(message, 'xy')
    except MessageError:
        return
    assert len(scene.obstacles) + sum(scene.dropped.values()) == height * width
    assert np.isfinite(scene.obstacles.centre).all()
    assert (scene.obstacles.radius >= 0).all()
