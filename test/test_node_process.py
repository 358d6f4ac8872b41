# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The node as a process: it starts or prints the reason why not, and stops without an error on a signal."""

from __future__ import annotations

import itertools
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import ros_helpers

ros_helpers.require_ros()

from message_helpers import SECOND, cloud, obstacle_table, pose_array, pose_stamped  # noqa: E402
from node_helpers import GOALS, ROWS, TYPES, figures  # noqa: E402
from ros_helpers import Graph  # noqa: E402

from foc_ros.ros.isolated_node import reserve_domain  # noqa: E402
from foc_ros.ros.main import main  # noqa: E402

ROOT = Path(__file__).parents[1]


def entry_point(name: str) -> str:
    """Return the program that colcon has installed for `ros2 run`, or else the one that pip has installed."""
    from ament_index_python import get_package_prefix

    try:
        return str(Path(get_package_prefix('foc_ros')) / 'lib' / 'foc_ros' / name)
    except (LookupError, OSError):
        return str(Path(sys.executable).with_name(name))


LAUNCHES = {
    'module': [sys.executable, '-m', 'foc_ros.ros.main'],
    'command': [sys.executable, '-m', 'foc_ros', 'node'],
    'entry point': [entry_point('foc_node')],
}


@contextmanager
def running(ros: Graph, launch: str | list[str], *arguments: str) -> Iterator[subprocess.Popen[str]]:
    """Run a node as a process; launch: the key of a command, or the command itself."""
    command = [*(LAUNCHES[launch] if isinstance(launch, str) else launch), *arguments]
    pipes = {'stdout': subprocess.PIPE, 'stderr': subprocess.PIPE, 'text': True}
    with subprocess.Popen(command, cwd=ROOT, env=ros.environment, **pipes) as process:
        try:
            yield process
        finally:
            # a process that is killed remains in the graph for 20 s, and the next test in this domain would take it for its own
            process.terminate()
            try:
                process.wait(10)
            except subprocess.TimeoutExpired:
                process.kill()


def ended(process: subprocess.Popen[str], number: signal.Signals) -> tuple[int, str]:
    """Send a signal; return the exit code and the text on standard error."""
    process.send_signal(number)
    _, errors = process.communicate(timeout=30)
    return process.returncode, errors


@dataclass
class Player:
    """What a player of a scene has published and heard: the number of hand poses, the predictions and the diagnostics."""

    sent: int = 0
    predictions: list[Any] = field(default_factory=list)
    statuses: list[Any] = field(default_factory=list)

    def figure(self, name: str) -> str | None:
        """Return a value of the newest diagnostics."""
        return figures(self.statuses[-1].status[0]).get(name) if self.statuses else None

    def has_heard(self, level: bytes, message: str) -> bool:
        """Return whether one of the diagnostics had this level and message."""
        return (level, message) in [(each.status[0].level, each.status[0].message) for each in self.statuses]


def feed(ros: Graph, is_enough: Callable[[Player], bool], what: str, hand: str = 'hand_pose') -> Player:
    """Publish a scene at 10 Hz and, once the node has it, hand poses at 100 Hz by their stamps, until the player has enough.

    The hand moves to and fro before the obstacle, so that it can be predicted for as long as that takes. what: is awaited;
    hand: topic of its poses.
    """
    from diagnostic_msgs.msg import DiagnosticArray
    from geometry_msgs.msg import PoseArray, PoseStamped
    from sensor_msgs.msg import PointCloud2

    node, player = ros.node('player'), Player()
    topics = {hand: PoseStamped, 'obstacles': PointCloud2, 'goals': PoseArray}
    publishers = {name: node.create_publisher(kind, name, 10) for name, kind in topics.items()}
    player.predictions = ros.collect(node, PointCloud2, 'foc/prediction')
    player.statuses = ros.collect(node, DiagnosticArray, '/diagnostics')
    ros.spin_until(lambda: all(each.get_subscription_count() for each in publishers.values()), 'the node', 30.0)
    ticks = itertools.count()

    def play_and_check() -> bool:
        tick = next(ticks)
        stamp_ns = 10 * SECOND + tick * SECOND // 100
        if tick % 10 == 0:
            publishers['obstacles'].publish(cloud(TYPES, obstacle_table(ROWS), stamp_ns))
            publishers['goals'].publish(pose_array(TYPES, GOALS))
        if player.sent or player.figure('obstacles of cloud') == '1' == player.figure('goals'):
            position = (0.05 * np.sin(0.02 * player.sent), 0.0, 0.1)
            publishers[hand].publish(pose_stamped(TYPES, position, stamp_ns))
            player.sent += 1
        ros.spin_for(0.01)
        return is_enough(player)

    ros.spin_until(play_and_check, what, 40.0)
    return player


@pytest.mark.parametrize(
    ('launch', 'number'), [('module', signal.SIGTERM), ('command', signal.SIGINT), ('entry point', signal.SIGTERM)]
)
def test_a_working_node_stops_without_an_error(ros: Graph, launch: str, number: signal.Signals) -> None:
    with running(ros, launch) as process:
        feed(ros, lambda player: bool(player.predictions), 'a prediction')
        code, errors = ended(process, number)
    assert code == 0, errors
    assert 'Traceback' not in errors


