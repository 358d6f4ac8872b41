# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Outputs of the node: their content, their time, and their agreement with the pipeline."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import ros_helpers

ros_helpers.require_ros()

from message_helpers import SECOND, cloud, obstacle_table, pose_array, pose_stamped  # noqa: E402
from node_helpers import GOALS, QUICK, ROWS, TYPES, Bench, begin, figures, hand_path, list_labels  # noqa: E402
from rclpy.serialization import deserialize_message, serialize_message  # noqa: E402
from ros_helpers import Graph  # noqa: E402

from foc_ros.core.classes.library import is_same_recording  # noqa: E402
from foc_ros.core.config import Config, replace_values  # noqa: E402
from foc_ros.core.pipeline import Pipeline  # noqa: E402
from foc_ros.ros import health  # noqa: E402
from foc_ros.ros.intake import Intake  # noqa: E402
from foc_ros.ros.messages.encode_prediction import encode_outputs  # noqa: E402


def stamps(messages: list[Any]) -> list[int]:
    return [message.header.stamp.sec * SECOND + message.header.stamp.nanosec for message in messages]


def sent(message: Any) -> Any:
    """Return the message after serialisation, with its float32 fields rounded."""
    return deserialize_message(serialize_message(message), type(message))


def test_every_due_hand_pose_gets_the_prediction_of_the_pipeline(ros: Graph) -> None:
    bench, poses = begin(ros), hand_path(20)
    bench.move(poses)
    clouds = bench.wait_for('prediction', 10)
    assert stamps(clouds) == stamps(poses)[::2]
    pipeline = Pipeline(replace_values(Config(), QUICK))
    intake = Intake(pipeline)
    intake.take('obstacles', cloud(TYPES, obstacle_table(ROWS), 10 * SECOND))
    intake.take('goals', pose_array(TYPES, GOALS))
    expected = []
    for pose in poses:
        intake.take('hand_pose', pose)
        prediction = pipeline.predict() if pipeline.is_due else None
        if prediction is not None:
            expected.append(encode_outputs(prediction, pipeline.scene.obstacles(prediction.stamp_ns), 'xy', TYPES))
    assert len(expected) == 10
    assert any(message['prediction'].width for message in expected)
    for name in ('prediction', 'path', 'markers'):
        assert bench.wait_for(name, 10) == [sent(message[name]) for message in expected]
    for received, message in zip(bench.wait_for('likelihoods', 10), expected, strict=True):
        assert received.layout == sent(message['likelihoods']).layout
        assert np.array_equal(received.data, message['likelihoods'].data, equal_nan=True)  # of shares without a candidate


def test_every_output_carries_the_stamp_and_frame_of_the_hand(ros: Graph) -> None:
    bench = Bench(ros)
    bench.deliver('obstacles', cloud(TYPES, obstacle_table(ROWS), 10 * SECOND, 'base'))
    bench.deliver('goals', pose_array(TYPES, GOALS, 'base'))
    bench.deliver('hand_pose', pose_stamped(TYPES, (0.0, 0.0, 0.25), 10 * SECOND + 7, 'base'))
    for name in ('prediction', 'path'):
        head = bench.wait_for(name, 1)[0].header
        assert (head.stamp.sec, head.stamp.nanosec, head.frame_id) == (10, 7, 'base')
    assert {each.header.stamp.nanosec for each in bench.wait_for('markers', 1)[0].markers} == {7}
    path = bench.received['path'][0].poses
    assert path
    heights = [pose.pose.position.z for pose in path]
    assert heights[0] == pytest.approx(0.25) and heights[-1] == pytest.approx(0.0, abs=1e-9), 'from the hand to the goal'


def test_nothing_is_predicted_before_all_inputs_are_received_and_diagnostics_report_it(ros: Graph) -> None:
    bench = Bench(ros)
    assert 'no hand pose yet' in bench.health().message
    bench.move(hand_path(1))
    status = bench.health()
    assert status.level == b'\x01'
    assert 'no obstacles received yet' in status.message
    bench.deliver('obstacles', cloud(TYPES, obstacle_table([]), 10 * SECOND))
    assert 'no goal received' in bench.health().message
    assert not bench.received['prediction']
    bench.deliver('goals', pose_array(TYPES, GOALS))
    bench.move(hand_path(3)[1:])
    bench.wait_for('prediction', 1)


