"""The node in another process: hand poses at 100 Hz, the delay of each prediction, and the predictions that are lost."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from typing import Any

import numpy as np
from measurement import COST, Agreement, Result, Timing, at_most
from scenes import GOAL, RATE_HZ, START_NS, Reach, build_4x8

from foc_ros.core.config import flatten

DOMAIN = 97
PERIOD_S = 1.0 / RATE_HZ
CONNECT_S, LAST_PREDICTION_S, DIAGNOSTICS_S = 30.0, 3.0, 1.2
PARAMETERS = ('rate_hz', 'foc.noise_x', 'foc.noise_y', 'foc.eta', 'homotopy.max_candidates', 'duration.model', 'duration.fixed_s')
BUDGET_S = 0.8 * PERIOD_S
"""Parameter `budget_s`. Candidates that do not fit into it are continued in the next prediction, so that no pose has to wait."""


def measure_node(is_quick: bool) -> Result:
    """Measure 4 classes among 8 obstacles for 60 s."""
    seconds = 5.0 if is_quick else 60.0
    reach = build_4x8()
    os.environ.update({'ROS_DOMAIN_ID': str(DOMAIN), 'ROS_AUTOMATIC_DISCOVERY_RANGE': 'LOCALHOST'})
    values = flatten(reach.config) | {'budget_s': BUDGET_S}
    options = [part for name in (*PARAMETERS, 'budget_s') for part in ('-p', f'{name}:={values[name]}')]
    with subprocess.Popen([sys.executable, '-m', 'foc_ros.ros.main', '--ros-args', *options]) as process:
        try:
            player = Player(reach)
            delays, sent = player.play(seconds)
        finally:
            process.send_signal(signal.SIGTERM)
    lost = sent - len(delays)
    p50, p99 = (1e3 * float(np.percentile(delays, share)) if delays else np.inf for share in (50, 99))
    details = {
        'p50_ms': p50,
        'slowest_ms': 1e3 * max(delays, default=np.inf),
        'lost': lost,
        'candidates_out_of_time': player.out_of_time,
    }
    return Result(
        Timing(
            f'99th percentile from a pose sent to its prediction received, {seconds:g} s at 100 Hz, budget_s {BUDGET_S:g}',
            p99,
        ),
        Timing('the period of the poses', 1e3 * PERIOD_S),
        COST,
        Agreement(lost == 0, f'{lost} of {sent} predictions lost (none allowed)'),
        sent,
        at_most(1.0),
        details,
    )


class Player:
    """Publishes what a tracker and a perception node would publish, and records when each prediction arrives, by stamp."""

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
        self.node.create_subscription(PointCloud2, 'foc/prediction', self._record_arrival, 1000)
        self.node.create_subscription(DiagnosticArray, '/diagnostics', self._record_diagnostics, 10)

    def _record_arrival(self, cloud: Any) -> None:
        stamp = cloud.header.stamp
        self.arrived.setdefault(stamp.sec * 1_000_000_000 + stamp.nanosec, time.perf_counter())

    def _record_diagnostics(self, message: Any) -> None:
        """Store how many candidates of all predictions were not solved for lack of time."""
        counts = {each.key: each.value for status in message.status for each in status.values}
        self.out_of_time = int(counts.get('count candidate_deadline', 0))

    def play(self, seconds: float) -> tuple[list[float], int]:
        """Return the delays [s] of the predictions that arrived, and the number of poses sent."""
        self._spin_until(lambda: all(each.get_subscription_count() for each in self.publishers.values()), CONNECT_S)
        count, sent = round(seconds * RATE_HZ), {}
        self._publish_scene(START_NS)
        self._spin_for(1.0)
        began = time.perf_counter()
        for tick in range(count):
            stamp_ns = START_NS + round(tick * PERIOD_S * 1e9)
            if tick % 50 == 0:
                self._publish_scene(stamp_ns)
            self._spin_for(began + tick * PERIOD_S - time.perf_counter())
            sent[stamp_ns] = time.perf_counter()
            self._publish_hand(stamp_ns, tick)
        self._spin_until(lambda: sent.keys() <= self.arrived.keys(), LAST_PREDICTION_S)
        self._spin_for(DIAGNOSTICS_S)
        return [self.arrived[stamp] - at for stamp, at in sent.items() if stamp in self.arrived], count

    def _publish_scene(self, stamp_ns: int) -> None:
        from foc_ros.ros.messages.encode_inputs import encode_goals, encode_obstacles

        circles = self.reach.obstacles
        table = zip(circles.centre, circles.radius, circles.radius_stddev, strict=True)
        rows = [(*centre, 0.0, radius, stddev, number) for number, (centre, radius, stddev) in enumerate(table)]
        self.publishers['obstacles'].publish(encode_obstacles(self.types, stamp_ns, 'world', rows))
        self.publishers['goals'].publish(encode_goals(self.types, stamp_ns, 'world', np.array([[*GOAL, 0.0]])))

    def _publish_hand(self, stamp_ns: int, tick: int) -> None:
        """Publish a hand that circles slowly around its start, so that all classes stay open."""
        from foc_ros.ros.messages.encode_inputs import encode_hand_pose

        angle = 2 * np.pi * tick * PERIOD_S / 3.0
        position = (0.005 * (1 - np.cos(angle)), 0.005 * np.sin(angle), 0.0)
        self.publishers['hand_pose'].publish(encode_hand_pose(self.types, stamp_ns, 'world', position))

    def _spin_for(self, seconds: float) -> None:
        end = time.perf_counter() + seconds
        while (left := end - time.perf_counter()) > 0:
            self.executor.spin_once(timeout_sec=left)

    def _spin_until(self, condition: Callable[[], bool], seconds: float) -> None:
        end = time.perf_counter() + seconds
        while not condition() and time.perf_counter() < end:
            self.executor.spin_once(timeout_sec=0.05)
