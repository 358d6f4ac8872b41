"""Rates and delays of a live node in its own process: `python scripts/measure_node.py`.

The player publishes a hand at 1 kHz and 50 obstacles at 30 Hz with jitter, all of them with best effort, and with `--moving` in
the frame of a camera whose transform is sent 5 ms later (this needs tf2). The script prints

- discovery: time from the line "ready" of the node until DDS has connected its inputs to the player [s],
- start: time from the line "ready" of the node to its first prediction [s]; with `--starts 20` these two of 20 starts,
- rate: predictions per second at the default budget; the longest time between two of them; the median and the largest age of one,
  by the stamp of its pose, when it was published [s]; how many were older than two periods of `rate_hz`,
- clutch: the longest answer of `~/engage` in this load [s],
- intake: what a hand at 1 kHz costs, as a share of one core: the CPU time of a node that predicts once in ten seconds. On a
  busy machine fewer poses are published, and their share is scaled to 1 kHz.

Other programs of the machine lengthen all times: run it alone.
"""

from __future__ import annotations

import argparse
import os
import select
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from soak import isolated_graph

from foc_ros.core.config import Config
from foc_ros.core.types import NANOSECONDS
from foc_ros.ros.messages.encode_inputs import encode_goals, encode_hand_pose, encode_obstacles
from foc_ros.ros.messages.types import RclpyTypes

HAND_HZ, OBSTACLES_HZ, COUNT, LATE_S = 1000.0, 30.0, 50, 0.005
PERIOD_S = 1.0 / Config().rate_hz
START_S = 60.0
"""Time within which a node has to be ready [s]."""
GOALS = np.array([[0.3, 0.0, 0.0]])


