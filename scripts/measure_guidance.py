"""Measure the period of the wrench while predictions take long, and the time from the clutch to a force of zero.

The node runs in a process of its own, where every prediction first keeps Python's global lock for `--load` seconds. This process
plays a hand at 100 Hz and notes when wrenches arrive. The node says when its updates of guidance began, and for how long they
computed and waited: for a processor that was taken by other programs, as Linux counts it, and otherwise, which is for Python's
global lock. A third process does nothing but wait for each period, as the thread of guidance does between its updates: no program
in Python has a shorter period on the same machine at the same time. All three have the real-time priority `--priority`, as the
driver of a haptic device has one; 0 is an ordinary priority. Run `.venv/bin/python scripts/measure_guidance.py`.
"""

from __future__ import annotations

import argparse
import json
import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

RATE_HZ = 200.0
OPTIONS = (
    'guidance.enabled:=true',
    'guidance.clearance:=0.0',
    'scene.timeout_s:=0.0',
    'budget_s:=0.0',
)
REPEATS = 10
GUIDED_S = 1.0
"""Time of guidance before each use of the clutch [s]."""


class Waits:
    """When each update of guidance began, and for how long it computed and waited [s]: for a processor, and otherwise."""

    def __init__(self) -> None:
        self._rows: list[tuple[float, ...]] = []

    def time(self, update: Callable[..., None]) -> Callable[..., None]:
        """Return an update whose waits are noted."""

        def timed(*arguments: Any) -> None:
            with Path('/proc/thread-self/schedstat').open('rb', buffering=0) as counts:
                begin = self._read(counts)
                update(*arguments)
                wall, processor, queue = self._read(counts) - begin
            self._rows.append((begin[0], processor, queue, wall - processor - queue))

        return timed

    def summarise(self) -> dict[str, float]:
        """Return 99th percentiles: of the period between updates, in nominal periods, and of times [s]."""
        table = np.array(self._rows or [(np.nan,) * 4] * 2)
        names = 'computing_p99_s', 'wait_processor_p99_s', 'wait_lock_p99_s'
        times = dict(zip(names, np.percentile(table[:, 1:], 99, axis=0).tolist(), strict=True))
        return {'update_period_p99': float(RATE_HZ * np.percentile(np.diff(table[:, 0]), 99)), **times}

    @staticmethod
    def _read(counts: Any) -> Any:
        """Return clock, time of computing and time in the queue of this thread [s]."""
        return np.array([time.monotonic(), time.thread_time(), 1e-9 * int(os.pread(counts.fileno(), 100, 0).split()[1])])


def set_priority(priority: int) -> None:
    """Set the real-time priority of this process; its later threads have it too."""
    os.sched_setscheduler(0, os.SCHED_FIFO if priority else os.SCHED_OTHER, os.sched_param(priority))


def run_node(load_s: float, priority: int) -> int:
    """Run the node with predictions that keep the global lock for a time [s]; print the waits at the end."""
    from foc_ros.core.pipeline import PredictionTask
    from foc_ros.ros.guidance_loop import GuidanceLoop
    from foc_ros.ros.main import main

    waits = Waits()
    GuidanceLoop.update = waits.time(GuidanceLoop.update)  # type: ignore[method-assign]

    run = PredictionTask.run

    def run_slowly(task: PredictionTask) -> Any:
        end = time.monotonic() + load_s
        while time.monotonic() < end:
            sum(range(100))
        return run(task)

    PredictionTask.run = run_slowly  # type: ignore[method-assign, assignment]
    options = *OPTIONS, f'guidance.realtime_priority:={priority}'
    code = main(['--ros-args', *(word for option in options for word in ('-p', option))])
    print(json.dumps(waits.summarise()))
    return code


def run_idle(priority: int) -> int:
    """Wait for each period until the process is terminated; print the 99th percentile of the period, in nominal periods."""
    set_priority(priority)
    begun: list[float] = []
    is_over = threading.Event()
    signal.signal(signal.SIGTERM, lambda *_: is_over.set())
    due_s = time.monotonic()
    while not is_over.wait(max(due_s - time.monotonic(), 0.0)):
        begun.append(time.monotonic())
        due_s = max(due_s + 1.0 / RATE_HZ, begun[-1])
    print(json.dumps({'idle_period_p99': float(RATE_HZ * np.percentile(np.diff(begun), 99))}))
    return 0


