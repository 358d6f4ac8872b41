"""The node in another process: hand poses at 100 Hz, how long each prediction takes to come back, and which never come."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from typing import Any

import numpy as np
from results import Result, at_most
from scenes import GOAL, RATE_HZ, Reach, tick_4x8

DOMAIN = 97
PERIOD_S = 1.0 / RATE_HZ
START_NS = 1_000_000_000
CONNECT_S, TAIL_S, HEALTH_S = 30.0, 3.0, 1.2
PARAMETERS = ('rate_hz', 'foc.noise_x', 'foc.noise_y', 'foc.eta', 'homotopy.max_candidates', 'duration.model', 'duration.fixed_s')
BUDGET_S = 0.8 * PERIOD_S
"""Time of a prediction, `budget_s`: what does not fit is told, and goes on in the next, so that no pose has to wait."""


def node(quick: bool) -> Result:
    """Measure 4 classes among 8 obstacles for 60 s."""
    seconds = 5.0 if quick else 60.0
    reach = tick_4x8()
    os.environ.update({'ROS_DOMAIN_ID': str(DOMAIN), 'ROS_AUTOMATIC_DISCOVERY_RANGE': 'LOCALHOST'})
    command = [sys.executable, '-m', 'foc_ros.ros.main', *_arguments(reach)]
    with subprocess.Popen(command) as process:
        try:
            player = Player(reach)
            delays, sent = player.play(seconds)
        finally:
            process.send_signal(signal.SIGTERM)
    lost = sent - len(delays)
    p50, p99 = (1e3 * float(np.percentile(delays, share)) if delays else np.inf for share in (50, 99))
    period_ms = 1e3 * PERIOD_S
    return Result(
        'node',
        f'99th percentile from a pose sent to its prediction received, {seconds:g} s of poses at 100 Hz, budget_s {BUDGET_S:g}',
        'the period of the poses',
        p99,
        period_ms,
        p99 / period_ms,
        'ours / peer',
        lost == 0,
        f'{lost} of {sent} predictions lost (none allowed)',
        sent,
        at_most(1.0),
        {'p50_ms': p50, 'slowest_ms': 1e3 * max(delays, default=np.inf), 'lost': lost, 'ways_out_of_time': player.out_of_time},
    )


def _arguments(reach: Reach) -> list[str]:
    from foc_ros.core.config import flatten

    values = flatten(reach.config) | {'budget_s': BUDGET_S}
    return ['--ros-args', *(part for name in (*PARAMETERS, 'budget_s') for part in ('-p', f'{name}:={values[name]}'))]


class Player:
    """Publishes what a tracker and a perception node would, and notes when predictions come back, by stamp."""

    def __init__(self, reach: Reach) -> None:
        import rclpy
        from diagnostic_msgs.msg import DiagnosticArray
        from geometry_msgs.msg import PoseArray, PoseStamped
        from rclpy.executors import SingleThreadedExecutor
        from sensor_msgs.msg import PointCloud2

        from foc_ros.ros.messages.types import RclpyTypes

        rclpy.init()
        self.reach, self.types = reach, RclpyTypes()
        self.node = rclpy.create_node('player')
        self.executor = SingleThreadedExecutor()
        self.executor.add_node(self.node)
        kinds = {'obstacles': PointCloud2, 'goals': PoseArray, 'hand_pose': PoseStamped}
        self.publishers = {name: self.node.create_publisher(kind, name, 10) for name, kind in kinds.items()}
        self.arrived: dict[int, float] = {}
        self.out_of_time = 0
        self.node.create_subscription(PointCloud2, 'foc/prediction', self._arrive, 1000)
        self.node.create_subscription(DiagnosticArray, '/diagnostics', self._count, 10)

    def _arrive(self, cloud: Any) -> None:
        stamp = cloud.header.stamp
        self.arrived.setdefault(stamp.sec * 1_000_000_000 + stamp.nanosec, time.perf_counter())

    def _count(self, health: Any) -> None:
        """Take note of how many ways of all predictions had no time."""
        counts = {each.key: each.value for status in health.status for each in status.values}
        self.out_of_time = int(counts.get('count candidate_deadline', 0))

    def play(self, seconds: float) -> tuple[list[float], int]:
        """Return the delays [s] of the predictions that came, and how many poses were sent."""
        self._until(lambda: all(each.get_subscription_count() for each in self.publishers.values()), CONNECT_S)
        count, sent = round(seconds * RATE_HZ), {}
        self._show_scene(START_NS)
        self._spin(1.0)
        began = time.perf_counter()
        for tick in range(count):
            if tick % 50 == 0:
                self._show_scene(START_NS + round(tick * PERIOD_S * 1e9))
            self._spin(began + tick * PERIOD_S - time.perf_counter())
            stamp = START_NS + round(tick * PERIOD_S * 1e9)
            sent[stamp] = time.perf_counter()
            self._move(stamp, tick)
        self._until(lambda: sent.keys() <= self.arrived.keys(), TAIL_S)
        self._spin(HEALTH_S)
        return [self.arrived[stamp] - at for stamp, at in sent.items() if stamp in self.arrived], count

    def _show_scene(self, stamp_ns: int) -> None:
        from foc_ros.ros.messages.input_messages import goal_poses, obstacle_cloud

        circles = self.reach.obstacles
        table = zip(circles.centre, circles.radius, circles.radius_stddev, strict=True)
        rows = [(*centre, 0.0, radius, stddev, number) for number, (centre, radius, stddev) in enumerate(table)]
        self.publishers['obstacles'].publish(obstacle_cloud(self.types, stamp_ns, 'world', rows))
        self.publishers['goals'].publish(goal_poses(self.types, stamp_ns, 'world', np.array([[*GOAL, 0.0]])))

    def _move(self, stamp_ns: int, tick: int) -> None:
        """Send a hand that circles slowly around its start: all classes stay open."""
        from foc_ros.ros.messages.input_messages import hand_pose

        angle = 2 * np.pi * tick * PERIOD_S / 3.0
        place = (0.005 * (1 - np.cos(angle)), 0.005 * np.sin(angle), 0.0)
        self.publishers['hand_pose'].publish(hand_pose(self.types, stamp_ns, 'world', place))

    def _spin(self, seconds: float) -> None:
        until = time.perf_counter() + seconds
        while (left := until - time.perf_counter()) > 0:
            self.executor.spin_once(timeout_sec=left)

    def _until(self, condition: Any, seconds: float) -> None:
        until = time.perf_counter() + seconds
        while not condition() and time.perf_counter() < until:
            self.executor.spin_once(timeout_sec=0.05)
