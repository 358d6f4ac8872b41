# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Services and topics as the `ros2` tools use them: plain clients, and the node in another process."""

from __future__ import annotations

from typing import Any

import ros_helpers

ros_helpers.require_ros()

from lifecycle_msgs.msg import Transition  # noqa: E402
from lifecycle_msgs.srv import ChangeState, GetState  # noqa: E402
from message_helpers import SECOND, cloud, obstacle_table, pose_array  # noqa: E402
from node_helpers import GOALS, ROWS, TYPES, hand_path  # noqa: E402
from rcl_interfaces.msg import Parameter  # noqa: E402
from rcl_interfaces.srv import DescribeParameters, GetParameters, ListParameters, SetParameters  # noqa: E402
from ros_helpers import Graph  # noqa: E402
from test_node_process import running  # noqa: E402

from foc_ros.core.config import list_parameters  # noqa: E402


def test_every_parameter_is_listed_described_read_and_set(ros: Graph) -> None:
    client = ros.node('client')
    known = {parameter.name: parameter for parameter in list_parameters()}
    with running(ros, 'module'):
        listed = ros.call(client, ListParameters, 'foc/list_parameters', ListParameters.Request()).result.names
        assert {*known, 'autostart', 'use_sim_time', 'qos_overrides./obstacles.subscription.durability'} <= set(listed)
        request = DescribeParameters.Request(names=listed)
        described = {
            each.name: each for each in ros.call(client, DescribeParameters, 'foc/describe_parameters', request).descriptors
        }
        for name, parameter in known.items():
            bound, descriptor = parameter.bound, described[name]
            assert descriptor.description and descriptor.read_only == bound.read_only
            ranges = [*descriptor.floating_point_range, *descriptor.integer_range]
            assert [(each.from_value, each.to_value) for each in ranges] == [(bound.low, bound.high)] * (bound.low is not None)
        values = ros.call(client, GetParameters, 'foc/get_parameters', GetParameters.Request(names=listed)).values
        assert len(values) == len(listed) and all(value.type for value in values)
        again = [Parameter(name=name, value=value) for name, value in zip(listed, values, strict=True)]
        results = ros.call(client, SetParameters, 'foc/set_parameters', SetParameters.Request(parameters=again)).results
        for name, result in zip(listed, results, strict=True):
            read_only = described[name].read_only
            assert result.successful != read_only, f'{name}: {result.reason}'
            assert not read_only or 'read-only' in result.reason


def test_the_state_is_changed_and_every_topic_is_received(ros: Graph) -> None:
    from diagnostic_msgs.msg import DiagnosticArray
    from geometry_msgs.msg import PoseArray, PoseStamped
    from lifecycle_msgs.msg import TransitionEvent
    from sensor_msgs.msg import PointCloud2

    from foc_ros.ros.messages.encode_prediction import OUTPUTS
    from foc_ros.ros.messages.types import find_message_class

    client = ros.node('client')
    kinds = {f'foc/{name}': find_message_class(kind) for name, (kind, _) in OUTPUTS.items()}
    kinds |= {'/diagnostics': DiagnosticArray, 'foc/transition_event': TransitionEvent}
    received: dict[str, list[Any]] = {name: ros.collect(client, kind, name) for name, kind in kinds.items()}
    inputs = {'obstacles': PointCloud2, 'goals': PoseArray, 'hand_pose': PoseStamped}
    publishers = {name: client.create_publisher(kind, name, 10) for name, kind in inputs.items()}

    def change(label: str) -> str:
        request = ChangeState.Request(transition=Transition(label=label))
        assert ros.call(client, ChangeState, 'foc/change_state', request).success
        return str(ros.call(client, GetState, 'foc/get_state', GetState.Request()).current_state.label)

    reliable = 'qos_overrides./obstacles.subscription.reliability:=reliable'
    parameters = ['autostart:=false', 'foc.steps:=20', 'scene.timeout_s:=0.0', reliable]
    with running(ros, 'module', '--ros-args', *(word for each in parameters for word in ('-p', each))):
        assert change('configure') == 'inactive'
        assert change('activate') == 'active'
        ros.spin_until(lambda: all(each.get_subscription_count() for each in publishers.values()), 'the inputs')
        ros.spin_until(lambda: all(client.count_publishers(name) for name in kinds), 'the outputs')
        publishers['obstacles'].publish(cloud(TYPES, obstacle_table(ROWS), 10 * SECOND))
        publishers['goals'].publish(pose_array(TYPES, GOALS))
        poses = iter(hand_path(3000))

        def all_heard() -> bool:
            publishers['hand_pose'].publish(next(poses))
            ros.spin_for(0.01)
            return all(received.values())

        ros.spin_until(all_heard, f'a message on each of {", ".join(kinds)}')
        assert change('deactivate') == 'inactive'
