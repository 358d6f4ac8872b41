# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Messages made for rclpy and for rosbags have the same bytes, and stamps stay in range."""

from __future__ import annotations

import numpy as np
import pytest
from ros_helpers import require_ros
from rosbags.typesys import Stores, get_typestore

from foc_ros.ros.messages import types as conversion_types
from foc_ros.ros.messages.types import MessageTypes, RclpyTypes, RosbagsTypes

STORE = get_typestore(Stores.ROS2_JAZZY)


def samples(types: MessageTypes) -> list[object]:
    """Return one message for each kind of field, with numbers of the wrong type."""
    point = types.make('geometry_msgs/msg/Point', x=1, y=np.float32(0.5), z=np.int64(-3))
    quaternion = types.make('geometry_msgs/msg/Quaternion', x=0, y=0, z=0, w=1)
    pose = types.make('geometry_msgs/msg/Pose', position=point, orientation=quaternion)
    header = conversion_types.make_header(types, 3_000_000_004, 'world')
    key = types.make('diagnostic_msgs/msg/KeyValue', key='k', value='v')
    positions = np.arange(2, dtype=np.float32)
    return [
        point,
        types.make('geometry_msgs/msg/PoseWithCovariance', pose=pose, covariance=range(36)),
        types.make('std_msgs/msg/Float64MultiArray', data=[1, 2, 3]),
        types.make('sensor_msgs/msg/JointState', name=['a', 'b'], position=positions, velocity=[1], effort=[5]),
        types.make('sensor_msgs/msg/PointCloud2', data=b'\x01\x02', header=header),
        types.make('diagnostic_msgs/msg/DiagnosticStatus', level=2, name='n', values=[key, key]),
        types.make('diagnostic_msgs/msg/DiagnosticArray'),
    ]


@pytest.fixture
def rclpy_types() -> RclpyTypes:
    require_ros()
    return RclpyTypes()


@pytest.mark.parametrize('index', range(7))
def test_both_libraries_have_the_same_values(rclpy_types: RclpyTypes, index: int) -> None:
    from rclpy.serialization import serialize_message

    ours, bags = samples(rclpy_types)[index], samples(RosbagsTypes(STORE))[index]
    name = bags.__msgtype__
    decoded = STORE.deserialize_cdr(serialize_message(ours), name)
    assert STORE.serialize_cdr(decoded, name) == STORE.serialize_cdr(bags, name)


@pytest.mark.parametrize(
    ('stamp_ns', 'expected'),
    [(0, (0, 0)), (1_500_000_000, (1, 500_000_000)), (-1, (-1, 999_999_999)), (2**80, (2**31 - 1, 2**80 % 10**9))],
)
def test_stamps_split_and_stay_in_range(stamp_ns: int, expected: tuple[int, int]) -> None:
    made = conversion_types.make_stamp(RosbagsTypes(STORE), stamp_ns)
    assert (made.sec, made.nanosec) == expected
