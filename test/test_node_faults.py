# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Bad input, silence, unfit endpoints and internal errors: the node reports them, publishes nothing wrong, and goes on."""

import math
import re
from itertools import islice
from pathlib import Path as File

import ros_required  # noqa: F401
import numpy as np
import pytest
from message_helpers import SECOND, cloud, marker, marker_array, obstacle_table, pose_array, pose_stamped
from nav_msgs.msg import Path
from node_helpers import ERROR, GOALS, OK, ROWS, TYPES, WARN, Bench, begin, figures, hand_path, stamps
from rclpy.event_handler import PublisherEventCallbacks
from rclpy.parameter import Parameter
from rclpy.qos import QoSDurabilityPolicy, QoSLivelinessPolicy, QoSProfile, qos_profile_sensor_data
from ros_helpers import graph
from sensor_msgs.msg import PointCloud2
from std_srvs.srv import Trigger
from visualization_msgs.msg import MarkerArray

from foc_ros.core import pipeline as computation
from foc_ros.core.classes.library import record_demonstration
from foc_ros.core.obstacle_table import make_obstacles
from foc_ros.io.class_library import save_library
from foc_ros.ros import node as module
from foc_ros.ros.endpoints import describe_incompatible_subscriptions

EARLY = round(9.9 * SECOND)
REPEATED = 'stamps repeat: 11 of 13 poses have that of the pose before'


def hand(x=0.0, stamp_ns=20 * SECOND, frame_id='world'):
    return 'hand_pose', pose_stamped(TYPES, (x, 0, 0), stamp_ns, frame_id)


def table(stamp_ns=SECOND, frame_id='world', **changes):
    return 'obstacles', cloud(TYPES, obstacle_table(ROWS), stamp_ns, frame_id, **changes)


def shape(**changes):
    return 'obstacle_markers', marker_array(TYPES, marker(TYPES, **changes))


BAD_INPUTS = {
    'hand that is nowhere': (*hand(math.nan), 'pose.position.x: expected a finite number'),
    'unstamped hand': (*hand(stamp_ns=0), 'header.stamp: expected a time after 0, got 0 s'),
    'hand in another frame': (*hand(frame_id='camera'), "header.frame_id: expected the working frame 'world', got 'camera'"),
    'late hand': (*hand(stamp_ns=EARLY), 'behind the newest'),
    'truncated table': (*table(data=b'abc'), 'obstacles: data: expected 16 bytes'),
    'table in another frame': (*table(10 * SECOND, 'camera'), "got 'camera'"),
    'late table': (*table(EARLY), 'behind the newest'),
    'marker of negative size': (*shape(scale=(-1, 1, 1)), 'markers[0].scale.x'),
    'marker in another frame': (*shape(frame_id='camera', stamp_ns=10 * SECOND), "got 'camera'"),
    'goal that is nowhere': ('goals', pose_array(TYPES, [(0, math.inf, 0)]), 'poses[0].position.y: expected a finite'),
    'goal in another frame': ('goal_pose', pose_stamped(TYPES, (0, 0, 0), 1, 'camera'), "got 'camera'"),
}


class Log:
    """A logger that stores its lines."""

    def __init__(self):
        self.lines: list[str] = []

    def warning(self, line, **_):
        self.lines.append(line)

    error = warning


@pytest.fixture(scope='module')
def working():
    """Yield a node that predicts, for the tests of this module that change nothing; `poses` are those of its movement."""
    with graph() as created:
        bench = begin(created)
        bench.poses = iter(hand_path(100))
        yield bench


@pytest.mark.parametrize('case', BAD_INPUTS)
def test_bad_input_is_refused_with_its_reason_and_changes_nothing(working, case):
    role, message, words = BAD_INPUTS[case]
    working.move(islice(working.poses, 2))
    log = working.node._loggers[role] = Log()
    scene, state, count = working.node.pipeline.scene, working.node.pipeline.hand_state, len(working.wait_for('prediction', 1))
    working.health()
    working.deliver(role, message)
    status = working.health()
    assert words in figures(status)['last refusal']
    assert status.level == WARN
    assert [words in line and re.search(r'\(\d+ of \d+ refused so far\)', line) is not None for line in log.lines] == [True]
    assert working.node.pipeline.scene is scene
    assert working.node.pipeline.hand_state is state
    assert len(working.received['prediction']) == count
    working.move(islice(working.poses, 2))
    working.wait_for('prediction', count + 1)


