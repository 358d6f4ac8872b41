# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Decoding of obstacle markers: the table is updated as RViz updates its own."""

from __future__ import annotations

import math
import re
from itertools import product

import numpy as np
import pytest
from message_helpers import SECOND, both_kinds, marker, marker_array, message_types
from scipy.spatial.transform import Rotation

from foc_ros.core.errors import MessageError
from foc_ros.core.obstacles.geometry import measure_offsets
from foc_ros.ros.messages import decode_objects
from foc_ros.ros.messages.decode_objects import MarkerTable
from foc_ros.ros.messages.plane import project
from foc_ros.ros.messages.types import MessageTypes

BAGS = message_types('rosbags')


def after(*messages: object, now_ns: int = SECOND, stddev: float = 0.0) -> MarkerTable:
    scene = MarkerTable()
    for message in messages:
        scene = scene.with_message(message, now_ns, 'xy', stddev)
    return scene


def ids(scene: MarkerTable, now_ns: int = SECOND) -> tuple[str, ...]:
    return scene.obstacles(now_ns).ids


@both_kinds
def test_spheres_and_cylinders_become_circles(types: MessageTypes) -> None:
    sphere = marker(types, (1, 2, 3), (0.1, 0.2, 0.4), id=1, frame_id='base', stamp_ns=5 * SECOND)
    cylinder = marker(types, (4, 5, 6), (0.1, 0.2, 0.4), id=2, type=3, ns='b', frame_id='base', stamp_ns=4 * SECOND)
    scene = after(marker_array(types, sphere, cylinder), stddev=0.01)
    obstacles = scene.obstacles(5 * SECOND)
    assert (scene.frame_id, scene.stamp_ns, dict(scene.dropped)) == ('base', 5 * SECOND, {})
    assert obstacles.ids == ('a/1', 'b/2')
    np.testing.assert_array_equal(obstacles.centre, [[1, 2], [4, 5]])
    np.testing.assert_array_equal(obstacles.radius, [0.2, 0.1])
    np.testing.assert_array_equal(obstacles.radius_stddev, [0.01, 0.01])
    assert not obstacles.velocity.any()


@pytest.mark.parametrize('plane', ['xy', 'xz', 'yz'])
def test_a_tilted_cube_covers_its_projected_points_and_no_more(plane: str) -> None:
    rng = np.random.default_rng(3)
    for i in range(20):
        quaternion, size, centre = rng.normal(size=4) * (i > 0), rng.uniform(0.05, 0.4, 3), rng.normal(size=3)
        cube = marker(BAGS, centre, size, type=1, turned=dict(zip('xyzw', quaternion, strict=True)))
        table = MarkerTable().with_message(marker_array(BAGS, cube), SECOND, plane, 0.0).obstacles(SECOND)
        assert 4 <= table.corners[0] <= 6 and table.radius[0] == 0.0
        # an orientation that was never set is none
        rotation = Rotation.from_quat(quaternion).as_matrix() if i else np.eye(3)
        inside = project(centre + rng.uniform(-0.5, 0.5, (500, 3)) * size @ rotation.T, plane)[0]
        assert measure_offsets(inside, table)[1].max() < 1e-12
        signs = np.array([*product((-0.5, 0.5), repeat=3)])
        corners = project(centre + signs * size @ rotation.T, plane)[0]
        polygon = table.centre[0] + table.vertices[0, : table.corners[0]]
        assert np.abs(polygon[:, None] - corners).max(axis=2).min(axis=1).max() < 1e-12


def test_add_replaces_and_delete_removes() -> None:
    first = marker_array(BAGS, marker(BAGS, (1, 0, 0), id=1), marker(BAGS, (2, 0, 0), id=2))
    moved = marker_array(BAGS, marker(BAGS, (3, 0, 0), id=1))
    assert after(marker_array(BAGS)).obstacles(0).centre.shape == (0, 2)
    scene = after(first, moved)
    assert ids(scene) == ('a/1', 'a/2')
    np.testing.assert_array_equal(scene.obstacles(0).centre[:, 0], [3, 2])
    assert ids(after(first, marker_array(BAGS, marker(BAGS, id=1, action=2)))) == ('a/2',)
    assert ids(after(first, marker_array(BAGS, marker(BAGS, id=9, action=2)))) == ('a/1', 'a/2')
    ordered = marker_array(BAGS, marker(BAGS, (1, 0, 0), id=1), marker(BAGS, id=1, action=2), marker(BAGS, (5, 0, 0), id=1))
    np.testing.assert_array_equal(after(ordered).obstacles(0).centre, [[5, 0]])
    scene.with_message(marker_array(BAGS, marker(BAGS, action=3, ns='')), SECOND, 'xy', 0.0)
    assert ids(scene) == ('a/1', 'a/2'), 'an update does not change the old table'
    with pytest.raises(TypeError):
        scene.markers['a', 1] = None  # type: ignore[index]


@pytest.mark.parametrize(('ns', 'left'), [('', ('b/2',)), ('a', ('c/3', 'b/2')), ('zz', ('a/1', 'c/3', 'b/2'))])
def test_delete_all_empties_its_namespace_or_everything(ns: str, left: tuple[str, ...]) -> None:
    first = marker_array(BAGS, marker(BAGS, id=1, ns='a'), marker(BAGS, id=3, ns='c'))
    assert ids(after(first, marker_array(BAGS, marker(BAGS, action=3, ns=ns), marker(BAGS, id=2, ns='b')))) == left


