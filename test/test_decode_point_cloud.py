# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Decoding of the table of obstacles: its layout, its rows, and everything that is refused or dropped."""

import itertools
import math
import re
from itertools import product

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from message_helpers import BAGS, SECOND, both_kinds, cloud, marker, marker_array, obstacle_table
from scipy.spatial.transform import Rotation

from foc_ros.core.errors import MessageError
from foc_ros.core.obstacles.geometry import measure_offsets
from foc_ros.ros.messages import decode_objects
from foc_ros.ros.messages.decode_objects import ObjectTable
from foc_ros.ros.messages.decode_point_cloud import MAX_ROWS, decode_point_cloud
from foc_ros.ros.messages.plane import project

FULL = [(name, '<f4') for name in ('x', 'y', 'z', 'radius', 'radius_stddev', 'vx', 'vy', 'vz')] + [('id', '<u4')]
BOX = [(name, '<f4') for name in ('x', 'y', 'z', 'radius', 'size_x', 'size_y', 'yaw')]


def decode(table, types=BAGS, **changes):
    return decode_point_cloud(cloud(types, table, **changes), 'xy')


def with_cells(layout, **cells):
    """Return a table of two rows, of which the second has other cells."""
    table = np.zeros(2, dtype=layout)
    table['radius'][0] = 1
    for column, value in cells.items():
        table[column][1] = value
    return table


def with_field(field, **values):
    """Return the fields of a table, of which one has other values."""
    found = cloud(BAGS, np.zeros(2, dtype=FULL)).fields
    for attribute, value in values.items():
        setattr(next(each for each in found if each.name == field), attribute, value)
    return {'fields': found}


def without_column(missing):
    return np.zeros(1, dtype=[(name, '<f4') for name in ('x', 'y', 'z', 'radius') if name != missing])


@both_kinds
def test_rows_become_obstacles(types):
    rows = (0.5, 0.25, 0.125, 0.0625, 0.5, 1.0, 2.0, 3.0, 7), (1.0, 2.0, 3.0, 4.0, 0.0, 0.0, 0.0, 0.0, 4000000000)
    table = obstacle_table([*rows], FULL)
    scene = decode_point_cloud(cloud(types, table, 3 * SECOND, 'base'), 'xz')
    assert (scene.stamp_ns, scene.frame_id, scene.dropped) == (3 * SECOND, 'base', {})
    assert scene.obstacles.ids == ('7', '4000000000')
    np.testing.assert_array_equal(scene.obstacles.centre, [[0.5, 0.125], [1.0, 3.0]])
    np.testing.assert_array_equal(scene.obstacles.radius, [0.0625, 4.0])
    np.testing.assert_array_equal(scene.obstacles.radius_stddev, [0.5, 0.0])
    np.testing.assert_array_equal(scene.obstacles.velocity, [[1.0, 3.0], [0.0, 0.0]])
    obstacles = decode(obstacle_table([(1, 2, 3, 4), (5, 6, 7, 8)]), types).obstacles
    assert obstacles.ids == ('0', '1'), 'the numbers of the rows'
    assert not obstacles.radius_stddev.any() and not obstacles.velocity.any()


@both_kinds
def test_no_rows_are_an_empty_scene(types):
    for message in (types.make('sensor_msgs/msg/PointCloud2'), cloud(types, obstacle_table([]))):
        assert decode_point_cloud(message, 'xy').obstacles.centre.shape == (0, 2)
    scene = decode(obstacle_table([(math.nan, 0, 0, 1)] * 4), types)
    assert len(scene.obstacles) == 0
    assert scene.dropped == {'not_finite': 4}


@pytest.mark.parametrize(
    ('order', 'real', 'whole'), [*itertools.product('<>', ('f4', 'f8'), ('i1', 'u1', 'i2', 'u2', 'i4', 'u4'))]
)
def test_every_number_type_and_byte_order(order, real, whole):
    dtype = [('id', order + whole), ('y', order + real), ('x', order + real), ('radius', order + real), ('z', order + real)]
    obstacles = decode(obstacle_table([(100, 0.5, 0.25, 0.125, 9.0)], dtype)).obstacles
    assert obstacles.ids == ('100',)
    assert (obstacles.centre.tolist(), obstacles.radius.tolist()) == ([[0.25, 0.5]], [0.125])