@pytest.mark.parametrize('is_fresh', [True, False])
def test_an_overloaded_node_predicts_from_the_newest_pose_and_counts_the_others(
    ros: Graph, monkeypatch: pytest.MonkeyPatch, is_fresh: bool
) -> None:
    """Dropped cycles are counted; they are reported as a fault only if the predictions are not fresh."""
    monkeypatch.setattr(health, 'BUSY_S', 60.0 if is_fresh else 0.0)
    bench, poses = begin(ros), hand_path(41)
    bench.move(poses[:1])
    bench.wait_for('prediction', 1)
    bench.send('hand_pose', *poses[1:])
    assert stamps(bench.wait_for('prediction', 2)) == [stamps(poses)[0], stamps(poses)[-1]]
    status = bench.health()
    values = figures(status)
    fault = f'hand_superseded {values["dropped cycles"]}'
    assert (status.level, status.message) == ((b'\x00', 'predicting') if is_fresh else (b'\x01', fault))
    assert int(values['dropped cycles']) > 0
    assert values['hand_pose refused'] == '0 of 41'
    assert int(values['count predictions']) == 2


def test_a_refused_pose_triggers_no_prediction(ros: Graph) -> None:
    bench, pose = Bench(ros), hand_path(1)[0]
    bench.deliver('hand_pose', pose)
    bench.publish_scene()
    assert bench.node.pipeline.is_due
    bench.deliver('hand_pose', pose)
    assert figures(bench.health())['count hand_duplicate'] == '1'
    assert not bench.received['prediction']


def test_a_looping_bag_restarts_the_movement(ros: Graph) -> None:
    bench, poses = begin(ros), hand_path(8, rate_hz=10.0)
    for turn in range(2):
        bench.move(poses)
        status = bench.health()
        assert status.level == (b'\x01' if turn else b'\x00'), status.message
    assert stamps(bench.wait_for('prediction', 16)) == stamps(poses) * 2
    assert (status.message, figures(status)['count hand_restarted_backward']) == ('hand_restarted_backward 1', '1')
    bench.move(hand_path(9, rate_hz=10.0)[8:])
    status = bench.health()
    assert status.level == b'\x00', status.message


def test_only_subscribed_outputs_are_encoded(ros: Graph, monkeypatch: pytest.MonkeyPatch) -> None:
    from foc_ros.ros import node

    asked: list[list[str]] = []
    monkeypatch.setattr(node, 'encode_outputs', lambda *args: asked.append(list(args[-1])) or encode_outputs(*args))
    bench = begin(ros, 1, outputs=['likelihoods'])
    bench.wait_for('likelihoods', 1)
    assert asked == [['likelihoods']]


def test_nothing_is_predicted_while_disengaged(ros: Graph) -> None:
    from std_srvs.srv import SetBool

    bench, poses = begin(ros), hand_path(12)
    bench.move(poses[:3])
    assert len(bench.wait_for('prediction', 2)) == 2
    answer = ros.call(bench.player, SetBool, 'foc/engage', SetBool.Request(data=False))
    assert (answer.success, answer.message) == (True, 'disengaged')
    bench.move(poses[3:8])
    status = bench.health()
    assert (status.level, status.message) == (b'\x00', 'disengaged')
    assert len(bench.received['prediction']) == 2
    assert ros.call(bench.player, SetBool, 'foc/engage', SetBool.Request(data=True)).message == 'engaged'
    bench.move(poses[8:10])
    assert stamps(bench.wait_for('prediction', 3))[-1] == stamps(poses)[8]


