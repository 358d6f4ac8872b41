# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Faults of a robot cell: the outputs of the node and the level of its diagnostics for each of them."""

from __future__ import annotations

import resource
import signal
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
import ros_helpers

ros_helpers.require_ros()

from message_helpers import SECOND, cloud, marker, marker_array, obstacle_table, pose_array, pose_stamped  # noqa: E402
from node_helpers import CROWD, ROWS, TYPES, Bench, begin, figures, hand_path  # noqa: E402
from ros_helpers import Graph  # noqa: E402

from foc_ros.core.config import Config  # noqa: E402

OK, WARN = b'\x00', b'\x01'
ROOT = Path(__file__).parents[1]


def stamps(messages: list[Any]) -> list[int]:
    return [message.header.stamp.sec * SECOND + message.header.stamp.nanosec for message in messages]


def goes_on(bench: Bench, poses: list[Any], level: bytes = OK) -> None:
    """Wait until the node has predicted from the last pose and reports OK."""
    before = len(bench.received['prediction'])
    bench.health()
    bench.move(poses)
    assert stamps(bench.wait_for('prediction', before + 1))[-1] in stamps(poses)
    status = bench.health()
    assert status.level == level, status.message


def test_a_publisher_that_dies_during_a_movement(ros: Graph) -> None:
    bench, poses = begin(ros, parameters={'estimator.hand_timeout_s': 0.3}), hand_path(8)
    bench.move(poses[:4])
    sent = len(bench.wait_for('prediction', 2))
    ros.spin_for(0.4)
    status = bench.health()
    assert (status.level, status.message.split(' for ')[0]) == (WARN, 'no prediction: hand_pose silent')
    ros.spin_for(0.4)
    assert len(bench.received['prediction']) == sent
    goes_on(bench, [pose_stamped(TYPES, (0.0, 0.0, 0.1), 13 * SECOND)], level=WARN)
    assert figures(bench.health())['count hand_restarted_gap'] == '1'


@pytest.mark.parametrize('topic', ['obstacles', 'obstacle_markers'])
def test_hand_poses_are_taken_during_a_flood_of_obstacles(ros: Graph, topic: str) -> None:
    """Three messages of many obstacles for each pose: every pose is received, and predictions continue."""
    if topic == 'obstacles':
        flood = cloud(TYPES, obstacle_table(CROWD), 10 * SECOND)
    else:
        kept = enumerate(CROWD[:400])
        flood = marker_array(TYPES, *[marker(TYPES, row[:3], (0.008,) * 3, id=i, stamp_ns=10 * SECOND) for i, row in kept])
    bench, poses = begin(ros), hand_path(10)
    for pose in poses:
        for _ in range(3):
            bench.publishers[topic].publish(flood)
        bench.deliver('hand_pose', pose)
    assert len(bench.wait_for('prediction', 5)) == 5
    status = bench.health()
    values = figures(status)
    assert (status.level, values['hand_pose refused']) == (OK, '0 of 10')
    assert int(values['note culled']) > 300


@pytest.mark.parametrize(
    ('stamp_ns', 'words'),
    [
        (0, 'hand_pose: header.stamp: expected a time after 0'),
        (10 * SECOND - 100_000_000, 'hand_late'),
        (4 * SECOND, 'hand_restarted_backward'),
        (900 * SECOND, 'obstacles are 890 s older than the hand pose'),
    ],
)
def test_a_stamp_far_from_the_others(ros: Graph, stamp_ns: int, words: str) -> None:
    """A stamp of zero, late, backward or in the future is reported at WARN, and valid poses continue the movement."""
    bench, poses = begin(ros, parameters={'scene.timeout_s': 60.0}), hand_path(8)
    bench.move(poses[:3])
    bench.wait_for('prediction', 2)
    bench.health()
    bench.move([pose_stamped(TYPES, (0.0, 0.0, 0.1), stamp_ns)])
    status = bench.health()
    assert status.level == WARN
    assert words in status.message + figures(status)['last refusal']
    moved = stamp_ns in (4 * SECOND, 900 * SECOND)
    goes_on(bench, poses[3:], level=WARN if moved else OK)
    assert set(stamps(bench.received['prediction'])) <= {*stamps(poses), 4 * SECOND}


def test_a_frame_that_changes_from_pose_to_pose(ros: Graph) -> None:
    bench, poses = begin(ros), hand_path(8)
    for i, pose in enumerate(poses):
        pose.header.frame_id = 'camera' if i % 2 else 'world'
    bench.move(poses)
    status = bench.health()
    assert (status.level, figures(status)['count hand_wrong_frame']) == (WARN, '4')
    assert "expected the working frame 'world', got 'camera'" in figures(status)['last refusal']
    assert stamps(bench.wait_for('prediction', 4)) == stamps(poses)[::2]
    assert {each.header.frame_id for each in bench.received['prediction']} == {'world'}