def test_other_fields_and_padding_are_skipped():
    dtype = {
        'names': ['x', 'rgb', 'y', 'z', 'radius'],
        'formats': ['<f4', '<u4', '<f4', '<f4', '<f8'],
        'offsets': [4, 8, 12, 16, 24],
        'itemsize': 40,
    }
    table = np.zeros(2, dtype=dtype)
    table['x'], table['y'], table['radius'], table['rgb'] = [1, 2], [3, 4], [5, 6], 0xFFFFFFFF
    obstacles = decode(table).obstacles
    assert (obstacles.centre.tolist(), obstacles.radius.tolist()) == ([[1, 3], [2, 4]], [5, 6])
    table = obstacle_table([(i, 0, 0, 1) for i in range(6)])
    lines = b''.join(part.tobytes() + b'\xff' * 5 for part in (table[:3], table[3:]))
    organised = decode(table, height=2, width=3, row_step=3 * 16 + 5, data=lines).obstacles
    assert organised.centre[:, 0].tolist() == [*range(6)]
    assert len(decode(table, row_step=0).obstacles) == 6, 'a single line needs no row_step'
    assert len(decode(table, row_step=101, data=table.tobytes() + b'\xff' * 5).obstacles) == 6, 'and may end with a padding'


@both_kinds
@pytest.mark.parametrize('value', [math.nan, math.inf, -math.inf])
@pytest.mark.parametrize(
    ('column', 'layout'),
    [
        *((name, FULL) for name in ('x', 'y', 'z', 'radius', 'radius_stddev', 'vx')),
        *((name, BOX) for name in ('size_x', 'size_y', 'yaw')),
    ],
)
def test_rows_that_are_not_finite_are_dropped_and_counted(types, column, layout, value):
    table = np.zeros(3, dtype=layout)
    table['radius'] = 1.0
    table[column][1] = value
    if 'id' in table.dtype.names:
        table['id'] = [0, 1, 2]
    scene = decode(table, types)
    assert (scene.obstacles.ids, scene.dropped) == (('0', '2'), {'not_finite': 1})


def test_the_last_finite_row_of_an_id_is_used():
    table = np.zeros(5, dtype=FULL)
    table['id'] = [3, 1, 3, 2, 1]
    table['x'] = [0, 1, 2, 3, math.nan]
    scene = decode(table)
    assert (scene.obstacles.ids, scene.obstacles.centre[:, 0].tolist()) == (('1', '3', '2'), [1, 2, 3])
    assert scene.dropped == {'not_finite': 1, 'duplicate_id': 1}


ROWS = obstacle_table([(1, 2, 3, 4)] * 2)
ZEROS = np.zeros(2, dtype=FULL)


