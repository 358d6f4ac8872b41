# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Bad input, wrong parameters and internal errors: the node reports them, publishes nothing wrong, and goes on."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from itertools import islice
from typing import Any

import pytest
import ros_helpers

ros_helpers.require_ros()

from message_helpers import SECOND, cloud, marker, marker_array, obstacle_table, pose_array, pose_stamped  # noqa: E402
from node_helpers import GOALS, QUICK, ROWS, TYPES, Bench, begin, figures, hand_path, list_labels  # noqa: E402
from rcl_interfaces.srv import SetParametersAtomically  # noqa: E402
from ros_helpers import Graph, graph  # noqa: E402

from foc_ros.core.config import Config, flatten, replace_values  # noqa: E402

NAN = math.nan
EARLY = round(9.9 * SECOND)
BAD_INPUTS = {
    'hand that is nowhere': (
        'hand_pose',
        pose_stamped(TYPES, (NAN, 0, 0), 20 * SECOND),
        'pose.position.x: expected a finite number',
    ),
    'unstamped hand': (
        'hand_pose',
        pose_stamped(TYPES, (0, 0, 0), 0),
        'header.stamp: expected a time after 0, got 0 s',
    ),
    'hand in another frame': (
        'hand_pose',
        pose_stamped(TYPES, (0, 0, 0), 20 * SECOND, 'camera'),
        "hand_pose.header.frame_id: expected the working frame 'world', got 'camera'",
    ),
    'late hand': ('hand_pose', pose_stamped(TYPES, (0, 0, 0), EARLY), 'behind the newest'),
    'truncated table': ('obstacles', cloud(TYPES, obstacle_table(ROWS), data=b'abc'), 'obstacles: data: expected 16 bytes'),
    'table in another frame': ('obstacles', cloud(TYPES, obstacle_table(ROWS), 10 * SECOND, 'camera'), "got 'camera'"),
    'late table': ('obstacles', cloud(TYPES, obstacle_table(ROWS), EARLY), 'behind the newest'),
    'marker of negative size': ('obstacle_markers', marker_array(TYPES, marker(TYPES, scale=(-1, 1, 1))), 'markers[0].scale.x'),
    'marker in another frame': (
        'obstacle_markers',
        marker_array(TYPES, marker(TYPES, frame_id='camera', stamp_ns=10 * SECOND)),
        "got 'camera'",
    ),
    'goal that is nowhere': (
        'goals',
        pose_array(TYPES, [(0, math.inf, 0)]),
        'poses[0].position.y: expected a finite',
    ),
    'goal in another frame': ('goal_pose', pose_stamped(TYPES, (0, 0, 0), 1, 'camera'), "got 'camera'"),
}


class Log:
    """A logger that stores its lines."""

    def __init__(self) -> None:
        self.lines: list[str] = []

    def warning(self, line: str, **_: Any) -> None:
        self.lines.append(line)

    error = warning


@pytest.fixture(scope='module')
def working() -> Iterator[Bench]:
    """Yield a node that predicts, for the tests of this module that change nothing."""
    with graph() as created:
        bench = Bench(created)
        bench.publish_scene()
        yield bench


@pytest.fixture(scope='module')
def poses() -> Iterator[Any]:
    """Yield the poses of one movement, for all tests with `working`."""
    return iter(hand_path(100))


@pytest.mark.parametrize('case', BAD_INPUTS)
def test_bad_input_is_refused_with_its_reason_and_changes_nothing(working: Bench, poses: Iterator[Any], case: str) -> None:
    role, message, words = BAD_INPUTS[case]
    working.move(islice(poses, 2))
    log = working.node._loggers[role] = Log()
    scene, state, count = working.node.pipeline.scene, working.node.pipeline.hand_state, len(working.wait_for('prediction', 1))
    working.health()
    working.deliver(role, message)
    status = working.health()
    assert words in figures(status)['last refusal']
    assert status.level == b'\x01'
    assert [words in line and re.search(r'\(\d+ of \d+ refused so far\)', line) is not None for line in log.lines] == [True]
    assert working.node.pipeline.scene is scene
    assert working.node.pipeline.hand_state is state
    assert len(working.received['prediction']) == count
    working.move(islice(poses, 2))
    working.wait_for('prediction', count + 1)