class Player:
    """Publishes the inputs, calls the clutch, and keeps what it hears. moving: whether the inputs are in a moving frame."""

    def __init__(self, moving: bool) -> None:
        import rclpy
        from diagnostic_msgs.msg import DiagnosticArray
        from geometry_msgs.msg import PoseArray, PoseStamped
        from rclpy.executors import SingleThreadedExecutor
        from rclpy.qos import QoSProfile, QoSReliabilityPolicy
        from rclpy.signals import SignalHandlerOptions
        from sensor_msgs.msg import PointCloud2
        from std_srvs.srv import SetBool

        self._context = rclpy.Context()
        rclpy.init(args=[], context=self._context, signal_handler_options=SignalHandlerOptions.NO)
        self._node = rclpy.create_node('player', context=self._context)
        self._executor = SingleThreadedExecutor(context=self._context)
        self._executor.add_node(self._node)
        best_effort = QoSProfile(depth=100, reliability=QoSReliabilityPolicy.BEST_EFFORT)
        self._hand = self._node.create_publisher(PoseStamped, 'hand_pose', best_effort)
        self._obstacles = self._node.create_publisher(PointCloud2, 'obstacles', best_effort)
        self._goals = self._node.create_publisher(PoseArray, 'goals', 10)
        self._node.create_subscription(PointCloud2, 'foc/prediction', self._receive_prediction, 100)
        self._node.create_subscription(DiagnosticArray, '/diagnostics', self._receive_health, 10)
        self._engage, self._request = self._node.create_client(SetBool, 'foc/engage'), SetBool.Request(data=True)
        self._broadcaster = self._create_broadcaster() if moving else None
        self._types, self._random = RclpyTypes(), np.random.default_rng(0)
        self._rows = [
            (x, y, 0.0, 0.008, 0.001, i) for i, (x, y) in enumerate(self._random.uniform((0.03, -0.15), (0.27, 0.15), (COUNT, 2)))
        ]
        self.sent = 0
        self.stamps_ns: list[int] = []
        self.ages_s: list[float] = []
        self.heard_s: list[float] = []
        self.answers_s: list[float] = []
        self.health: dict[str, str] = {}

    def close(self) -> None:
        """Leave the graph."""
        self._executor.shutdown()
        self._node.destroy_node()
        self._context.try_shutdown()

    def forget(self) -> None:
        """Forget the times so far."""
        for values in (self.stamps_ns, self.ages_s, self.heard_s, self.answers_s):
            values.clear()

    def play(self, seconds: float, hand_hz: float = HAND_HZ, until: Callable[[], bool] = lambda: False) -> None:
        """Publish in real time for some seconds, or until a condition holds."""
        began = time.monotonic()
        due = {'hand': began, 'obstacles': began, 'goals': began, 'clutch': began + 0.5}
        late: list[tuple[float, int]] = []
        while (now := time.monotonic()) - began < seconds and not until():
            stamp_ns = self._node.get_clock().now().nanoseconds
            if hand_hz and now >= due['hand']:
                due['hand'] = max(due['hand'] + 1.0 / hand_hz, now - 0.01)
                phase = 0.5 - 0.5 * np.cos(2.0 * np.pi * (now - began) / 2.0)
                position = np.array([0.28 * phase, 0.05 * phase, 0.1])
                self.sent += 1
                self._hand.publish(encode_hand_pose(self._types, stamp_ns, self._frame, position))
                late.append((now + LATE_S, stamp_ns))
            if now >= due['obstacles']:
                due['obstacles'] = now + (1.0 + self._random.uniform(-0.3, 0.3)) / OBSTACLES_HZ
                self._obstacles.publish(encode_obstacles(self._types, stamp_ns, self._frame, self._rows))
            if now >= due['goals']:
                due['goals'] = now + 0.5
                self._goals.publish(encode_goals(self._types, stamp_ns, 'world', GOALS))
            if now >= due['clutch'] and self._engage.service_is_ready():
                due['clutch'] = now + 0.05
                self._engage.call_async(self._request).add_done_callback(
                    lambda _, asked_s=now: self.answers_s.append(time.monotonic() - asked_s)
                )
            while late and late[0][0] <= now:
                self._send_transform(late.pop(0)[1])
            self._executor.spin_once(timeout_sec=max(min(due.values()) - time.monotonic(), 0.0) if hand_hz else 0.005)

    @property
    def is_connected(self) -> bool:
        """Whether the node's inputs are connected."""
        return all(each.get_subscription_count() for each in (self._hand, self._obstacles, self._goals))

    @property
    def _frame(self) -> str:
        return 'world' if self._broadcaster is None else 'camera'

    def _create_broadcaster(self) -> Any:
        from tf2_ros import TransformBroadcaster

        return TransformBroadcaster(self._node)

    def _send_transform(self, stamp_ns: int) -> None:
        """Send every tenth transform of a camera that moves slowly."""
        if self._broadcaster is None or (stamp_ns // 1_000_000) % 10:
            return
        from geometry_msgs.msg import TransformStamped
        from rclpy.time import Time

        message = TransformStamped(child_frame_id='camera')
        message.header.frame_id, message.header.stamp = 'world', Time(nanoseconds=stamp_ns).to_msg()
        message.transform.translation.y = 0.01 * float(np.sin(stamp_ns * 1e-9))
        self._broadcaster.sendTransform(message)

    def _receive_prediction(self, cloud: Any, information: dict[str, int]) -> None:
        stamp_ns = cloud.header.stamp.sec * NANOSECONDS + cloud.header.stamp.nanosec
        self.stamps_ns.append(stamp_ns)
        self.heard_s.append(time.monotonic())
        self.ages_s.append((information['source_timestamp'] - stamp_ns) / NANOSECONDS)

    def _receive_health(self, array: Any) -> None:
        self.health = {each.key: each.value for each in array.status[0].values} | {'message': array.status[0].message}


@contextmanager
def run_node(*parameters: str) -> Iterator[subprocess.Popen[str]]:
    """Start a node, and stop it at the end."""
    options = [word for each in parameters for word in ('-p', each)]
    command = [sys.executable, '-m', 'foc_ros.ros.main', '--ros-args', *options]
    with subprocess.Popen(command, stderr=subprocess.PIPE, text=True, bufsize=1) as process:
        try:
            yield process
        finally:
            process.terminate()
            process.communicate(timeout=30)


def wait_until_ready(process: subprocess.Popen[str]) -> None:
    """Read the log of a node until its line "ready"; RuntimeError if there is none."""
    assert process.stderr is not None
    deadline = time.monotonic() + START_S
    while time.monotonic() < deadline and select.select([process.stderr], [], [], START_S)[0]:
        line = process.stderr.readline()
        if 'ready' in line or not line:
            break
    else:
        raise RuntimeError('the node is not ready')


def read_cpu_s(process: subprocess.Popen[str]) -> float:
    """Return the CPU time of a process [s]."""
    fields = Path(f'/proc/{process.pid}/stat').read_text('ascii').rpartition(')')[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf('SC_CLK_TCK')


def measure_start(player: Player, process: subprocess.Popen[str]) -> tuple[float, float]:
    """Return the times from the line "ready" of a node to its connection and to its first prediction [s]."""
    wait_until_ready(process)
    began = time.monotonic()
    player.play(60.0, until=lambda: player.is_connected)
    discovery_s = time.monotonic() - began
    player.play(60.0, until=lambda: bool(player.heard_s))
    return discovery_s, time.monotonic() - began


def measure_starts(player: Player, number: int, *parameters: str) -> None:
    """Start a node several times beside the same player, and print the times."""
    times_s = []
    for _ in range(number):
        with run_node(*parameters) as process:
            times_s.append(measure_start(player, process))
        player.play(10.0, 0.0, until=lambda: not player.is_connected)
        player.forget()
    for name, found_s in zip(('discovery [s]', 'start [s]'), np.sort(np.array(times_s), axis=0).T, strict=True):
        print(f'{name:28} {" ".join(f"{each:.2f}" for each in found_s)}')


def measure_predictions(player: Player, seconds: float, *parameters: str) -> dict[str, float]:
    """Measure the start, the rate and the clutch."""
    with run_node(*parameters) as process:
        discovery_s, start_s = measure_start(player, process)
        player.play(2.0)
        player.forget()
        player.play(seconds)
    ages_s = np.array(player.ages_s or [float('nan')])
    return {
        'discovery [s]': discovery_s,
        'start [s]': start_s,
        'rate [Hz]': len(player.stamps_ns) / seconds,
        'longest gap [s]': float(np.diff(player.heard_s).max(initial=0.0)),
        'median age [s]': float(np.median(ages_s)),
        'largest age [s]': float(ages_s.max()),
        'older than two periods': int((ages_s > 2.0 * PERIOD_S).sum()),
        'longest answer [s]': max(player.answers_s, default=float('nan')),
    }


def measure_intake(player: Player, seconds: float, *parameters: str) -> dict[str, float]:
    """Measure the CPU time of a node that hardly predicts, with the hand and without."""
    shares, rates = [], []
    with run_node('rate_hz:=0.1', *parameters) as process:
        wait_until_ready(process)
        player.play(3.0)
        for hand_hz in (HAND_HZ, 0.0):
            player.play(0.5, hand_hz)
            before, sent, began = read_cpu_s(process), player.sent, time.monotonic()
            player.play(seconds, hand_hz)
            seconds_played = time.monotonic() - began
            shares.append((read_cpu_s(process) - before) / seconds_played)
            rates.append((player.sent - sent) / seconds_played)
    return {
        'intake at 1 kHz [cores]': (shares[0] - shares[1]) * HAND_HZ / rates[0],
        'poses published [Hz]': rates[0],
        'without a hand [cores]': shares[1],
    }


def main() -> int:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument('--seconds', type=float, default=10.0, help='duration of each measurement (default: %(default)s)')
    parser.add_argument('--starts', type=int, default=0, help='start a node so many times, and print the times of these starts')
    parser.add_argument('--moving', action='store_true', help='publish in a moving frame, which needs tf2')
    arguments = parser.parse_args()
    parameters = ['frame_id:=world'] if arguments.moving else []
    with isolated_graph():
        if arguments.starts:
            player = Player(arguments.moving)
            measure_starts(player, arguments.starts, *parameters)
            player.close()
            return 0
        for measure in (measure_predictions, measure_intake):
            player = Player(arguments.moving)
            for name, value in measure(player, arguments.seconds, *parameters).items():
                print(f'{name:28} {value:.4g}', flush=True)
            print(f'{player.health.get("message")}', flush=True)
            player.close()
    return 0


if __name__ == '__main__':
    sys.exit(main())
