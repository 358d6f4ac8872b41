# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Messages in other frames: refused without tf2, and transformed with it (here with a substitute for tf2)."""

import re
import sys
from types import SimpleNamespace

import ros_required  # noqa: F401
import numpy as np
import pytest
from message_helpers import SECOND, cloud, marker, marker_array, obstacle_table, pose_array, pose_stamped, transform
from node_helpers import ROWS, TYPES, Bench, begin, figures
from scipy.spatial.transform import Rotation

from foc_ros.core.errors import MessageError
from foc_ros.core.obstacles.geometry import measure_offsets
from foc_ros.core.obstacles.polygons import make_box_polygon
from foc_ros.ros.messages.decode_point_cloud import decode_point_cloud
from foc_ros.ros.messages.plane import Transform
from foc_ros.ros.transforms import TransformTree, TransformUnavailableError

BOX = [(name, '<f8') for name in ('x', 'y', 'z', 'radius', 'size_x', 'size_y', 'yaw')]


class TransformException(Exception):
    """What the exceptions of tf2 have in common."""


class Buffer(TransformTree):
    """A substitute for the buffer of tf2, with a camera that stands still at (1, 0, 0)."""

    def __init__(self, node):
        super().__init__()
        self.set_transform_static(camera(1.0), '')

    def lookup_transform(self, target, source, time):
        try:
            found = self.look_up(target, source, time.nanoseconds)
        except TransformUnavailableError as error:
            raise TransformException(str(error)) from None
        rotation = Rotation.from_matrix(found.rotation).as_quat()
        return transform(TYPES, source, found.translation, rotation, found.stamp_ns, target)

    def set_transform(self, transform, authority):
        self.add(SimpleNamespace(transforms=[transform]), is_static=False)

    def set_transform_static(self, transform, authority):
        self.add(SimpleNamespace(transforms=[transform]), is_static=True)


def camera(x, stamp_ns=0):
    """Return the transform of a camera at (x, 0, 0) in the world, rotated by 90 degrees to the left."""
    return transform(TYPES, 'camera', (x, 0.0, 0.0), (0.0, 0.0, np.sqrt(0.5), np.sqrt(0.5)), stamp_ns)


@pytest.fixture
def tf2(monkeypatch):
    module = SimpleNamespace(Buffer=Buffer, TransformListener=lambda buffer, node: None, TransformException=TransformException)
    monkeypatch.setitem(sys.modules, 'tf2_ros', module)


def seen(bench):
    return bench.node.pipeline.scene.obstacles(10 * SECOND).centre


@pytest.mark.usefixtures('tf2')
def test_every_input_is_transformed_into_the_working_frame(ros):
    bench = begin(ros, 1)
    columns = [(name, '<f8') for name in ('x', 'y', 'z', 'radius', 'vx', 'vy', 'vz')]
    moving = obstacle_table([(0.2, 0.3, 0.4, 0.05, 1.0, 0.0, 0.0)], columns)
    bench.deliver('obstacles', cloud(TYPES, moving, 10 * SECOND, 'camera'))
    np.testing.assert_allclose(seen(bench), [[0.7, 0.2]])
    held = bench.node.pipeline.scene.sources['cloud'].obstacles
    np.testing.assert_allclose(held.velocity, [[0.0, 1.0]], atol=1e-12)
    assert held.radius.tolist() == [0.05]
    bench.deliver('obstacle_markers', marker_array(TYPES, marker(TYPES, (0.1, 0.0, 0.0), frame_id='camera'), marker(TYPES, id=9)))
    bench.deliver('obstacle_markers', marker_array(TYPES, marker(TYPES, id=77, action=2, frame_id='')))
    np.testing.assert_allclose(seen(bench)[1:], [[1.0, 0.1], [0.0, 0.0]], atol=1e-12)
    bench.deliver('goals', pose_array(TYPES, [(0.0, 0.5, 0.0)], 'camera'))
    np.testing.assert_allclose(bench.node.pipeline.scene.goals, [[0.5, 0.0]], atol=1e-12)
    bench.deliver('goal_pose', pose_stamped(TYPES, (0.0, 0.4, 0.0), SECOND, 'camera'))
    np.testing.assert_allclose(bench.node.pipeline.scene.goals, [[0.6, 0.0]], atol=1e-12)
    stamp_ns = round(10.02 * SECOND)
    bench.deliver('hand_pose', pose_stamped(TYPES, (0.0, 1.0, 0.25), stamp_ns, 'camera'))
    assert bench.node.pipeline.hand_state.stamp_ns == stamp_ns
    assert bench.node.intake.sample.height == 0.25
    assert {message.header.frame_id for message in bench.wait_for('prediction', 2)} == {'world'}

    bench.deliver('obstacles', cloud(TYPES, obstacle_table([(0.2, 0.3, 0.4, 0.0, 0.2, 0.1, 0.3)], BOX), 10 * SECOND, 'camera'))
    turned = {'z': np.sin(0.15), 'w': np.cos(0.15)}
    cube = marker(TYPES, (0.1, 0.0, 0.0), (0.2, 0.1, 0.05), type=1, frame_id='camera', turned=turned)
    bench.deliver('obstacle_markers', marker_array(TYPES, marker(TYPES, action=3, ns=''), cube))
    obstacles = bench.node.pipeline.scene.obstacles(10 * SECOND)
    np.testing.assert_allclose(obstacles.centre, [[0.7, 0.2], [1.0, 0.1]], atol=1e-12)
    expected = make_box_polygon((0.2, 0.1), 0.3 + np.pi / 2)
    for row in range(2):
        np.testing.assert_allclose(measure_offsets(obstacles.centre[row] + expected, obstacles)[1][:, row], 0.0, atol=2e-9)