@pytest.mark.parametrize(
    ('table', 'changes', 'words'),
    [
        (with_cells(FULL, radius=-0.5), {}, 'radius[1]: expected a number in [0, 10000] m, got -0.5'),
        (with_cells(FULL, radius=2e4), {}, 'radius[1]: expected a number in [0, 10000] m, got 20000'),
        (with_cells(FULL, radius_stddev=-0.5), {}, 'radius_stddev[1]: expected a number in [0, 10000] m, got -0.5'),
        (with_cells(FULL, x=-2e4), {}, 'x[1]: expected a number in [-10000, 10000] m, got -20000'),
        (with_cells(FULL, vz=2e4), {}, 'vz[1]: expected a number in [-10000, 10000] m/s, got 20000'),
        (with_cells(BOX, size_x=-0.5, size_y=1), {}, 'size_x[1]: expected a number in [0, 10000] m, got -0.5'),
        (with_cells(BOX, size_x=1, size_y=2e4), {}, 'size_y[1]: expected a number in [0, 10000] m, got 20000'),
        (with_cells(BOX, size_x=1, yaw=-2e4), {}, 'yaw[1]: expected a number in [-10000, 10000] rad, got -20000'),
        (with_cells(BOX, yaw=1), {}, 'radius[1]: expected a number > 0 m where size_x and size_y are 0, got 0'),
        (without_column('x'), {}, 'fields: expected a field x (needed are x, y, z, radius), got y, z, radius'),
        (without_column('z'), {}, 'fields: expected a field z (needed are x, y, z, radius), got x, y, radius'),
        (without_column('radius'), {}, 'fields: expected a field radius (needed are x, y, z, radius), got x, y, z'),
        (ROWS, {'data': b'\0' * 31}, 'data: expected 32 bytes (1 rows of row_step 32 and 2 points of point_step 16), got 31'),
        (ROWS, {'width': 4_000_000_000}, 'height * width: expected at most 20000 obstacles, got 4000000000'),
        (ROWS, {'width': 3}, 'data: expected 48 bytes'),
        (ROWS, {'height': 0}, 'data: expected 0 bytes'),
        (ROWS, {'height': 2, 'width': 1, 'row_step': 8}, 'data: expected 32 bytes'),
        (ROWS, {'point_step': 0, 'data': b''}, 'fields[x].offset: expected 4 bytes inside point_step 0, got 0'),
        (ROWS, {'point_step': 12, 'data': b'\0' * 24}, 'fields[radius].offset: expected 4 bytes inside point_step 12, got 12'),
        (ROWS, {'fields': []}, 'got no fields'),
        (ROWS, {'stamp_ns': -SECOND}, 'header.stamp.sec: expected at least 0, got -1'),
        (ZEROS, with_field('x', datatype=5), 'fields[x].datatype: expected 7 or 8, got 5'),
        (ZEROS, with_field('radius', datatype=0), 'fields[radius].datatype: expected 7 or 8, got 0'),
        (ZEROS, with_field('id', datatype=7), 'fields[id].datatype: expected an integer (1-6), got 7'),
        (ZEROS, with_field('id', datatype=99), 'fields[id].datatype: expected an integer (1-6), got 99'),
        (ZEROS, with_field('y', count=3), 'fields[y].count: expected 1, got 3'),
        (ZEROS, with_field('z', name='x'), 'fields: expected a field z'),
        (ZEROS, with_field('radius_stddev', name='x'), 'fields: expected one field x, got 2'),
    ],
)
def test_a_wrong_table_is_refused(table, changes, words):
    with pytest.raises(MessageError, match=re.escape(words)):
        decode(table, **changes)


def test_the_number_of_obstacles_is_bounded(monkeypatch):
    scene = decode(np.zeros(MAX_ROWS, dtype=FULL[:4]), stamp_ns=0)
    assert (len(scene.obstacles), scene.stamp_ns) == (MAX_ROWS, 0)
    monkeypatch.setattr(decode_objects, 'MAX_ROWS', 3)
    markers = after(marker_array(BAGS, *[marker(BAGS, id=i) for i in range(3)]))
    with pytest.raises(MessageError, match='markers: expected at most 3 obstacles held at a time, got 4'):
        markers.with_markers(marker_array(BAGS, marker(BAGS, id=3)), SECOND, 'xy')


NAMES = ['x', 'y', 'z', 'radius', 'radius_stddev', 'id', 'vx', 'size_x', 'yaw', 'rgb']
fields = st.lists(st.tuples(st.sampled_from(NAMES), st.integers(0, 24), st.integers(0, 9), st.integers(0, 2)), max_size=7)
sizes = st.fixed_dictionaries(
    {
        'height': st.integers(0, 4),
        'width': st.integers(0, 6),
        'point_step': st.integers(0, 24),
        'row_step': st.integers(0, 48),
        'is_bigendian': st.booleans(),
    }
)


@given(fields, st.binary(max_size=96), sizes)
def test_any_bytes_are_decoded_or_refused(layout, data, given_sizes):
    keys = 'name', 'offset', 'datatype', 'count'
    made = [BAGS.make('sensor_msgs/msg/PointField', **dict(zip(keys, each, strict=True))) for each in layout]
    try:
        scene = decode_point_cloud(BAGS.make('sensor_msgs/msg/PointCloud2', fields=made, data=data, **given_sizes), 'xy')
    except MessageError:
        return
    assert len(scene.obstacles) + sum(scene.dropped.values()) == given_sizes['height'] * given_sizes['width']
    assert np.isfinite(scene.obstacles.centre).all()
    assert (scene.obstacles.radius >= 0).all()


def after(*messages, now_ns=SECOND):
    scene = ObjectTable()
    for message in messages:
        scene = scene.with_markers(message, now_ns, 'xy')
    return scene