def test_bytes_that_are_no_message_are_dropped(working):
    count = len(working.received['prediction'])
    for role in ('hand_pose', 'obstacles'):
        working.publishers[role].publish(b'\0\1\0\0junk')
    working.ros.spin_for(0.1)
    working.move(islice(working.poses, 2))
    working.wait_for('prediction', count + 1)
    assert 'count internal_errors' not in figures(working.health())


def test_dropped_rows_are_reported_and_the_newest_valid_scene_of_the_queue_is_used(ros):
    bench = Bench(ros)
    bench.deliver('obstacles', cloud(TYPES, obstacle_table([*ROWS, (math.nan, 0, 0, 1)]), 10 * SECOND))
    status = bench.health()
    assert status.level == WARN and 'obstacles_dropped_not_finite 1' in status.message
    bench.deliver('goals', pose_array(TYPES, GOALS))
    bench.move(hand_path(2))
    (table,) = bench.wait_for('likelihoods', 1)
    assert '0' in table.layout.dim[0].label
    assert bench.health().level == OK
    tenths = {1: 101, 2: 103, 3: 102}  # the last one is late
    good = [cloud(TYPES, obstacle_table([(x, 0, 0, 0.01)]), tenth * SECOND // 10) for x, tenth in tenths.items()]
    bench.take('obstacles', *good, cloud(TYPES, obstacle_table(ROWS), data=b'abc'))
    assert bench.node.pipeline.scene.obstacles(0).centre[0, 0] == 2.0
    values = figures(bench.health())
    assert (values['obstacles refused'], values['count obstacles_late']) == ('2 of 5', '1')


def test_a_scene_that_is_not_renewed_stops_predictions(ros):
    """And one stamp in the future is reported, after which valid poses continue the movement."""
    bench = begin(ros, scene__timeout_s=500.0, estimator__gap_s=60.0, rate_hz=0.1)
    bench.move(pose_stamped(TYPES, (0, 0, 0), (10 + 100 * i) * SECOND) for i in range(9))
    status = bench.health()
    assert len(bench.received['prediction']) == 6
    assert status.level == WARN and 'no prediction: obstacles are 800 s older than the hand pose' in status.message
    bench.move(hand_path(1, start_s=11.0))
    assert stamps(bench.wait_for('prediction', 7))[-1] == 11 * SECOND


def test_silent_sources_stop_predictions_until_they_are_received_or_removed(ros, clock):
    """Unstamped obstacles have no age, so only the silence of their source shows that it has stopped."""
    bench, poses = Bench(ros, scene__timeout_s=1.0), iter(hand_path(30))
    scene = cloud(TYPES, obstacle_table(ROWS), 0)
    bench.deliver('goals', pose_array(TYPES, GOALS))
    bench.deliver('obstacle_markers', marker_array(TYPES))
    bench.deliver('obstacles', scene)
    bench.move(islice(poses, 2))
    bench.wait_for('prediction', 1)
    clock.now_s += 1.1
    bench.move(islice(poses, 4))
    status = bench.health()
    assert status.level == WARN and 'no prediction: obstacles silent for' in status.message
    assert figures(status)['count predict_obstacles_silent'] == '4'
    assert len(bench.received['prediction']) == 1
    bench.deliver('obstacles', scene)
    bench.move(islice(poses, 2))
    bench.wait_for('prediction', 2)  # an empty array of markers that was sent once does not block

    bench.deliver('obstacle_markers', marker_array(TYPES, marker(TYPES, (0.15, 0.2, 0.0), stamp_ns=0)))
    clock.now_s += 1.1
    bench.deliver('obstacles', scene)
    bench.move(islice(poses, 2))
    assert 'obstacle_markers silent for' in bench.health().message
    answer = bench.call(Trigger, 'reset')
    assert answer.message.startswith('the movement is forgotten, the scene is kept without the obstacles of obstacle_markers')
    assert set(bench.node.pipeline.scene.sources) == {'cloud'}
    bench.move(islice(poses, 2))
    bench.wait_for('prediction', 3)


def test_a_silent_hand_is_told_and_one_whose_poses_wait_is_not_silent(ros, clock):
    bench, (first, second) = begin(ros, estimator__hand_timeout_s=0.3), hand_path(2)
    bench.move([first])
    bench.wait_for('prediction', 1)
    clock.now_s += 0.4
    status = bench.health()
    assert (status.level, status.message.split(' for ')[0]) == (WARN, 'no prediction: hand_pose silent')
    ros.spin_for(0.2)
    assert len(bench.received['prediction']) == 1
    bench.send('hand_pose', second)
    assert 'silent' not in bench.health().message
    bench.move([pose_stamped(TYPES, (0.0, 0.0, 0.1), 13 * SECOND)])
    assert stamps(bench.wait_for('prediction', 2))[-1] == 13 * SECOND
    assert figures(bench.health())['count hand_restarted_gap'] == '1'


@pytest.mark.parametrize(
    ('step_ns', 'step_m', 'w', 'last', 'count'),
    [
        pytest.param(0, 0.01, 1.0, 'stamps repeat: ', REPEATED, id='a clock of whole seconds'),
        pytest.param(0, 0.0, 1.0, 'stamps repeat: ', REPEATED, id='a driver that repeats its last message'),
        pytest.param(SECOND // 50, 0.0, 0.0, '.*the tracker has lost the hand', 'hand_lost 11', id='a tracker without data'),
    ],
)
def test_poses_that_cannot_be_used_are_no_silence(ros, clock, step_ns, step_m, w, last, count):
    bench = begin(ros, 2, estimator__hand_timeout_s=0.05)
    for i in range(1, 12):
        pose = pose_stamped(TYPES, (step_m * i, 0.0, 0.0), bench.node.pipeline.hand_state.stamp_ns + step_ns * i)
        pose.pose.orientation.w = w
        bench.deliver('hand_pose', pose)
        clock.now_s += 0.01
    status = bench.health()
    assert status.level == WARN and count in status.message and 'silent' not in status.message
    assert re.match(rf'no prediction: no hand_pose could be used for \d\.\d s, the last: hand_pose: {last}', status.message)


@pytest.mark.parametrize('where', ['begin', 'predict', 'encode_outputs'])
def test_an_internal_error_is_counted_and_reported_and_the_node_goes_on(ros, monkeypatch, where):
    def broken(*_):
        raise ZeroDivisionError('made for this test')

    bench, poses, log = begin(ros), hand_path(6), Log()
    with monkeypatch.context() as patch:
        patch.setattr(bench.node, 'get_logger', lambda: log)
        owner = {'begin': bench.node.pipeline, 'predict': computation, 'encode_outputs': module}[where]
        patch.setattr(owner, where, broken)
        bench.move(poses[:3])
        status = bench.health()
    assert status.level == ERROR
    assert status.message == '3 internal errors, the last: ZeroDivisionError: made for this test'
    assert 'Traceback' in log.lines[0]
    assert not bench.received['prediction']
    bench.move(poses[3:])
    bench.wait_for('prediction', 1)
    bench.health()
    assert bench.health().level != ERROR


def test_quality_of_service_is_overridden_topic_by_topic(ros):
    overrides = {'obstacle_markers.subscription.reliability': 'best_effort', 'foc/path.publisher.depth': 2}
    bench = Bench(ros, outputs=[], **{f'qos_overrides./{name}': value for name, value in overrides.items()})
    for name, value in (overrides | {'goals.subscription.depth': 10, 'foc/markers.publisher.depth': 10}).items():
        assert bench.node.get_parameter(f'qos_overrides./{name}').value == value
    for topic, expected in (('obstacle_markers', 'BEST_EFFORT'), ('goals', 'RELIABLE')):
        (info,) = bench.player.get_subscriptions_info_by_topic(topic)
        assert info.qos_profile.reliability.name == expected


@pytest.mark.parametrize('is_early', [True, False])
def test_obstacles_are_heard_from_a_best_effort_publisher(ros, is_early):
    """Or, with another durability, those that were published once before the node was there."""
    latched = QoSProfile(depth=1, durability=QoSDurabilityPolicy.TRANSIENT_LOCAL)
    perception, message = ros.node('perception'), cloud(TYPES, obstacle_table(ROWS), 10 * SECOND)
    publisher = perception.create_publisher(PointCloud2, 'obstacles', latched if is_early else qos_profile_sensor_data)
    publisher.publish(message)
    early = Parameter('qos_overrides./obstacles.subscription.durability', value='transient_local')
    node = ros.add(module.FocNode(context=ros.context, parameter_overrides=[early] if is_early else []))

    def is_heard():
        if not is_early:
            publisher.publish(message)
        return 'cloud' in node.pipeline.scene.sources

    ros.spin_until(is_heard, 'the obstacles')
    assert len(node.pipeline.scene.obstacles(0)) == len(ROWS)


def test_a_publisher_that_cannot_be_heard_is_named(ros):
    bench, perception = Bench(ros, outputs=[]), ros.node('perception')
    silent = PublisherEventCallbacks(use_default_callbacks=False)
    publisher = perception.create_publisher(MarkerArray, 'obstacle_markers', qos_profile_sensor_data, event_callbacks=silent)
    ros.spin_until(lambda: len(bench.node.get_publishers_info_by_topic('obstacle_markers')) == 2, 'the publisher')
    status = bench.health()
    assert status.level == WARN
    assert status.message.startswith(
        'obstacle_markers is not heard from perception, incompatible QoS: Best effort publisher and reliable subscription '
        '(see qos_overrides./obstacle_markers.subscription); no prediction: no hand pose yet'
    )
    perception.destroy_publisher(publisher)
    ros.spin_until(lambda: len(bench.node.get_publishers_info_by_topic('obstacle_markers')) == 1, 'its end')
    assert bench.health().message == 'no prediction: no hand pose yet'


def test_a_subscription_that_cannot_receive_an_output_is_named(ros):
    bench = Bench(ros, outputs=[])
    ros.node('listener').create_subscription(Path, 'foc/path', lambda _: None, 1)
    policies = {
        'planner': {'durability': QoSDurabilityPolicy.TRANSIENT_LOCAL},
        'viewer': {'liveliness': QoSLivelinessPolicy.MANUAL_BY_TOPIC},
    }
    for name, wanted in policies.items():
        ros.node(name).create_subscription(Path, 'foc/path', lambda _: None, QoSProfile(depth=1, **wanted))
    ros.spin_until(lambda: len(bench.node.get_subscriptions_info_by_topic('foc/path')) == 3, 'the subscriptions')
    texts = sorted(describe_incompatible_subscriptions(bench.node, bench.node._outputs['path']))
    assert len(texts) == len(policies)
    for name, text in zip(policies, texts, strict=True):
        assert text.startswith(f'{name} cannot hear /foc/path, incompatible QoS: ')
        assert text.endswith('(see qos_overrides./foc/path.publisher)')


def test_a_class_library_of_no_use_is_named_until_one_of_its_paths_can_count(ros, tmp_path):
    file, log = str(tmp_path / 'ways.json'), Log()
    path = np.linspace((0.0, 0.0), (0.3, 0.0), 40)
    save_library(File(file), [record_demonstration('world', path, make_obstacles([[0.15, 0.02]], 0.03, ids=('cup/0',)))])
    bench = begin(ros, homotopy__library=file)
    with pytest.MonkeyPatch.context() as patch:
        bench.move(hand_path(2))
        patch.setattr(bench.node, 'get_logger', lambda: log)
        status = bench.health()
    words = f"{file}: none of its paths counts: they pass obstacles that the scene does not have: 'cup/0'"
    assert status.level == WARN and status.message == words and log.lines == [words]
    bench.deliver('obstacle_markers', marker_array(TYPES, marker(TYPES, (0.15, 0.3, 0.0), ns='cup', stamp_ns=10 * SECOND)))
    bench.move(hand_path(4)[2:])
    assert bench.health().message == 'predicting'