class Player:
    """Plays a hand that passes an obstacle, and keeps the arrival time [s] and the size [N] of every wrench."""

    def __init__(self, node: Any) -> None:
        from geometry_msgs.msg import PoseArray, PoseStamped, WrenchStamped
        from rclpy.qos import qos_profile_sensor_data
        from sensor_msgs.msg import PointCloud2
        from std_srvs.srv import SetBool

        from foc_ros.ros.messages.encode_inputs import encode_goals, encode_obstacles
        from foc_ros.ros.messages.types import RclpyTypes

        self._types, self._tick = RclpyTypes(), 0
        self.wrenches: list[tuple[float, float]] = []
        self._hand = node.create_publisher(PoseStamped, 'hand_pose', qos_profile_sensor_data)
        self._scene = node.create_publisher(PointCloud2, 'obstacles', 10), node.create_publisher(PoseArray, 'goals', 10)
        node.create_subscription(WrenchStamped, 'foc/guidance/wrench', self._note, 100)
        node.create_timer(0.01, self._move)
        self.clutch, self._request = node.create_client(SetBool, 'foc/engage'), SetBool.Request
        rows = [(0.15, 0.02, 0.0, 0.03, 0.0, 0.0)]
        self._messages = (
            encode_obstacles(self._types, 1, 'world', rows),
            encode_goals(self._types, 1, 'world', np.eye(3)[:1] * 0.3),
        )

    def engage(self, is_on: bool) -> Any:
        """Close or open the clutch; return the future."""
        return self.clutch.call_async(self._request(data=is_on))

    def _move(self) -> None:
        from foc_ros.ros.messages.encode_inputs import encode_hand_pose

        self._tick += 1
        if self._tick % 50 == 1:
            for publisher, message in zip(self._scene, self._messages, strict=True):
                publisher.publish(message)
        t = 0.01 * (self._tick % 150)
        position = (0.15 * t, 0.02 * np.sin(6.0 * t), 0.0)
        self._hand.publish(encode_hand_pose(self._types, time.time_ns(), 'world', position))

    def _note(self, message: Any, info: dict[str, int]) -> None:
        force = message.wrench.force
        self.wrenches.append((1e-9 * info['received_timestamp'], float(np.hypot(force.x, force.y))))


def measure(load_s: float, priority: int) -> dict[str, float]:
    """Return percentiles of the period, in nominal periods, the times from the clutch to a force of zero, and the waits [s]."""
    import rclpy
    from rclpy.executors import SingleThreadedExecutor

    def start(*words: str) -> subprocess.Popen[bytes]:
        command = sys.executable, __file__, '--load', str(load_s), '--priority', str(priority), *words
        return subprocess.Popen(command, stdout=subprocess.PIPE)

    with start('--node') as node_process, start('--idle') as idle_process, rclpy.Context() as context:
        set_priority(priority)
        node = rclpy.create_node('player', context=context)
        executor = SingleThreadedExecutor(context=context)
        executor.add_node(node)
        try:
            played = _play(Player(node), executor)
        finally:
            for process in (node_process, idle_process):
                process.terminate()
            said = [process.communicate()[0] for process in (node_process, idle_process)]
        measured: list[dict[str, float]] = [json.loads(each.splitlines()[-1]) for each in said]
        return played | measured[0] | measured[1]


def _play(player: Player, executor: Any) -> dict[str, float]:
    def spin(seconds: float) -> None:
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            executor.spin_once(timeout_sec=0.01)

    end = time.monotonic() + 60.0
    while not player.wrenches and time.monotonic() < end:
        spin(0.1)
    periods, delays = [], []
    for _ in range(REPEATS):
        player.engage(True)
        spin(0.5)
        player.wrenches.clear()
        spin(GUIDED_S)
        periods += np.diff([at for at, _ in player.wrenches]).tolist()
        asked = time.time()
        player.engage(False)
        spin(0.5)
        zeros = [at for at, force in player.wrenches if at > asked and force == 0.0]
        delays.append(zeros[0] - asked if zeros else np.inf)
    p50, p99, longest = RATE_HZ * np.percentile(periods, [50, 99, 100])
    return {
        'wrenches': len(periods),
        'period_p50': float(p50),
        'period_p99': float(p99),
        'period_max': float(longest),
        'to_zero_p50_s': float(np.median(delays)),
        'to_zero_max_s': float(np.max(delays)),
    }


def main() -> int:
    """Print the measurement as a JSON object."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--load', type=float, default=0.03, metavar='S', help='time for which each prediction keeps the lock')
    parser.add_argument('--priority', type=int, default=50, help='real-time priority (default: %(default)s)')
    parser.add_argument('--node', action='store_true', help='run the node (used by the script itself)')
    parser.add_argument('--idle', action='store_true', help='wait for each period (used by the script itself)')
    arguments = parser.parse_args()
    if arguments.idle:
        return run_idle(arguments.priority)
    if arguments.node:
        return run_node(arguments.load, arguments.priority)
    os.environ.setdefault('ROS_AUTOMATIC_DISCOVERY_RANGE', 'LOCALHOST')
    print(json.dumps({'load_s': arguments.load, 'priority': arguments.priority, **measure(arguments.load, arguments.priority)}))
    return 0


if __name__ == '__main__':
    sys.exit(main())