def test_goals_that_change_with_every_pose(ros: Graph) -> None:
    bench, poses = begin(ros), hand_path(20)
    for i, pose in enumerate(poses):
        bench.deliver('goals', pose_array(TYPES, [(0.3, 0.02 * (j - i % 3), 0.0) for j in range(1 + i % 3)]))
        bench.move([pose])
    assert stamps(bench.wait_for('prediction', 10)) == stamps(poses)[::2]
    assert bench.health().level == OK
    bench.deliver('goals', pose_array(TYPES, []))
    bench.move([pose_stamped(TYPES, (0.0, 0.0, 0.1), round(10.5 * SECOND))])
    status = bench.health()
    assert (status.level, status.message) == (WARN, 'no prediction: no goal: the last goals message was empty')
    assert len(bench.received['prediction']) == 10


def test_a_clock_that_jumps_forward_and_back(ros: Graph) -> None:
    """A simulation is restarted twice: predictions are made from poses stamped with its time only."""
    from rosgraph_msgs.msg import Clock

    bench = begin(ros, outputs=['prediction'], parameters={'use_sim_time': True, 'estimator.hand_timeout_s': 60.0})
    clock = bench.player.create_publisher(Clock, '/clock', 10)

    def now(seconds: float) -> None:
        message = Clock(clock=pose_stamped(TYPES, (0, 0, 0), round(seconds * SECOND)).header.stamp)
        clock.publish(message)
        ros.spin_until(lambda: bench.node.get_clock().now().nanoseconds == round(seconds * SECOND), f'clock at {seconds} s')

    ros.spin_until(lambda: clock.get_subscription_count() > 0, 'the clock is heard')
    for turn, start_s in enumerate((10.0, 500.0, 10.0)):
        now(start_s)
        goes_on(bench, hand_path(2, start_s=start_s), level=WARN if turn else OK)
    now(300.0)
    before = len(bench.received['prediction'])
    bench.move(hand_path(4, start_s=10.1))
    status = bench.health()
    assert (status.level, len(bench.received['prediction'])) == (WARN, before)
    assert 'the hand pose is 290 s older than the time of the node' in status.message


def test_a_node_that_is_killed_and_started_again(ros: Graph) -> None:
    from test_node_process import feed, running

    with running(ros, 'module') as process:
        feed(ros, lambda player: bool(player.predictions), 'a prediction')
        process.send_signal(signal.SIGKILL)
        assert process.wait(30) == -signal.SIGKILL
    node = ros.nodes[-1]
    ros.executor.remove_node(node)
    ros.nodes.remove(node)
    node.destroy_node()
    with running(ros, 'module', '--ros-args', '-p', 'rate_hz:=10.0', '-p', 'foc.steps:=20') as process:
        feed(ros, lambda player: player.has_heard(OK, 'predicting'), 'a second of predictions without a fault')
        process.send_signal(signal.SIGTERM)
        assert process.wait(30) == 0


def test_a_disk_that_is_full_ends_the_output_bag_in_one_line(tmp_path: Path) -> None:
    from bag_helpers import write_bag, write_parameters

    bag = write_bag(tmp_path / 'reach')
    command = [sys.executable, '-m', 'foc_ros', 'replay', str(bag), '--output', str(tmp_path / 'out')]
    result = subprocess.run(
        [*command, '--params', write_parameters(tmp_path)],
        cwd=ROOT,
        capture_output=True,
        text=True,
        timeout=100,
        check=False,
        # writes beyond this limit fail like those to a full disk
        preexec_fn=lambda: (
            signal.signal(signal.SIGXFSZ, signal.SIG_IGN),
            resource.setrlimit(resource.RLIMIT_FSIZE, (20_000, 20_000)),
        ),
    )
    assert result.returncode == 2
    assert len(result.stderr.strip().splitlines()) == 1
    assert 'cannot be written' in result.stderr
    assert not (tmp_path / 'out').exists()


def test_several_nodes_of_one_process_are_independent(ros: Graph) -> None:
    benches = [Bench(ros, namespace=name, outputs=['prediction']) for name in ('left', 'right', 'third')]
    for i, bench in enumerate(benches):
        bench.publish_scene(rows=ROWS[:1] * (i > 0))
    for pose in hand_path(4):
        for bench in benches:
            bench.deliver('hand_pose', pose)
    for i, bench in enumerate(benches):
        assert len(bench.wait_for('prediction', 2)) == 2
        status = bench.health()
        assert status.name == f'{bench.node.get_namespace()[1:]}/foc: prediction'
        assert (status.level, figures(status)['obstacles of cloud']) == (OK, str(int(i > 0)))


@pytest.mark.parametrize(('name', 'strategy'), [('64 on the hand', 'lv'), ('N = 400', 'hc'), ('64 goals x 64', 'lv')])
def test_the_node_keeps_its_promises_in_a_hostile_scene(
    ros: Graph, monkeypatch: pytest.MonkeyPatch, name: str, strategy: str
) -> None:
    """The script `stress.py` judges times too; a machine that runs other tests meanwhile cannot."""
    monkeypatch.syspath_prepend(ROOT / 'scripts')
    monkeypatch.setenv('ROS_DOMAIN_ID', str(ros.domain))
    import stress

    row = stress.measure_case(stress.CASES[name], strategy, 3.0)
    assert row['errors'] == 0
    assert row['made'] > 0
    assert row['age [s]'] <= Config().estimator.hand_timeout_s, 'of a published prediction'
    assert row['answer [s]'] < row['gap [s]'], 'a service is answered between two diagnostics'