def ids(scene, now_ns=SECOND):
    return scene.obstacles(now_ns, 0.0).ids


@both_kinds
def test_spheres_and_cylinders_become_circles(types):
    sphere = marker(types, (1, 2, 3), (0.1, 0.2, 0.4), id=1, frame_id='base', stamp_ns=5 * SECOND)
    cylinder = marker(types, (4, 5, 6), (0.1, 0.2, 0.4), id=2, type=3, ns='b', frame_id='base', stamp_ns=4 * SECOND)
    scene = after(marker_array(types, sphere, cylinder))
    obstacles = scene.obstacles(5 * SECOND, 0.01)
    assert (scene.frame_id, scene.stamp_ns, dict(scene.dropped)) == ('base', 5 * SECOND, {})
    assert obstacles.ids == ('a/1', 'b/2')
    np.testing.assert_array_equal(obstacles.centre, [[1, 2], [4, 5]])
    np.testing.assert_array_equal(obstacles.radius, [0.2, 0.1])
    np.testing.assert_array_equal(obstacles.radius_stddev, [0.01, 0.01])
    assert not obstacles.velocity.any()


@pytest.mark.parametrize('plane', ['xy', 'xz', 'yz'])
def test_a_tilted_cube_covers_its_projected_points_and_no_more(plane):
    rng = np.random.default_rng(3)
    for i in range(20):
        quaternion, size, centre = rng.normal(size=4) * (i > 0), rng.uniform(0.05, 0.4, 3), rng.normal(size=3)
        cube = marker(BAGS, centre, size, type=1, turned=dict(zip('xyzw', quaternion, strict=True)))
        table = ObjectTable().with_markers(marker_array(BAGS, cube), SECOND, plane).obstacles(SECOND, 0.0)
        assert 4 <= table.corners[0] <= 6 and table.radius[0] == 0.0
        # an orientation that was never set is none
        rotation = Rotation.from_quat(quaternion).as_matrix() if i else np.eye(3)
        inside = project(centre + rng.uniform(-0.5, 0.5, (500, 3)) * size @ rotation.T, plane)[0]
        assert measure_offsets(inside, table)[1].max() < 1e-12
        signs = np.array([*product((-0.5, 0.5), repeat=3)])
        corners = project(centre + signs * size @ rotation.T, plane)[0]
        polygon = table.centre[0] + table.vertices[0, : table.corners[0]]
        assert np.abs(polygon[:, None] - corners).max(axis=2).min(axis=1).max() < 1e-12


def test_add_replaces_and_delete_removes():
    first = marker_array(BAGS, marker(BAGS, (1, 0, 0), id=1), marker(BAGS, (2, 0, 0), id=2))
    moved = marker_array(BAGS, marker(BAGS, (3, 0, 0), id=1))
    assert after(marker_array(BAGS)).obstacles(0, 0.0).centre.shape == (0, 2)
    scene = after(first, moved)
    assert ids(scene) == ('a/1', 'a/2')
    np.testing.assert_array_equal(scene.obstacles(0, 0.0).centre[:, 0], [3, 2])
    assert ids(after(first, marker_array(BAGS, marker(BAGS, id=1, action=2)))) == ('a/2',)
    assert ids(after(first, marker_array(BAGS, marker(BAGS, id=9, action=2)))) == ('a/1', 'a/2')
    ordered = marker_array(BAGS, marker(BAGS, (1, 0, 0), id=1), marker(BAGS, id=1, action=2), marker(BAGS, (5, 0, 0), id=1))
    np.testing.assert_array_equal(after(ordered).obstacles(0, 0.0).centre, [[5, 0]])
    other = after(first, marker_array(BAGS, marker(BAGS, id=1, type=0)))
    assert ids(other) == ('a/2',) and other.dropped == {'not_a_shape': 1}, 'so does another type'
    scene.with_markers(marker_array(BAGS, marker(BAGS, action=3, ns='')), SECOND, 'xy')
    assert ids(scene) == ('a/1', 'a/2'), 'an update does not change the old table'
    found = ids(after(marker_array(BAGS, *[marker(BAGS, ns=ns) for ns in ('a;b', 'a%3Bb', 'a,b')])))
    assert len(set(found)) == 3 and not any(';' in name for name in found), 'ids contain no separator and remain distinct'