def test_reset_forgets_the_movement_and_keeps_the_scene(ros: Graph) -> None:
    from std_srvs.srv import Trigger

    bench = begin(ros, 4)
    bench.wait_for('prediction', 2)
    assert ros.call(bench.player, Trigger, 'foc/reset', Trigger.Request()).success
    assert bench.node.pipeline.hand_state is None
    bench.move(hand_path(1, start_s=9.9))
    assert stamps(bench.wait_for('prediction', 3))[-1] == round(9.9 * SECOND)


def test_a_scene_published_once_is_received_later_with_transient_local_durability(ros: Graph) -> None:
    from rclpy.qos import QoSDurabilityPolicy, QoSProfile
    from sensor_msgs.msg import PointCloud2

    early = ros.node('early')
    latched = QoSProfile(depth=1, durability=QoSDurabilityPolicy.TRANSIENT_LOCAL)
    publisher = early.create_publisher(PointCloud2, 'obstacles', latched)
    publisher.publish(cloud(TYPES, obstacle_table(ROWS), 10 * SECOND))
    overrides = {'qos_overrides./obstacles.subscription.durability': 'transient_local'}

    from rclpy.parameter import Parameter

    from foc_ros.ros.node import FocNode

    given = [Parameter(name, value=value) for name, value in overrides.items()]
    node = ros.add(FocNode(context=ros.context, parameter_overrides=given))
    ros.spin_until(lambda: 'cloud' in node.pipeline.scene.sources, 'the scene of before')
    assert len(node.pipeline.scene.obstacles(0)) == len(ROWS)


def test_diagnostics_contain_rates_ages_times_and_candidates(ros: Graph) -> None:
    bench = begin(ros, 10)
    bench.wait_for('prediction', 5)
    status = bench.health()
    values = figures(status)
    assert status.name == 'foc: prediction'
    assert values['working frame'] == 'world'
    assert (values['obstacles of cloud'], values['goals']) == ('1', '1')
    assert float(values['hand_pose age [s]']) >= 0.0
    assert [float(text) > 0.0 for text in values['solve time p50, p99 [ms]'].split(', ')] == [True, True]
    labels = list_labels(bench.received['likelihoods'][-1])
    for label in labels:
        assert values[f'candidate {label}'].startswith('solved, likelihood ')
    assert values['most likely'] == labels[0]
    likelihoods = np.array(bench.received['likelihoods'][-1].data).reshape(-1, 4)[:, 0]
    assert likelihoods.sum() == pytest.approx(1.0)


def test_diagnostics_are_published_once_a_second(ros: Graph) -> None:
    bench = Bench(ros, outputs=[], ticking=True)
    ros.spin_until(lambda: len(bench.diagnostics) >= 3, 'three diagnostics')
    stamps_s = [array.header.stamp.sec + 1e-9 * array.header.stamp.nanosec for array in bench.diagnostics[:3]]
    assert stamps_s[2] - stamps_s[0] == pytest.approx(2.0, abs=0.9)


def test_diagnostics_are_published_while_simulated_time_stands_still(ros: Graph) -> None:
    bench = Bench(ros, outputs=[], ticking=True, parameters={'use_sim_time': True})
    ros.spin_until(lambda: len(bench.diagnostics) >= 2, 'two diagnostics')
    assert bench.node.get_clock().now().nanoseconds == 0
    assert bench.diagnostics[-1].status[0].level == b'\x01'
    assert 'no hand pose yet' in bench.diagnostics[-1].status[0].message


def test_the_node_learns_the_movement_that_the_pipeline_learns(ros: Graph) -> None:
    learning = {'experience.learning': 'online'}
    bench, poses = begin(ros, parameters=learning), hand_path(141)
    bench.move(poses)
    intake = Intake(Pipeline(replace_values(Config(), QUICK | learning)))
    intake.take('obstacles', cloud(TYPES, obstacle_table(ROWS), 10 * SECOND))
    intake.take('goals', pose_array(TYPES, GOALS))
    for pose in poses:
        intake.take('hand_pose', pose)
    (live,), (learnt,) = (each.learnt.movements.finish().learnt for each in (bench.node.pipeline, intake.pipeline))
    assert is_same_recording(live, learnt)