@pytest.mark.usefixtures('tf2')
def test_what_cannot_be_transformed_is_refused_with_its_reason(ros):
    bench = begin(ros, 1)
    row, scene = (0.2, 0.3, 0.4, 0.0, 0.2, 0.1, 0.3), bench.node.pipeline.scene
    for message, words in (
        (
            cloud(TYPES, obstacle_table([row[:-1]], BOX[:-1]), 10 * SECOND, 'camera'),
            'fields: expected a field yaw, because the transform turns the boxes',
        ),
        (cloud(TYPES, obstacle_table(ROWS), 10 * SECOND, 'camera', data=b'abc'), 'obstacles: data: expected 16 bytes'),
        (
            cloud(TYPES, obstacle_table(ROWS), 10 * SECOND, 'moon'),
            "the working frame 'world', got 'moon'; no transform to world: moon and world are not connected",
        ),
    ):
        bench.deliver('obstacles', message)
        assert words in figures(bench.health())['last refusal']
        assert bench.node.pipeline.scene is scene
    turn = Transform(Rotation.from_euler('z', 90, degrees=True).as_matrix(), np.zeros(3))
    words = 'fields[size_x]: expected boxes that the transform leaves in the task plane, got a tilt of 1'
    with pytest.raises(MessageError, match=re.escape(words)):
        decode_point_cloud(cloud(TYPES, obstacle_table([row], BOX)), 'xz', lambda _: ('world', turn))


HAND = [pose_stamped(TYPES, (0.0, 0.01 * i, 0.0), 10 * SECOND + i * SECOND // 100, 'camera') for i in range(8)]
"""Hand poses in the frame of a camera."""


def test_a_transform_that_arrives_after_its_message_is_awaited(ros, tf2):
    """Obstacles and hand in the frame of a camera that moves: every message is taken with the transform for its stamp."""
    bench = Bench(ros, frame_id='world', frames__tolerance_s=10.0)
    tf = bench.node._tf
    tf.set_transform(camera(1.0, 9 * SECOND), '')
    for i, pose in enumerate(HAND):
        stamp_ns = 10 * SECOND + i * SECOND // 100
        bench.send('obstacles', cloud(TYPES, obstacle_table([(0.2, 0.03 * i, 0.0, 0.03)]), stamp_ns, 'camera'))
        bench.send('hand_pose', pose)
        ros.spin_until(lambda: set(bench.node._transforms.roles) == {'obstacles', 'hand_pose'}, 'messages that are held')
        tf.set_transform(camera(1.0 + 0.03 * i, stamp_ns), '')
        np.testing.assert_allclose(seen(bench), [[1.0, 0.2]], atol=1e-12)
        np.testing.assert_allclose(bench.node.intake.sample.position, [1.0 + 0.03 * i - 0.01 * i, 0.0], atol=1e-12)
    status = figures(bench.health())
    assert (status['obstacles refused'], status['hand_pose refused']) == ('0 of 8', '0 of 8')
    assert 'count transform_newest_obstacles' not in status


def test_without_a_transform_for_its_stamp_the_newest_one_is_taken_and_counted(ros, tf2):
    bench = Bench(ros, frame_id='world', frames__tolerance_s=0.05)
    bench.node._tf.set_transform(camera(1.0, 10 * SECOND), '')
    for i, expected in ((4, '0 of 1'), (6, '1 of 2')):
        rows = obstacle_table([(0.2, 0.1, 0.0, 0.03)])
        bench.deliver('obstacles', cloud(TYPES, rows, 10 * SECOND + i * SECOND // 100, 'camera'))
        status = figures(bench.health())
        assert (status['obstacles refused'], status['count transform_newest_obstacles']) == (expected, '1')
    assert 'the newest one is 0.06 s older than the message (frames.tolerance_s is 0.05)' in status['last refusal']