@pytest.mark.parametrize(('ns', 'left'), [('', ('b/2',)), ('a', ('c/3', 'b/2')), ('zz', ('a/1', 'c/3', 'b/2'))])
def test_delete_all_empties_its_namespace_or_everything(ns, left):
    first = marker_array(BAGS, marker(BAGS, id=1, ns='a'), marker(BAGS, id=3, ns='c'))
    assert ids(after(first, marker_array(BAGS, marker(BAGS, action=3, ns=ns), marker(BAGS, id=2, ns='b')))) == left


def test_a_lifetime_starts_at_the_stamp_or_now_if_the_marker_has_none_and_the_time_is_known():
    scene = after(marker_array(BAGS, marker(BAGS, id=1, lifetime=0.5, stamp_ns=4 * SECOND), marker(BAGS, id=2)))
    for now_ns, expected in ((int(4.5 * SECOND) - 1, ('a/1', 'a/2')), (int(4.5 * SECOND), ('a/2',))):
        assert ids(scene, now_ns) == expected and scene.count_expired(now_ns) == 2 - len(expected)
    assert list(scene.with_markers(marker_array(BAGS), 5 * SECOND, 'xy').held) == [('a', 2)]
    message = marker_array(BAGS, marker(BAGS, lifetime=0.5, stamp_ns=0))
    for known_ns, expected in ((7 * SECOND, [0, 1]), (0, [0, 0])):
        scene = after(message, now_ns=known_ns)
        assert [scene.count_expired(int(seconds * SECOND)) for seconds in (7.4, 7.5)] == expected
        assert scene.stamp_ns == 0


@both_kinds
@pytest.mark.parametrize('value', [math.nan, math.inf])
@pytest.mark.parametrize('where', ['position', 'scale'])
def test_a_marker_that_is_not_finite_does_not_replace_the_old_one(types, value, where):
    bad = marker(types, **{where: (0.1, value, 0.1)})
    scene = after(marker_array(types, marker(types, (1, 0, 0))), marker_array(types, bad, marker(types, (2, 0, 0), id=5)))
    np.testing.assert_array_equal(scene.obstacles(0, 0.0).centre[:, 0], [1, 2])
    assert scene.dropped == {'not_finite': 1}
    scene = after(marker_array(types, *[marker(types, id=kind, type=kind, turned={'w': value}) for kind in (1, 2)]))
    assert ids(scene) == ('a/2',) and scene.dropped == {'not_finite': 1}, 'a sphere needs no orientation'


@both_kinds
@pytest.mark.parametrize(
    ('changes', 'words'),
    [
        ({'action': 1}, 'markers[1].action: expected ADD (0), DELETE (2) or DELETEALL (3), got 1'),
        ({'scale': (0.1, -0.1, 0.1)}, 'markers[1].scale.y: expected a size in [0, 10000] m, got -0.1'),
        ({'scale': (2e4, 0.1, 0.1)}, 'markers[1].scale.x: expected a size in [0, 10000] m, got 20000'),
        ({'position': (0, 0, 2e4)}, 'markers[1].pose.position.z: expected a number from -10000 to 10000 [m], got 20000'),
        ({'type': 1, 'scale': (0.1, -0.1, 0.1)}, 'markers[1].scale.y: expected a size in [0, 10000] m, got -0.1'),
        ({'type': 1, 'scale': (0, 0, 1)}, 'markers[1].scale: expected a size > 0 m along an axis of the plane, got 0 x 0 x 1'),
        ({'lifetime': -1}, 'markers[1].lifetime: expected at least 0 s (0: no end), got -1 s'),
        ({'stamp_ns': -SECOND}, 'markers[1].header.stamp.sec: expected at least 0, got -1'),
        ({'frame_id': 'base'}, "markers[1].header.frame_id: expected 'world', as the other markers, got 'base'"),
    ],
)
def test_a_message_with_a_wrong_marker_is_refused(types, changes, words):
    scene = after(marker_array(types, marker(types, id=7)))
    with pytest.raises(MessageError, match=re.escape(words)):
        scene.with_markers(marker_array(types, marker(types, id=1), marker(types, id=2, **changes)), SECOND, 'xy')
    assert ids(scene) == ('a/7',)