def test_a_lifetime_starts_at_the_stamp() -> None:
    scene = after(marker_array(BAGS, marker(BAGS, id=1, lifetime=0.5, stamp_ns=4 * SECOND), marker(BAGS, id=2)))
    assert scene.find_unchanged_interval(4 * SECOND) == (-math.inf, 4.5 * SECOND)
    assert scene.find_unchanged_interval(5 * SECOND) == (4.5 * SECOND, math.inf)
    assert ids(scene, int(4.5 * SECOND) - 1) == ('a/1', 'a/2')
    assert ids(scene, int(4.5 * SECOND)) == ('a/2',)
    later = scene.with_message(marker_array(BAGS), 5 * SECOND, 'xy', 0.0)
    assert list(later.markers) == [('a', 2)]
    assert later.find_unchanged_interval(5 * SECOND) == (-math.inf, math.inf)


def test_the_lifetime_of_an_unstamped_marker_starts_now_if_the_time_is_known() -> None:
    message = marker_array(BAGS, marker(BAGS, lifetime=0.5, stamp_ns=0))
    assert after(message, now_ns=7 * SECOND).find_unchanged_interval(7 * SECOND) == (-math.inf, 7.5 * SECOND)
    assert after(message, now_ns=0).find_unchanged_interval(0) == (-math.inf, math.inf)
    assert after(message).stamp_ns == 0


@both_kinds
@pytest.mark.parametrize('value', [math.nan, math.inf])
@pytest.mark.parametrize('where', ['position', 'scale'])
def test_a_marker_that_is_not_finite_does_not_replace_the_old_one(types: MessageTypes, value: float, where: str) -> None:
    bad = marker(types, **{where: (0.1, value, 0.1)})
    scene = after(marker_array(types, marker(types, (1, 0, 0))), marker_array(types, bad, marker(types, (2, 0, 0), id=5)))
    np.testing.assert_array_equal(scene.obstacles(0).centre[:, 0], [1, 2])
    assert scene.dropped == {'not_finite': 1}
    scene = after(marker_array(types, *[marker(types, id=kind, type=kind, turned={'w': value}) for kind in (1, 2)]))
    assert ids(scene) == ('a/2',) and scene.dropped == {'not_finite': 1}, 'a sphere needs no orientation'


def test_another_type_replaces_an_obstacle_and_is_counted() -> None:
    scene = after(marker_array(BAGS, marker(BAGS, id=1), marker(BAGS, id=2)), marker_array(BAGS, marker(BAGS, id=1, type=0)))
    assert ids(scene) == ('a/2',)
    assert scene.dropped == {'not_a_shape': 1}


@both_kinds
@pytest.mark.parametrize(
    ('changes', 'words'),
    [
        ({'action': 1}, 'markers[1].action: expected ADD (0), DELETE (2) or DELETEALL (3), got 1'),
        ({'scale': (0.1, -0.1, 0.1)}, 'markers[1].scale.y: expected a size in [0, 10000] m, got -0.1'),
        ({'scale': (2e4, 0.1, 0.1)}, 'markers[1].scale.x: expected a size in [0, 10000] m, got 20000'),
        ({'position': (0, 0, 2e4)}, 'markers[1].pose.position.z: expected a coordinate within 10000 m of the origin, got 20000'),
        ({'type': 1, 'scale': (0.1, -0.1, 0.1)}, 'markers[1].scale.y: expected a size in [0, 10000] m, got -0.1'),
        ({'type': 1, 'scale': (0, 0, 1)}, 'markers[1].scale: expected a size > 0 m along an axis of the plane, got 0 x 0 x 1'),
        ({'lifetime': -1}, 'markers[1].lifetime: expected at least 0 s (0: no end), got -1 s'),
        ({'stamp_ns': -SECOND}, 'markers[1].header.stamp.sec: expected at least 0, got -1'),
        ({'frame_id': 'base'}, "markers[1].header.frame_id: expected 'world', as the other markers, got 'base'"),
    ],
)
def test_a_message_with_a_wrong_marker_is_refused(types: MessageTypes, changes: dict[str, object], words: str) -> None:
    scene = after(marker_array(types, marker(types, id=7)))
    with pytest.raises(MessageError, match=re.escape(words)):
        scene.with_message(marker_array(types, marker(types, id=1), marker(types, id=2, **changes)), SECOND, 'xy', 0.0)
    assert ids(scene) == ('a/7',)


def test_the_number_of_markers_is_bounded(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(decode_objects, 'MAX_ROWS', 3)
    scene = after(marker_array(BAGS, *[marker(BAGS, id=i) for i in range(3)]))
    with pytest.raises(MessageError, match='markers: expected at most 3 obstacles held at a time, got 4'):
        scene.with_message(marker_array(BAGS, marker(BAGS, id=3)), SECOND, 'xy', 0.0)


def test_ids_contain_no_separator_and_remain_distinct() -> None:
    names = ['a;b', 'a%3Bb', 'a,b']
    found = ids(after(marker_array(BAGS, *[marker(BAGS, ns=ns) for ns in names])))
    assert len(set(found)) == 3
    assert not any(';' in name for name in found)