def test_a_node_works_with_an_rclpy_that_has_only_its_plain_executor(
    ros: Graph, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / 'sitecustomize.py').write_text("import sys\nsys.modules['rclpy.experimental.events_executor'] = None\n")
    monkeypatch.setenv('PYTHONPATH', str(tmp_path), prepend=os.pathsep)
    with running(ros, 'module') as process:
        feed(ros, lambda player: bool(player.predictions), 'a prediction')
        assert ended(process, signal.SIGTERM)[0] == 0


def test_a_node_says_what_it_waits_for_and_when_it_predicts(ros: Graph) -> None:
    with running(ros, 'module', '--ros-args', '-r', 'hand_pose:=MTMR/measured_cp') as process:
        feed(ros, lambda player: bool(player.predictions), 'a prediction', hand='MTMR/measured_cp')
        code, errors = ended(process, signal.SIGTERM)
    assert code == 0
    lines = [line.partition('[foc]: ')[2] for line in errors.splitlines() if line.startswith('[INFO]')]
    assert lines[-2:] == [
        'ready, waiting for /MTMR/measured_cp; /obstacles or /obstacle_markers; /goals or /goal_pose',
        'predicting in frame world, plane xy',
    ]


@pytest.mark.parametrize('number', [signal.SIGINT, signal.SIGTERM])
def test_a_starting_node_stops_without_an_error_at_any_moment(ros: Graph, number: signal.Signals) -> None:
    watcher = ros.node('watcher')
    with running(ros, 'module') as process:
        ros.spin_until(lambda: 'foc' in watcher.get_node_names(), 'the node', 30.0)
        process.send_signal(signal.SIGTERM)
        code, errors = ended(process, number)  # a second one has no effect
    assert code == 0
    assert [line for line in errors.splitlines() if not line.startswith('[INFO]')] == []


@pytest.mark.parametrize(
    ('arguments', 'words'),
    [
        (['--ros-args', '-p', 'foc.eta:=2.0'], 'foc_node: foc.eta: expected a number in [0, 0.999], got 2.0\n'),
        (['--ros-args', '-p', 'rate_hz:=fast'], "foc_node: rate_hz: expected a finite number in [0.1, 1000] Hz, got 'fast'\n"),
        (['--ros-args', '-p', 'autostart:=maybe'], "foc_node: autostart: expected true or false, got 'maybe'\n"),
        (['--ros-args', '--params-file', '/nowhere/at/all.yaml'], '/nowhere/at/all.yaml'),
        (['--ros-args', '-p', 'qos_overrides./obstacles.subscription.durability:=eternal'], 'eternal'),
        (['--ros-args', '-p', 'homotopy.library:=/nowhere/ways.json'], 'foc_node: /nowhere/ways.json: cannot be read'),
        (['--ros-args', '--no-such-option'], 'no-such-option'),
        (['--ros-args', '-p', 'qqq:=1'], 'foc_node: qqq: expected a known parameter, got 1\n'),
        (
            ['--ros-args', '-p', 'foc.etta:=0.5'],
            'foc_node: foc.etta: expected a known parameter (did you mean foc.eta?), got 0.5\n',
        ),
        (['--fast'], 'foc_node: unrecognized arguments: --fast (those of ROS follow --ros-args)\n'),
    ],
)
def test_a_node_that_cannot_start_prints_the_reason_in_one_line(
    capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, arguments: list[str], words: str
) -> None:
    handlers = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)}
    with reserve_domain() as domain:
        monkeypatch.setenv('ROS_DOMAIN_ID', str(domain))
        assert main(arguments) == 2
    for number, handler in handlers.items():
        signal.signal(number, handler)
    errors = capfd.readouterr().err
    lines = [line for line in errors.splitlines() if line.startswith('foc_node: ')]
    assert len(lines) == 1
    assert words in errors
    assert 'Traceback' not in errors


def test_a_request_that_rclpy_cannot_handle_does_not_end_the_node(ros: Graph) -> None:
    from rcl_interfaces.msg import Parameter, ParameterValue
    from rcl_interfaces.srv import GetParameters, SetParameters

    client_node = ros.node('client')
    with running(ros, 'module') as process:
        client = client_node.create_client(SetParameters, 'foc/set_parameters')
        ros.spin_until(client.service_is_ready, 'the node', 30.0)
        client.call_async(SetParameters.Request(parameters=[Parameter(name='rate_hz', value=ParameterValue(type=99))]))
        ros.spin_for(0.2)
        answer = ros.call(client_node, GetParameters, 'foc/get_parameters', GetParameters.Request(names=['rate_hz']))
        assert answer.values[0].double_value == 50.0
        assert process.poll() is None
        code, _ = ended(process, signal.SIGTERM)
    assert code == 0


def test_a_stopped_node_leaves_no_files_and_no_trace_in_the_graph(ros: Graph, tmp_path: Path) -> None:
    watcher = ros.node('watcher')
    command = [sys.executable, '-m', 'foc_ros.ros.main']
    environment = ros.environment | {'ROS_LOG_DIR': str(tmp_path / 'log'), 'PYTHONPATH': str(ROOT)}
    with subprocess.Popen(command, cwd=tmp_path, env=environment) as process:
        ros.spin_until(lambda: 'foc' in watcher.get_node_names(), 'the node', 30.0)
        process.send_signal(signal.SIGTERM)
        assert process.wait(30) == 0
    deadline = time.monotonic() + 30
    while 'foc' in watcher.get_node_names():
        assert time.monotonic() < deadline
        ros.executor.spin_once(timeout_sec=0.05)
    assert [each.name for each in tmp_path.iterdir()] == ['log']
