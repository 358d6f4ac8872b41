# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""A small stand-in for a teleoperation stack: a hand that reaches to and fro, a scene, and a consumer of the prediction.

Run it beside the node, `foc_ros node --ros-args -r hand_pose:=MTMR/measured_cp -p guidance.enabled:=true`. With `--seconds 20` it
ends by itself. It publishes a set point: the position of the hand, moved towards the predicted path by a share of at most
LARGEST_SHARE, and by the force of guidance, as on a compliant device. The share grows while predictions are fresh, and falls to
zero as soon as they are not, whatever the reason is. The consumer judges a prediction by its stamp alone.
"""

from __future__ import annotations

import argparse
import signal
import sys
import time

import numpy as np
import rclpy
from geometry_msgs.msg import Pose, PoseArray, PoseStamped, WrenchStamped
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import qos_profile_sensor_data
from rclpy.signals import SignalHandlerOptions
from rclpy.time import Time
from rclpy.utilities import remove_ros_args
from sensor_msgs.msg import PointCloud2, PointField
from std_msgs.msg import Float64

FRAME = 'world'
GOALS = np.array([[0.0, 0.0, 0.1], [0.3, 0.0, 0.1]])
REACH_S, PAUSE_S = 1.2, 0.3
OBSTACLES = np.array([(0.15, 0.01, 0.1, 0.03)], dtype=[(name, '<f4') for name in ('x', 'y', 'z', 'radius')])
FRESH_S = 0.3
"""Age of the hand pose beyond which a prediction is not used."""
LARGEST_SHARE, RISE_PER_S = 0.4, 1.0
LOOKAHEAD_S = 0.05
COMPLIANCE_M_PER_N = 0.002
"""How far a force of guidance moves the set point, in place of a haptic device."""
FORCE_FRESH_S = 0.05
"""Age beyond which a force is not used: the node publishes 200 of them each second."""


def compute_hand_position(seconds: float) -> np.ndarray:
    """Return the position of the hand (3,) [m]: minimum-jerk reaches between the goals, on an arc around the obstacle."""
    turn, rest = divmod(seconds, REACH_S + PAUSE_S)
    s = min(rest / REACH_S, 1.0)
    share = 10 * s**3 - 15 * s**4 + 6 * s**5
    start, end = GOALS[int(turn) % 2], GOALS[(int(turn) + 1) % 2]
    return start + share * (end - start) + np.array([0.0, 0.06 * np.sin(np.pi * share), 0.0])


class TeleoperationLoop(Node):
    """Publishes MTMR/measured_cp, obstacles and goals, reads foc/prediction, and publishes the set point and the share."""

    def __init__(self, context: rclpy.Context) -> None:
        super().__init__('teleoperation', context=context)
        self.declare_parameter('obstacles', True)
        self._began, self._share, self._prediction = time.monotonic(), 0.0, None
        self._hand = self.create_publisher(PoseStamped, 'MTMR/measured_cp', qos_profile_sensor_data)
        self._obstacles = self.create_publisher(PointCloud2, 'obstacles', 10)
        self._goals = self.create_publisher(PoseArray, 'goals', 10)
        self._set_point = self.create_publisher(PoseStamped, 'PSM1/servo_cp', 10)
        self._shares = self.create_publisher(Float64, '~/share', 10)
        self.create_subscription(PointCloud2, 'foc/prediction', self._keep_prediction, 10)
        self._force, self._force_s = np.zeros(3), 0.0
        self.create_subscription(WrenchStamped, 'foc/guidance/wrench', self._keep_force, 10)
        self.create_timer(0.01, self._move_hand)
        self.create_timer(0.1, self._publish_scene)
        self.create_timer(1.0, self._print_share)

    def _keep_prediction(self, cloud: PointCloud2) -> None:
        self._prediction = cloud

    def _keep_force(self, message: WrenchStamped) -> None:
        force = message.wrench.force
        self._force, self._force_s = np.array([force.x, force.y, force.z]), time.monotonic()

    def _move_hand(self) -> None:
        now, position = self.get_clock().now(), compute_hand_position(time.monotonic() - self._began)
        self._hand.publish(self._make_pose(now, position))
        target = self._find_target(now)
        step = 0.01 * RISE_PER_S
        self._share = min(self._share + step, LARGEST_SHARE) if target is not None else 0.0
        self._shares.publish(Float64(data=self._share))
        blended = position if target is None else position + self._share * (target - position)
        if time.monotonic() - self._force_s < FORCE_FRESH_S:
            blended = blended + COMPLIANCE_M_PER_N * self._force
        self._set_point.publish(self._make_pose(now, blended))

    def _find_target(self, now: Time) -> np.ndarray | None:
        """Return the position (3,) [m] on the most likely path in LOOKAHEAD_S, or None without a fresh prediction."""
        if self._prediction is None:
            return None
        age_s = (now - Time.from_msg(self._prediction.header.stamp)).nanoseconds * 1e-9
        rows = read_table(self._prediction)
        rows = rows[rows['candidate'] == 0]
        if not len(rows) or age_s > FRESH_S:
            return None
        row = rows[min(np.searchsorted(rows['t'], age_s + LOOKAHEAD_S), len(rows) - 1)]
        return np.array([row['x'], row['y'], row['z']], dtype=float)

    def _print_share(self) -> None:
        print(f'{time.monotonic() - self._began:4.0f} s: following the prediction by {self._share:.0%}', flush=True)

    def _publish_scene(self) -> None:
        stamp = self.get_clock().now().to_msg()
        goals = PoseArray()
        goals.header.stamp, goals.header.frame_id = stamp, FRAME
        goals.poses = [self._make_pose(self.get_clock().now(), goal).pose for goal in GOALS]
        self._goals.publish(goals)
        if self.get_parameter('obstacles').value:
            cloud = PointCloud2(height=1, width=len(OBSTACLES), point_step=OBSTACLES.itemsize, row_step=OBSTACLES.nbytes)
            cloud.header.stamp, cloud.header.frame_id = stamp, FRAME
            cloud.fields = [
                PointField(name=name, offset=4 * i, datatype=PointField.FLOAT32, count=1)
                for i, name in enumerate(OBSTACLES.dtype.names)
            ]
            cloud.data = OBSTACLES.tobytes()
            self._obstacles.publish(cloud)

    def _make_pose(self, now: Time, position: np.ndarray) -> PoseStamped:
        message = PoseStamped(pose=Pose())
        message.header.stamp, message.header.frame_id = now.to_msg(), FRAME
        point = message.pose.position
        point.x, point.y, point.z = (float(value) for value in position)
        return message


def read_table(cloud: PointCloud2) -> np.ndarray:
    """Return the rows of a prediction as a structured array."""
    kinds = {PointField.FLOAT32: '<f4', PointField.UINT32: '<u4'}
    return np.frombuffer(cloud.data, dtype=[(field.name, kinds[field.datatype]) for field in cloud.fields])


def main() -> int:
    """Run until SIGINT or SIGTERM, or for the given number of seconds."""
    parser = argparse.ArgumentParser(description='A small stand-in for a teleoperation stack.')
    parser.add_argument('--seconds', type=float, default=float('inf'))
    until = time.monotonic() + parser.parse_args(remove_ros_args(sys.argv)[1:]).seconds
    stopped: list[int] = []
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda number, _: stopped.append(number))
    context = rclpy.Context()
    rclpy.init(args=sys.argv, context=context, signal_handler_options=SignalHandlerOptions.NO)
    executor = SingleThreadedExecutor(context=context)
    node = TeleoperationLoop(context)
    executor.add_node(node)
    while not stopped and time.monotonic() < until:
        executor.spin_once(timeout_sec=0.1)
    executor.shutdown()
    node.destroy_node()
    context.try_shutdown()
    return 0


if __name__ == '__main__':
    sys.exit(main())
