# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Inputs at high rates, in real time, to a node in its own process: its outputs and the level of its diagnostics."""

from __future__ import annotations

import re
import signal
import time
from collections.abc import Callable
from typing import Any

import ros_helpers

ros_helpers.require_ros()

from diagnostic_msgs.msg import DiagnosticArray  # noqa: E402
from geometry_msgs.msg import PoseArray, PoseStamped  # noqa: E402
from message_helpers import SECOND, cloud, obstacle_table, pose_array, pose_stamped  # noqa: E402
from node_helpers import CROWD, GOALS, ROWS, TYPES, figures  # noqa: E402
from ros_helpers import Graph  # noqa: E402
from sensor_msgs.msg import PointCloud2  # noqa: E402
from test_node_process import running  # noqa: E402

OK, WARN = b'\x00', b'\x01'
LIGHT = ['foc.steps:=20', 'homotopy.max_candidates:=1', 'rate_hz:=10.0', 'scene.timeout_s:=0.0', 'estimator.hand_timeout_s:=10.0']
RELIABLE = [f'qos_overrides./{name}.subscription.reliability:=reliable' for name in ('hand_pose', 'obstacles')]


class Feeder:
    """Publishes hand poses and clouds at given rates. Attributes: clouds, health: messages received; sent: number of poses."""

    def __init__(self, ros: Graph) -> None:
        self.ros, player = ros, ros.node('player')
        self.clouds = ros.collect(player, PointCloud2, 'foc/prediction')
        self.health = ros.collect(player, DiagnosticArray, '/diagnostics')
        kinds = {'obstacles': PointCloud2, 'goals': PoseArray, 'hand_pose': PoseStamped}
        self.publishers = {name: player.create_publisher(kind, name, 1000) for name, kind in kinds.items()}
        self.sent = 0

    def connect(self) -> None:
        self.ros.spin_until(lambda: all(each.get_subscription_count() for each in self.publishers.values()), 'the node', 30.0)
        self.publishers['obstacles'].publish(cloud(TYPES, obstacle_table(ROWS), 10 * SECOND))
        self.publishers['goals'].publish(pose_array(TYPES, GOALS))
        self.ros.spin_until(lambda: self.figure('goals') == '1' == self.figure('obstacles of cloud'), 'the scene')

    def figure(self, name: str) -> str | None:
        return figures(self.health[-1].status[0]).get(name) if self.health else None

    def play(self, seconds: float, pose_hz: float, tick: Callable[[int], Any] = lambda _: None) -> None:
        """Publish every 10 ms the poses that are due, and call `tick(i)`."""
        began, ticks = time.monotonic(), round(100 * seconds)
        for i in range(ticks):
            tick(i)
            while self.sent < pose_hz * 0.01 * (i + 1):
                stamp_ns = 10 * SECOND + round(self.sent / pose_hz * SECOND)
                self.publishers['hand_pose'].publish(pose_stamped(TYPES, (5e-4 * (self.sent % 3), 0.0, 0.1), stamp_ns))
                self.sent += 1
            self.ros.spin_for(max(began + 0.01 * (i + 1) - time.monotonic(), 0.001))

    def complaints(self) -> list[str]:
        """Return the summaries since the first prediction, except OK and dropped cycles of a slow machine."""
        told = [each.status[0] for each in self.health if 'count predictions' in figures(each.status[0])]
        assert told
        return [
            f'{each.level}: {each.message}'
            for each in told
            if (each.level, each.message) != (OK, 'predicting')
            and not (each.level == WARN and re.fullmatch(r'hand_superseded \d+', each.message))
        ]

    def all_heard(self) -> bool:
        return self.figure('hand_pose refused') == f'0 of {self.sent}'


def stamps(clouds: list[Any]) -> list[int]:
    return [each.header.stamp.sec * SECOND + each.header.stamp.nanosec for each in clouds]


def parameters(*given: str) -> list[str]:
    return ['--ros-args', *(word for each in given for word in ('-p', each))]


def test_ten_thousand_obstacles_at_50_hz(ros: Graph) -> None:
    """Every pose is received, predictions are made from the newest, and the level is OK.

    Without a time limit: while 500,000 rows are decoded a second, a prediction on two busy cores may miss its budget.
    """
    feeder, flood = Feeder(ros), cloud(TYPES, obstacle_table(CROWD), 10 * SECOND)
    with running(ros, 'module', *parameters(*LIGHT, *RELIABLE, 'budget_s:=0.0')) as process:
        feeder.connect()
        feeder.play(3.0, 100.0, lambda i: i % 2 or feeder.publishers['obstacles'].publish(flood))
        ros.spin_until(feeder.all_heard, f'{feeder.sent} poses in the diagnostics')
        process.send_signal(signal.SIGTERM)
        assert process.wait(30) == 0
    assert stamps(feeder.clouds) == sorted(set(stamps(feeder.clouds)))
    assert len(feeder.clouds) > 5
    assert (feeder.figure('obstacles of cloud'), feeder.figure('count internal_errors')) == ('10000', None)
    assert int(feeder.figure('note culled') or 0) > 9000
    assert feeder.complaints() == []


def test_poses_at_1_khz(ros: Graph) -> None:
    feeder = Feeder(ros)
    with running(ros, 'module', *parameters(*LIGHT, *RELIABLE, 'budget_s:=0.0')) as process:
        feeder.connect()
        feeder.play(2.0, 1000.0)
        ros.spin_until(feeder.all_heard, f'{feeder.sent} poses in the diagnostics')
        process.send_signal(signal.SIGTERM)
        assert process.wait(30) == 0
    assert feeder.sent == 2000
    found = stamps(feeder.clouds)
    assert found == sorted(set(found))
    assert len(found) + int(feeder.figure('dropped cycles') or 0) >= 15
    assert feeder.complaints() == []


def test_bad_poses_at_1_khz_write_few_lines_to_the_log(ros: Graph) -> None:
    feeder, nowhere = Feeder(ros), pose_stamped(TYPES, (float('nan'), 0.0, 0.0), 10 * SECOND)
    with running(ros, 'module', *parameters(*LIGHT, *RELIABLE)) as process:
        feeder.connect()
        feeder.play(2.0, 0.0, lambda _: [feeder.publishers['hand_pose'].publish(nowhere) for _ in range(10)])
        ros.spin_until(lambda: feeder.figure('hand_pose refused') == '2000 of 2000', 'all poses in the diagnostics')
        process.send_signal(signal.SIGTERM)
        _, errors = process.communicate(timeout=30)
    assert process.returncode == 0
    lines = [line for line in errors.splitlines() if 'expected a finite number' in line]
    assert 1 <= len(lines) <= 5, f'{len(lines)} lines'
    assert '(1 of 1 refused so far)' in lines[0]
    assert WARN in {each.status[0].level for each in feeder.health}
    assert feeder.clouds == []
