"""Long run of a node in its own process, with inputs at 100 Hz and random faults: `python scripts/soak.py --minutes 10`.

The exit code is 0 if the memory does not grow after the warm-up, no thread or file remains open, no valid pose is lost, the 99th
percentile of the cycle time does not grow, the node has no internal error, and it stops without an error.

A valid pose is lost if the node never receives it or refuses it. The node predicts from the newest pose that is due, and counts
the due poses before it as dropped cycles; these are printed and are not lost.

Other programs of the machine lengthen the cycles too. The script therefore times a fixed computation all along, and judges only
the growth of the cycle's 99th percentile beyond that of the computation.
"""

from __future__ import annotations

import argparse
import random
import signal
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import numpy as np

from foc_ros.core.types import Array
from foc_ros.ros.isolated_node import private_environment, reserve_domain, set_environment
from foc_ros.ros.messages.encode_inputs import encode_goals, encode_hand_pose, encode_obstacles
from foc_ros.ros.messages.types import RclpyTypes

PERIOD_S = 0.01
REPORT_S = 5.0
FRAME = 'world'
GOALS = np.array([[0.3, 0.0, 0.0], [0.3, 0.1, 0.0]])
ROWS = [(0.15, 0.02, 0.0, 0.03, 0.002, 7), (0.2, 0.08, 0.0, 0.02, 0.002, 8)]
BAD_POSES = {'nan': 'hand_lost', 'camera': 'hand_wrong_frame', 'again': 'hand_duplicate', 'late': 'hand_late'}
"""The node's count of each kind of bad pose; a late pose right after a reset starts a movement, and is not counted."""
FAULTS = (*BAD_POSES, 'burst', 'truncated', 'negative', 'flip', 'parameter', 'wrong parameter', 'crowd', 'clutch', 'reset')
BURST, BURST_NS = 20, 100_000
"""Number of poses sent at once, as after a stall of the network, and the least difference of their stamps [ns]."""
WARM_UP, GROWTH, SLOWER = 0.2, 1.05, 1.5
"""Share of the time that is not judged; largest accepted growth of the memory, and of the 99th percentile."""
PROBE_TURNS, PROBE_ROUNDS = 25, 400_000
"""Number of periods between two fixed computations, and the length of one: some milliseconds."""


@contextmanager
def isolated_graph() -> Iterator[None]:
    """Join a ROS graph of its own within the context, with the processes that are started there."""
    with (
        tempfile.TemporaryDirectory(prefix='foc_ros_graph_') as logs,
        reserve_domain() as domain,
        set_environment(private_environment(domain, Path(logs))),
    ):
        yield