def test_bytes_that_are_no_message_are_dropped(working: Bench, poses: Iterator[Any]) -> None:
    count = len(working.received['prediction'])
    for role in ('hand_pose', 'obstacles'):
        working.publishers[role].publish(b'\0\1\0\0junk')
    working.ros.spin_for(0.1)
    working.move(islice(poses, 2))
    working.wait_for('prediction', count + 1)
    assert 'count internal_errors' not in figures(working.health())


def test_dropped_rows_are_reported(ros: Graph) -> None:
    bench = Bench(ros)
    bench.deliver('obstacles', cloud(TYPES, obstacle_table([*ROWS, (NAN, 0, 0, 1)]), 10 * SECOND))
    status = bench.health()
    assert status.level == b'\x01'
    assert 'obstacles_dropped_not_finite 1' in status.message
    bench.deliver('goals', pose_array(TYPES, GOALS))
    bench.move(hand_path(2))
    (table,) = bench.wait_for('likelihoods', 1)
    assert '0' in table.layout.dim[0].label
    assert bench.health().level == b'\x00'


def test_the_newest_valid_scene_of_the_queue_is_used(ros: Graph) -> None:
    bench = Bench(ros)
    good = [cloud(TYPES, obstacle_table([(x, 0, 0, 0.01)]), 10 * SECOND) for x in (1, 2, 3)]
    bench.send('obstacles', *good, cloud(TYPES, obstacle_table(ROWS), data=b'abc'))
    ros.spin_until(lambda: 'cloud' in bench.node.pipeline.scene.sources, 'a scene')
    assert bench.node.pipeline.scene.obstacles(0).centre[0, 0] == 3.0
    assert figures(bench.health())['obstacles refused'] == '1 of 2'


def test_a_scene_that_is_not_renewed_stops_predictions(ros: Graph) -> None:
    bench = begin(ros, parameters={'scene.timeout_s': 500.0, 'estimator.gap_s': 60.0, 'rate_hz': 0.1})
    bench.move(pose_stamped(TYPES, (0, 0, 0), (10 + 100 * i) * SECOND) for i in range(9))
    status = bench.health()
    assert len(bench.received['prediction']) == 6
    assert status.level == b'\x01'
    assert re.search(r'no prediction: obstacles are 800 s older than the hand pose', status.message)


@pytest.mark.parametrize('is_moving', [True, False])
def test_stamps_that_repeat_are_no_silence(ros: Graph, is_moving: bool) -> None:
    """As of a clock of whole seconds, and of a driver that repeats its last message."""
    bench = begin(ros, 2, parameters={'estimator.hand_timeout_s': 0.05})
    for i in range(1, 12):
        bench.deliver('hand_pose', pose_stamped(TYPES, (0.01 * i * is_moving, 0.0, 0.0), bench.node.pipeline.hand_state.stamp_ns))
        ros.spin_for(0.01)
    status = bench.health()
    assert status.level == b'\x01' and 'silent' not in status.message
    assert re.match(
        r'no prediction: no hand_pose could be used for \d\.\d s, the last: hand_pose: stamps repeat: ', status.message
    )
    assert 'stamps repeat: 11 of 13 poses have that of the pose before' in status.message


