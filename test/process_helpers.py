# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The node as a process of its own, and a player that publishes its inputs and hears its outputs."""

import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from message_helpers import SECOND, cloud, obstacle_table, pose_array, pose_stamped
from node_helpers import GOALS, ROWS, TYPES, Player, figures
from ros_helpers import Graph

ROOT = Path(__file__).parents[1]
MODULE = [sys.executable, '-m', 'foc_ros.ros.main']


def parameters(*given: str) -> list[str]:
    """Return the arguments of a node that set parameters, each as `name:=value`."""
    return ['--ros-args', *(word for each in given for word in ('-p', each))]


@contextmanager
def running(
    ros: Graph, *arguments: str, command: list[str] = MODULE, cwd: Path = ROOT, **variables: str
) -> Iterator[subprocess.Popen[str]]:
    """Run a node in a graph; variables: of its environment."""
    pipes = {'stdout': subprocess.PIPE, 'stderr': subprocess.PIPE, 'text': True}
    with subprocess.Popen([*command, *arguments], cwd=cwd, env=ros.environment | variables, **pipes) as process:
        try:
            yield process
        finally:
            # a process that is killed remains in the graph for 20 s, and the next test in this domain would take it for its own
            process.terminate()
            try:
                process.wait(10)
            except subprocess.TimeoutExpired:
                process.kill()


def ended(process: subprocess.Popen[str], number: signal.Signals = signal.SIGTERM) -> tuple[int, str]:
    """Send a signal; return the exit code and the text on standard error."""
    process.send_signal(number)
    _, errors = process.communicate(timeout=30)
    return process.returncode, errors


class ScenePlayer(Player):
    """Publishes a scene and the hand, and keeps the predictions; sent: number of poses."""

    def __init__(self, ros: Graph, hand: str = 'hand_pose') -> None:
        super().__init__(ros, ['prediction'], hand_pose=hand)
        self.sent, self.predictions = 0, self.received['prediction']

    @property
    def statuses(self) -> list[Any]:
        return [each.status[0] for each in self.diagnostics]

    def figure(self, name: str) -> str | None:
        return figures(self.statuses[-1]).get(name) if self.diagnostics else None

    def connect(self) -> None:
        self.ros.spin_until(lambda: all(each.get_subscription_count() for each in self.publishers.values()), 'the node', 30.0)

    def publish_scene(self, stamp_ns: int = 10 * SECOND) -> None:
        self.publishers['obstacles'].publish(cloud(TYPES, obstacle_table(ROWS), stamp_ns))
        self.publishers['goals'].publish(pose_array(TYPES, GOALS))

    def is_scene_known(self) -> bool:
        return self.figure('obstacles of cloud') is not None and self.figure('goals') == '1'

    def publish_pose(self, stamp_ns: int, x: float) -> None:
        """Publish a hand pose, the height of which is 0.1 m."""
        self.publishers['hand_pose'].publish(pose_stamped(TYPES, (x, 0.0, 0.1), stamp_ns))
        self.sent += 1

    def play_until(self, is_enough: Callable[[], bool], what: str) -> None:
        """Publish the scene at 10 Hz and, once the node has it, hand poses at 100 Hz by their stamps, until it is enough.

        The hand moves to and fro before the obstacle, so that it can be predicted for as long as that takes. what: is awaited.
        """
        self.connect()
        ticks = iter(range(10_000))

        def play_and_check() -> bool:
            tick = next(ticks)
            stamp_ns = 10 * SECOND + tick * SECOND // 100
            if tick % 10 == 0:
                self.publish_scene(stamp_ns)
            if self.sent or self.is_scene_known():
                self.publish_pose(stamp_ns, 0.05 * np.sin(0.02 * self.sent))
            self.ros.spin_for(0.01)
            return is_enough()

        self.ros.spin_until(play_and_check, what, 40.0)

    def play_in_time(self, seconds: float, pose_hz: float, tick: Callable[[int], Any] = lambda _: None) -> None:
        """Publish every 10 ms of real time the poses that are due, and call `tick(i)`."""
        began = time.monotonic()
        for i in range(round(100 * seconds)):
            tick(i)
            while self.sent < pose_hz * 0.01 * (i + 1):
                self.publish_pose(10 * SECOND + round(self.sent / pose_hz * SECOND), 5e-4 * (self.sent % 3))
            self.ros.spin_for(max(began + 0.01 * (i + 1) - time.monotonic(), 0.001))


def predict_once(ros: Graph, hand: str = 'hand_pose') -> ScenePlayer:
    player = ScenePlayer(ros, hand)
    player.play_until(lambda: bool(player.predictions), 'a prediction')
    return player