class Player:
    """Publishes hand poses, the scene and faults to a running node; rows, goals: the scene.

    Attributes: sent: number of poses by kind; health: the newest diagnostics; probes_s: times of the fixed computation [s].
    """

    def __init__(self, rows: Sequence[tuple[float, ...]] = ROWS, goals: Array = GOALS) -> None:
        import rclpy
        from diagnostic_msgs.msg import DiagnosticArray
        from geometry_msgs.msg import PoseArray, PoseStamped
        from rcl_interfaces.srv import SetParametersAtomically
        from rclpy.executors import SingleThreadedExecutor
        from rclpy.qos import qos_profile_sensor_data
        from rclpy.signals import SignalHandlerOptions
        from sensor_msgs.msg import PointCloud2
        from std_srvs.srv import SetBool, Trigger

        # The tracker has its own context: in one with the scene, large clouds would fill the memory that DDS shares with the
        # node, and the poses, which are published as best effort, would be lost before they are sent.
        self._contexts = [rclpy.Context(), rclpy.Context()]
        for context in self._contexts:
            rclpy.init(args=[], context=context, signal_handler_options=SignalHandlerOptions.NO)
        names = zip(('soak', 'tracker'), self._contexts, strict=True)
        self._node, self._tracker = (rclpy.create_node(name, context=context) for name, context in names)
        self._executor = SingleThreadedExecutor(context=self._contexts[0])
        self._executor.add_node(self._node)
        kinds = {'obstacles': PointCloud2, 'goals': PoseArray}
        self._publishers = {name: self._node.create_publisher(kind, name, 10) for name, kind in kinds.items()}
        self._publishers['hand_pose'] = self._tracker.create_publisher(PoseStamped, 'hand_pose', qos_profile_sensor_data)
        self._node.create_subscription(PointCloud2, 'foc/prediction', self._receive_prediction, 10)
        self._node.create_subscription(DiagnosticArray, '/diagnostics', self._receive_health, 10)
        self._parameters = self._node.create_client(SetParametersAtomically, 'foc/set_parameters_atomically')
        self._engage = self._node.create_client(SetBool, 'foc/engage')
        self._reset = self._node.create_client(Trigger, 'foc/reset')
        self._types, self._random, self._rows, self._goals = RclpyTypes(), random.Random(1), rows, goals
        self._start = self._next = time.monotonic()
        self._turn, self._stamp_ns = 0, 0
        self.probes_s: list[float] = []
        self.sent = dict.fromkeys(('good', *BAD_POSES), 0)
        self.predictions, self.not_finite = 0, 0
        self.health: Mapping[str, str] = {}

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self._executor.shutdown()
        for node, context in zip((self._node, self._tracker), self._contexts, strict=True):
            node.destroy_node()
            context.try_shutdown()

    @property
    def is_connected(self) -> bool:
        """Whether the node subscribes to every input."""
        return all(publisher.get_subscription_count() for publisher in self._publishers.values())

    def spin(self, seconds: float) -> None:
        """Process messages for a while [s]."""
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            self._executor.spin_once(timeout_sec=max(end - time.monotonic(), 0.0))

    def tick(self, *, faulty: bool = False) -> None:
        """Publish the messages of one period, and process messages for the rest of it."""
        stamp_ns = max(self._node.get_clock().now().nanoseconds, self._stamp_ns + BURST_NS)
        if self._turn % 10 == 0:
            self._publishers['obstacles'].publish(encode_obstacles(self._types, stamp_ns, FRAME, self._rows))
        if self._turn % 50 == 0:
            self._publishers['goals'].publish(encode_goals(self._types, stamp_ns, FRAME, self._goals))
        self._publish_pose(stamp_ns)
        if faulty and self._turn % 20 == 7:
            self._publish_fault(self._random.choice(FAULTS), stamp_ns)
        if self._turn % PROBE_TURNS == 3:
            self._time_fixed_work()
        self._turn += 1
        self._next = max(self._next + PERIOD_S, time.monotonic() - PERIOD_S)
        self.spin(max(self._next - time.monotonic(), 0.0))

    def _publish_pose(self, stamp_ns: int, kind: str = 'good', frame: str = FRAME, x: float | None = None) -> None:
        phase = (time.monotonic() - self._start) % 1.5 / 1.5
        progress = 0.5 - 0.5 * np.cos(2.0 * np.pi * phase)
        position = np.array([0.28 * progress if x is None else x, 0.05 * progress, 0.1])
        self._publishers['hand_pose'].publish(encode_hand_pose(self._types, stamp_ns, frame, position))
        self.sent[kind] += 1
        self._stamp_ns = max(self._stamp_ns, stamp_ns)

    def _time_fixed_work(self) -> None:
        began = time.perf_counter()
        sum(range(PROBE_ROUNDS))
        self.probes_s.append(time.perf_counter() - began)

    def _publish_fault(self, name: str, stamp_ns: int) -> None:
        from rcl_interfaces.srv import SetParametersAtomically
        from rclpy.parameter import Parameter
        from std_srvs.srv import SetBool, Trigger

        if name in BAD_POSES:
            ns = stamp_ns - (50_000_000 if name == 'late' else 0)
            x = np.nan if name == 'nan' else None
            self._publish_pose(ns, name, 'camera' if name == 'camera' else FRAME, x)
        elif name == 'burst':
            for i in range(1, BURST + 1):
                self._publish_pose(stamp_ns + i * BURST_NS)
        elif name in ('truncated', 'negative', 'crowd'):
            rows = [(0.0, 1.0 + 0.001 * i, 0.0, 0.001, 0.0, i) for i in range(10_000)] if name == 'crowd' else ROWS
            rows = [(0.0, 0.0, 0.0, -1.0, 0.0, 1)] if name == 'negative' else rows
            message = encode_obstacles(self._types, stamp_ns, FRAME, rows)
            if name == 'truncated':
                message.data = message.data[:-3]
            self._publishers['obstacles'].publish(message)
        elif name == 'flip':
            self._publishers['goals'].publish(encode_goals(self._types, stamp_ns, FRAME, GOALS[::-1]))
        elif name in ('parameter', 'wrong parameter') and self._parameters.service_is_ready():
            eta = 5.0 if name == 'wrong parameter' else self._random.uniform(0.5, 0.9)
            request = SetParametersAtomically.Request(parameters=[Parameter('foc.eta', value=eta).to_parameter_msg()])
            self._parameters.call_async(request)
        elif name == 'clutch' and self._engage.service_is_ready():
            self._engage.call_async(SetBool.Request(data=False))
            self._engage.call_async(SetBool.Request(data=True))
        elif name == 'reset' and self._reset.service_is_ready():
            self._reset.call_async(Trigger.Request())

    def _receive_prediction(self, cloud: Any) -> None:
        self.predictions += 1
        rows = np.frombuffer(cloud.data, dtype=np.uint8).reshape(-1, cloud.point_step)
        numbers = np.ascontiguousarray(rows[:, :52]).view('<f4')
        self.not_finite += not np.isfinite(numbers).all()

    def _receive_health(self, array: Any) -> None:
        self.health = {entry.key: entry.value for entry in array.status[0].values}