def test_a_pose_without_data_is_a_lost_hand(ros: Graph) -> None:
    bench = begin(ros, 2, parameters={'estimator.hand_timeout_s': 0.05})
    for i in range(1, 12):
        lost = pose_stamped(TYPES, (0.0, 0.0, 0.0), bench.node.pipeline.hand_state.stamp_ns + i * SECOND // 50)
        lost.pose.orientation.w = 0.0
        bench.deliver('hand_pose', lost)
        ros.spin_for(0.01)
    status = bench.health()
    assert status.level == b'\x01' and 'hand_lost 11' in status.message
    assert re.match(r'no prediction: no hand_pose could be used for .* the tracker has lost the hand', status.message)


def test_a_hand_that_does_not_move_is_told(ros: Graph) -> None:
    bench = begin(ros)
    start = hand_path(1)[0]
    stamp_ns = start.header.stamp.sec * SECOND + start.header.stamp.nanosec
    bench.move(pose_stamped(TYPES, (0.01, 0.0, 0.0), stamp_ns + i * SECOND // 10) for i in range(15))
    bench.wait_for('prediction', 1)
    status = bench.health()
    assert status.level == b'\x00' and status.message == 'predicting; the hand does not move: the same position for 1.4 s'


@pytest.mark.parametrize('where', ['begin', 'predict', 'encode_outputs'])
def test_an_internal_error_is_counted_and_reported_and_the_node_goes_on(
    ros: Graph, monkeypatch: pytest.MonkeyPatch, where: str
) -> None:
    from foc_ros.core import pipeline as computation
    from foc_ros.ros import node as module

    def broken(*_: Any) -> None:
        raise ZeroDivisionError('made for this test')

    bench, poses = Bench(ros), hand_path(6)
    log = Log()
    monkeypatch.setattr(bench.node, 'get_logger', lambda: log)
    bench.publish_scene()
    with monkeypatch.context() as patch:
        owner = {'begin': bench.node.pipeline, 'predict': computation, 'encode_outputs': module}[where]
        patch.setattr(owner, where, broken)
        bench.move(poses[:3])
        status = bench.health()
    assert status.level == b'\x02'
    assert status.message == '3 internal errors, the last: ZeroDivisionError: made for this test'
    assert 'Traceback' in log.lines[0]
    assert not bench.received['prediction']
    bench.move(poses[3:])
    bench.wait_for('prediction', 1)
    bench.health()
    assert bench.health().level != b'\x02'


def request_of(**values: Any) -> Any:
    from rclpy.parameter import Parameter

    given = [Parameter(name.replace('__', '.'), value=value).to_parameter_msg() for name, value in values.items()]
    return SetParametersAtomically.Request(parameters=given)


def set_on(bench: Bench, **values: Any) -> Any:
    return bench.ros.call(bench.player, SetParametersAtomically, 'foc/set_parameters_atomically', request_of(**values)).result


def test_quality_of_service_is_overridden_topic_by_topic(ros: Graph) -> None:
    overrides = {
        'qos_overrides./obstacles.subscription.depth': 3,
        'qos_overrides./obstacle_markers.subscription.reliability': 'best_effort',
        'qos_overrides./foc/path.publisher.depth': 2,
    }
    bench = Bench(ros, outputs=[], parameters=overrides)
    found = {
        name: bench.node.get_parameter(f'qos_overrides./{name}').value
        for name in (
            'obstacles.subscription.depth',
            'goals.subscription.depth',
            'foc/path.publisher.depth',
            'foc/markers.publisher.depth',
        )
    }
    assert list(found.values()) == [3, 10, 2, 10]
    (info,) = bench.player.get_subscriptions_info_by_topic('obstacle_markers')
    assert info.qos_profile.reliability.name == 'BEST_EFFORT'
    (info,) = bench.player.get_subscriptions_info_by_topic('goals')
    assert info.qos_profile.reliability.name == 'RELIABLE'


def test_obstacles_are_heard_from_a_best_effort_publisher(ros: Graph) -> None:
    from rclpy.qos import qos_profile_sensor_data
    from sensor_msgs.msg import PointCloud2

    from foc_ros.ros.node import FocNode

    node, perception = ros.add(FocNode(context=ros.context)), ros.node('perception')
    publisher = perception.create_publisher(PointCloud2, 'obstacles', qos_profile_sensor_data)

    def is_heard() -> bool:
        publisher.publish(cloud(TYPES, obstacle_table(ROWS), 10 * SECOND))
        return 'cloud' in node.pipeline.scene.sources

    ros.spin_until(is_heard, 'the obstacles')


def test_a_publisher_that_cannot_be_heard_is_named(ros: Graph) -> None:
    from rclpy.event_handler import PublisherEventCallbacks
    from rclpy.qos import qos_profile_sensor_data
    from visualization_msgs.msg import MarkerArray

    bench, perception = Bench(ros, outputs=[]), ros.node('perception')
    silent = PublisherEventCallbacks(use_default_callbacks=False)
    publisher = perception.create_publisher(MarkerArray, 'obstacle_markers', qos_profile_sensor_data, event_callbacks=silent)
    ros.spin_until(lambda: len(bench.node.get_publishers_info_by_topic('obstacle_markers')) == 2, 'the publisher')
    status = bench.health()
    assert status.level == b'\x01'
    assert status.message.startswith(
        'obstacle_markers is not heard from perception, incompatible QoS: Best effort publisher and reliable subscription '
        '(see qos_overrides./obstacle_markers.subscription); no prediction: no hand pose yet'
    )
    perception.destroy_publisher(publisher)
    ros.spin_until(lambda: len(bench.node.get_publishers_info_by_topic('obstacle_markers')) == 1, 'its end')
    assert bench.health().message == 'no prediction: no hand pose yet'


@pytest.mark.parametrize('wanted', [{'durability': 'transient_local'}, {'liveliness': 'manual_by_topic'}])
def test_a_subscription_that_cannot_receive_an_output_is_named(ros: Graph, wanted: dict[str, str]) -> None:
    from nav_msgs.msg import Path
    from rclpy.qos import QoSDurabilityPolicy, QoSLivelinessPolicy, QoSProfile

    from foc_ros.ros.endpoints import describe_incompatible_subscriptions

    bench, planner = Bench(ros, outputs=[]), ros.node('planner')
    policies = {'durability': QoSDurabilityPolicy, 'liveliness': QoSLivelinessPolicy}
    profile = QoSProfile(depth=1, **{name: policies[name].get_from_short_key(value) for name, value in wanted.items()})
    planner.create_subscription(Path, 'foc/path', lambda _: None, profile)
    ros.node('listener').create_subscription(Path, 'foc/path', lambda _: None, 1)
    ros.spin_until(lambda: len(bench.node.get_subscriptions_info_by_topic('foc/path')) == 2, 'the subscriptions')
    (text,) = describe_incompatible_subscriptions(bench.node, bench.node._outputs['path'])
    assert text.startswith('planner cannot hear /foc/path, incompatible QoS: ')
    assert text.endswith('(see qos_overrides./foc/path.publisher)')


def test_parameters_change_together_and_without_a_missed_prediction(ros: Graph) -> None:
    bench, poses = begin(ros), hand_path(20)
    bench.move(poses[:10])
    assert set_on(bench, foc__eta=0.7, likelihood__beta=1, homotopy__max_candidates=1).successful
    bench.move(poses[10:])
    tables = bench.wait_for('likelihoods', 10)
    assert bench.node.pipeline.config == replace_values(
        Config(), QUICK | {'foc.eta': 0.7, 'likelihood.beta': 1.0, 'homotopy.max_candidates': 1}
    )
    assert [len(list_labels(table)) for table in tables] == [2] * 5 + [1] * 5
    assert isinstance(bench.node.get_parameter('likelihood.beta').value, float)


@pytest.mark.parametrize(
    ('values', 'words'),
    [
        ({'foc__eta': 2.0}, 'foc.eta out of range'),
        ({'foc__eta': NAN}, 'foc.eta out of range'),
        ({'foc__strategy': 'best'}, "foc.strategy: expected one of lv, hc, optimal, algorithm1, fixed, got 'best'"),
        ({'foc__steps': 20.5}, 'Wrong parameter type'),
        ({'plane': 'xz'}, 'read-only parameter: plane'),
        ({'foc__etta': 0.5}, 'foc.etta'),
        ({'foc__strategy': None}, 'cannot be undeclared'),
    ],
)
def test_a_refused_value_changes_nothing_and_names_the_reason(working: Bench, values: dict[str, Any], words: str) -> None:
    before = working.node.pipeline.config
    result = set_on(working, rate_hz=25.0, **values)
    assert not result.successful
    assert words in result.reason
    assert working.node.pipeline.config is before
    assert {name: working.node.get_parameter(name).value for name in flatten(before)} == flatten(before)


def test_the_node_predicts_while_parameters_change_with_every_pose(ros: Graph) -> None:
    bench, poses = begin(ros), hand_path(40)
    client = bench.player.create_client(SetParametersAtomically, 'foc/set_parameters_atomically')
    ros.spin_until(client.service_is_ready, 'parameter service')
    futures = []
    for i, pose in enumerate(poses):
        futures.append(client.call_async(request_of(foc__eta=0.5 + 0.01 * i if i % 3 else 5.0)))
        bench.move([pose])
    ros.spin_until(lambda: all(future.done() for future in futures), 'answers')
    assert [future.result().result.successful for future in futures] == [bool(i % 3) for i in range(40)]
    bench.wait_for('prediction', 20)
    status = bench.health()
    assert (status.level, status.message) == (b'\x00', 'predicting')
    assert figures(status)['hand_pose refused'] == '0 of 40'
