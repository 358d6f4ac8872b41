# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The real tf2, where it is installed: transforms over DDS that arrive after the messages that need them.

`scripts/tf2_check` compiles tf2 where ROS 2 is not installed, and runs this file.
"""

from types import SimpleNamespace

import ros_required  # noqa: F401
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

tf2_ros = pytest.importorskip('tf2_ros', reason='optional message package: tf2_ros', exc_type=ImportError)

from message_helpers import SECOND, cloud, obstacle_table, transform  # noqa: E402
from node_helpers import TYPES, Bench, figures  # noqa: E402
from rclpy.time import Time  # noqa: E402
from rosgraph_msgs.msg import Clock  # noqa: E402

from foc_ros.ros.transforms import TransformTree, TransformUnavailableError  # noqa: E402


def test_a_simulation_that_starts_again_forgets_its_transforms(ros):
    """In the second round the camera is elsewhere: the transforms of the first, newer by their stamps, are not used."""
    bench = Bench(ros, outputs=[], frame_id='world', frames__tolerance_s=10.0, use_sim_time=True)
    broadcaster, clock = tf2_ros.TransformBroadcaster(bench.player), bench.player.create_publisher(Clock, '/clock', 10)
    for publisher in (broadcaster.pub_tf, clock):
        ros.spin_until(lambda publisher=publisher: publisher.get_subscription_count() > 0, 'the listener')
    rows, node_clock = obstacle_table([(0.2, 0.0, 0.0, 0.03)]), bench.node.get_clock()
    for turn in range(2):
        for i in range(20):
            stamp_ns = 100 * SECOND + i * SECOND // 10
            clock.publish(Clock(clock=Time(nanoseconds=stamp_ns).to_msg()))
            ros.spin_until(lambda now=stamp_ns: node_clock.now().nanoseconds == now, 'the clock of the node')
            bench.send('obstacles', cloud(TYPES, rows, stamp_ns, 'camera'))
            ros.spin_until(lambda: bench.node._transforms.roles == ['obstacles'], 'a message that is held')
            broadcaster.sendTransform(transform(TYPES, 'camera', (turn + 0.01 * i, 0.0, 0.0), stamp_ns=stamp_ns))
            ros.spin_until(lambda: not bench.node._transforms.roles, 'the transform')
            centre = bench.node.pipeline.scene.sources['cloud'].obstacles.centre
            np.testing.assert_allclose(centre, [[0.2 + turn + 0.01 * i, 0.0]])
    assert figures(bench.health())['obstacles refused'] == '0 of 40'


def test_the_transforms_of_a_recording_are_those_of_tf2():
    """Random trees of frames, static and moving, looked up at random stamps."""
    generator = np.random.default_rng(0)
    for _ in range(20):
        tree, buffer = TransformTree(), tf2_ros.Buffer()
        names = [f'frame{i}' for i in range(6)]
        for i in range(1, 6):
            parent, is_static = names[generator.integers(i)], generator.random() < 0.3
            for stamp_ns in np.sort(generator.integers(1, 5 * SECOND, 1 if is_static else 8)).tolist():
                turn = Rotation.random(rng=generator).as_quat()
                message = transform(TYPES, names[i], generator.normal(size=3), turn, stamp_ns, parent)
                tree.add(SimpleNamespace(transforms=[message]), is_static=is_static)
                (buffer.set_transform_static if is_static else buffer.set_transform)(message, '')
        for stamp_ns in [0, *generator.integers(1, 5 * SECOND, 20).tolist()]:
            target, source = generator.choice(names, 2).tolist()
            try:
                expected = buffer.lookup_transform(target, source, Time(nanoseconds=stamp_ns))
            except tf2_ros.TransformException:
                with pytest.raises(TransformUnavailableError):
                    tree.look_up(target, source, stamp_ns)
                continue
            found = tree.look_up(target, source, stamp_ns)
            assert found.stamp_ns == Time.from_msg(expected.header.stamp).nanoseconds
            wanted = expected.transform
            np.testing.assert_allclose(found.translation, [getattr(wanted.translation, axis) for axis in 'xyz'], atol=1e-9)
            turn = Rotation.from_quat([getattr(wanted.rotation, axis) for axis in 'xyzw'])
            assert (turn.inv() * Rotation.from_matrix(found.rotation)).magnitude() < 1e-9