def measure_process(pid: int) -> dict[str, float]:
    """Return resident memory [MB], threads and open files of a process."""
    lines = Path(f'/proc/{pid}/status').read_text('ascii').splitlines()
    status = dict(line.split(':', 1) for line in lines)
    files = len(list(Path(f'/proc/{pid}/fd').iterdir()))
    return {'memory': int(status['VmRSS'].split()[0]) / 1024.0, 'threads': float(status['Threads']), 'files': float(files)}


def wait_for_node(player: Player) -> None:
    """Publish until the node receives poses: earlier ones may be lost, and are not counted."""
    while not player.is_connected:
        player.spin(0.1)
    while 'hand_pose refused' not in player.health:
        player.tick()
    player.spin(REPORT_S)
    player.sent['good'] = int(player.health['hand_pose refused'].split(' of ')[1])


def soak(process: subprocess.Popen[str], player: Player, seconds: float) -> list[dict[str, float]]:
    """Publish for a while, with faults; return one row of measurements for every REPORT_S."""
    table, began = [], time.monotonic()
    due = began + REPORT_S
    while (now := time.monotonic()) - began < seconds:
        player.tick(faulty=True)
        if now >= due:
            due += REPORT_S
            p50, _, p99 = player.health.get('cycle time p50, p99 [ms]', '').partition(', ')
            row = {'time': now - began, **measure_process(process.pid), 'p50': float(p50 or 'nan'), 'p99': float(p99 or 'nan')}
            row['probe'] = 1e3 * statistics.fmean(player.probes_s)
            player.probes_s.clear()
            table.append(row)
            print('  '.join(f'{name} {value:.1f}' for name, value in row.items()), flush=True)
    return table


def count_lost(player: Player) -> tuple[int, int]:
    """Return how many poses were never received, and how many valid ones were refused, after the last diagnostics."""
    total, received = sum(player.sent.values()), 0
    for _ in range(50):
        player.spin(0.2)
        received = int(player.health['hand_pose refused'].split(' of ')[1])
        if received >= total:
            break
    counted = {name: int(player.health.get(f'count {kind}', 0)) for name, kind in BAD_POSES.items()}
    return total - received, sum(max(count - player.sent[name], 0) for name, count in counted.items())


def judge(table: list[dict[str, float]], player: Player, lost: int, refused: int) -> dict[str, bool]:
    """Return every requirement as a text, and whether it is met."""
    after = [row for row in table if row['time'] >= WARM_UP * table[-1]['time']]
    third = max(len(after) // 3, 1)
    start, end = _medians(after[:third]), _medians(after[-third:])
    others = max(end['probe'] / start['probe'], 1.0)
    return {
        f'memory {start["memory"]:.1f} to {end["memory"]:.1f} MB': end['memory'] <= GROWTH * start['memory'],
        f'threads {start["threads"]:.0f} to {end["threads"]:.0f}': end['threads'] <= start['threads'],
        f'files {start["files"]:.0f} to {end["files"]:.0f}': end['files'] <= start['files'],
        f'p99 {start["p99"]:.1f} to {end["p99"]:.1f} ms, of the computation {start["probe"]:.1f} to {end["probe"]:.1f} ms': (
            end['p99'] <= SLOWER * others * start['p99']
        ),
        f'{lost} of {sum(player.sent.values())} poses lost, {refused} valid ones refused': lost == refused == 0,
        f'{player.predictions} predictions, {player.health["dropped cycles"]} dropped cycles, {player.not_finite} not finite': (
            player.predictions > 0 and not player.not_finite
        ),
        f'internal error: {player.health["last internal error"]}': player.health['last internal error'] == 'none',
    }


def _medians(rows: list[dict[str, float]]) -> dict[str, float]:
    return {name: statistics.median(row[name] for row in rows) for name in rows[0]}


def main() -> int:
    """Run a node for a long time and judge it."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument('--minutes', type=float, default=10.0, help='duration (default: %(default)s)')
    seconds = 60.0 * parser.parse_args().minutes
    with isolated_graph():
        command = [sys.executable, '-m', 'foc_ros.ros.main', '--ros-args', '-p', 'homotopy.max_candidates:=2']
        with Player() as player, subprocess.Popen(command, stderr=subprocess.PIPE, text=True) as process:
            wait_for_node(player)
            table = soak(process, player, seconds)
            found = judge(table, player, *count_lost(player))
            process.send_signal(signal.SIGTERM)
            _, errors = process.communicate(timeout=30)
    found[f'exit code {process.returncode}'] = process.returncode == 0 and 'Traceback' not in errors
    for requirement, is_met in found.items():
        print(f'{"holds" if is_met else "FAILS"}: {requirement}')
    return 0 if all(found.values()) else 1


if __name__ == '__main__':
    sys.exit(main())
