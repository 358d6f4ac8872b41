"""A live node in its own process under stress; other programs of the machine lengthen all times: run it alone.

    python scripts/stress.py soak [--minutes 10]
    python scripts/stress.py stops [--count 100]
    python scripts/stress.py hostile [--seconds 6] [--only SCENE] [--strategy NAME]
    python scripts/stress.py rates [--seconds 10]

soak: inputs at 100 Hz and random faults. The exit code is 0 if the memory does not grow after the warm-up, no thread or file
remains open, no valid pose is lost, the 99th percentile of the cycle time does not grow, the node has no internal error, and
it stops without an error. A valid pose is lost if the node never receives it or refuses it; poses that were due before the
newest one are counted as dropped cycles and are not lost. Other programs lengthen the cycles too: a fixed computation is
timed all along, and only the growth beyond that of the computation is judged.

stops: by SIGTERM and SIGINT, at random times up to SPREAD_S after the node installed its handlers. The exit code is 0 if all
nodes ended with exit code 0 and without a traceback.

hostile: scenes that are hard to predict in. The exit code is 0 if, for each scene and strategy, the longest gap between two
diagnostics is below GAP_S and the longest answer of `~/engage` below ANSWER_S; no prediction is published later than
`estimator.hand_timeout_s` after the stamp of its pose; PUNCTUAL of the predictions are computed within `budget_s` and 2 ms;
the memory does not grow after the first third; and the node has no internal error and stops without one.

rates: a hand at 1 kHz and 50 obstacles, with guidance. It prints how soon and how often the node predicts, the ages of
predictions, the period of the wrench in nominal periods, the longest answer of the clutch, and what the hand costs: the CPU
time of a node that predicts once in ten seconds, with the hand and without, as a share of one core.
"""

from __future__ import annotations

import os
import random
import signal
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from types import TracebackType
from typing import Annotated, Any, Self

import numpy as np
from cyclopts import App, Parameter

from foc_ros.core.config import Config
from foc_ros.core.types import NANOSECONDS, Array
from foc_ros.ros.isolated_node import private_environment, reserve_domain, set_environment
from foc_ros.ros.messages.encode_inputs import encode_goals, encode_hand_pose, encode_obstacles
from foc_ros.ros.messages.types import RclpyTypes

PERIOD_S, FAST_S = 0.01, 0.001
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
    """Publishes hand poses, the scene and faults to a running node; rows, goals: the scene; period_s: of the hand.

    Attributes: sent: number of poses by kind; health: the newest diagnostics; probes_s: times of the fixed computation [s].
    """

    def __init__(
        self, rows: Sequence[tuple[float, ...]] = ROWS, goals: Array = GOALS, period_s: float = PERIOD_S, is_timed: bool = False
    ) -> None:
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
        self._turn, self._stamp_ns, self._period_s, self._is_timed = 0, 0, period_s, is_timed
        self._scene_turns = max(round(0.1 / period_s), 1)
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
        if self._turn % self._scene_turns == 0:
            self._publishers['obstacles'].publish(encode_obstacles(self._types, stamp_ns, FRAME, self._rows))
        if self._turn % (5 * self._scene_turns) == 0:
            self._publishers['goals'].publish(encode_goals(self._types, stamp_ns, FRAME, self._goals))
        self._publish_pose(stamp_ns)
        if faulty and self._turn % 20 == 7:
            self._publish_fault(self._random.choice(FAULTS), stamp_ns)
        if self._is_timed and self._turn % PROBE_TURNS == 3:
            self._time_fixed_work()
        self._turn += 1
        self._next = max(self._next + self._period_s, time.monotonic() - PERIOD_S)
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


SPREAD_S = 2.0
LIMIT_S = 30.0


def has_handler(process: subprocess.Popen[str], number: int) -> bool:
    """Return whether a process has a handler for a signal; before that, the interpreter is still starting."""
    lines = Path(f'/proc/{process.pid}/status').read_text('ascii').splitlines()
    mask = next(int(line.split()[1], 16) for line in lines if line.startswith('SigCgt'))
    return bool(mask >> (number - 1) & 1)


def stop_one_node(player: Player, number: signal.Signals, after_s: float) -> str | None:
    """Start a node and stop it; return what went wrong, None if nothing did."""
    command = [sys.executable, '-m', 'foc_ros.ros.main', '--ros-args', '-p', 'foc.steps:=20', '-p', 'homotopy.max_candidates:=2']
    with subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True) as process:
        start_s = time.monotonic()
        while not has_handler(process, signal.SIGTERM):
            time.sleep(0.005)
            if time.monotonic() - start_s > LIMIT_S:
                process.kill()
                return 'did not start'
        stop_s = time.monotonic() + after_s
        while time.monotonic() < stop_s:
            player.tick()
        process.send_signal(number)
        try:
            _, errors = process.communicate(timeout=LIMIT_S)
        except subprocess.TimeoutExpired:
            process.kill()
            return f'{number.name} after {after_s:.2f} s: did not end'
    has_failed = process.returncode != 0 or 'Traceback' in errors
    return f'{number.name} after {after_s:.2f} s: exit code {process.returncode}, {errors.strip()[-400:]}' if has_failed else None


STRATEGIES = ('lv', 'hc', 'optimal')
GAP_S, ANSWER_S, PUNCTUAL = 1.3, 0.05, 0.999
ASK_EVERY = 10
"""Number of periods between two calls of the service."""
START_S = 120.0
"""Time within which a node has to start [s]."""


def scatter(count: int, radius: float, low: tuple[float, float], high: tuple[float, float]) -> list[tuple[float, ...]]:
    """Return circles whose centres are uniformly distributed in a rectangle, always the same."""
    centres = np.random.default_rng(0).uniform(low, high, (count, 2)).tolist()
    return [(x, y, 0.0, radius, 0.001, number) for number, (x, y) in enumerate(centres)]


@dataclass(frozen=True)
class Case:
    """A scene, the hand moving from (0, 0) to (0.3, 0) m and back, and parameters of the node besides the strategy."""

    rows: list[tuple[float, ...]]
    goals: Array = field(default_factory=lambda: np.array([[0.3, 0.0, 0.0]]))
    parameters: Mapping[str, object] = field(default_factory=dict)


MANY_GOALS = np.array([[0.3 + 0.02 * (i // 8), 0.03 * (i % 8 - 3.5), 0.0] for i in range(64)])
CASES = {
    '32 on the hand': Case(scatter(32, 0.03, (-0.02, -0.02), (0.02, 0.02))),
    '64 on the hand': Case(scatter(64, 0.03, (-0.02, -0.02), (0.02, 0.02))),
    'crowd of 60 %': Case(scatter(66, 0.02, (0.0, -0.15), (0.3, 0.15))),
    '256 near': Case(scatter(256, 0.004, (0.02, -0.1), (0.28, 0.1)), parameters={'scene.max_obstacles': 256}),
    'K = 64': Case(scatter(12, 0.012, (0.05, -0.08), (0.25, 0.08)), parameters={'homotopy.max_candidates': 64}),
    'N = 400': Case(scatter(6, 0.015, (0.05, -0.06), (0.25, 0.06)), parameters={'foc.steps': 400}),
    '64 goals x 64': Case(scatter(64, 0.006, (0.03, -0.1), (0.27, 0.1)), MANY_GOALS, {'homotopy.max_candidates': 64}),
}


class Watcher(Player):
    """A player that measures.

    Attributes: gap_s, answer_s, age_s: the longest gap, answer and age of a prediction, so far; ages_s, and wrenches_s: when each
    wrench was sent.
    """

    def __init__(self, case: Case, period_s: float = PERIOD_S) -> None:
        super().__init__(case.rows, case.goals, period_s)
        self.gap_s = self.answer_s = self.age_s = 0.0
        self.ages_s: list[float] = []
        self.wrenches_s: list[float] = []
        self._subscribe_wrench()
        self._heard_s: float | None = None
        self._asked_s: float | None = None

    def forget(self) -> None:
        """Forget the times that were measured while the node started."""
        self.gap_s = self.answer_s = self.age_s = 0.0
        self.ages_s.clear()
        self.wrenches_s.clear()

    def tick(self, *, faulty: bool = False) -> None:
        """Publish the messages of one period, and ask the service if it has answered."""
        from std_srvs.srv import SetBool

        if self._asked_s is None and self._turn % ASK_EVERY == 0 and self._engage.service_is_ready():
            self._asked_s = time.monotonic()
            self._engage.call_async(SetBool.Request(data=True)).add_done_callback(self._note_answer)
        super().tick(faulty=faulty)

    def end(self) -> None:
        """Count the waiting times that have not ended."""
        now_s = time.monotonic()
        self.gap_s = max(self.gap_s, now_s - (self._heard_s or now_s))
        self.answer_s = max(self.answer_s, now_s - (self._asked_s or now_s))

    def _note_answer(self, _: object) -> None:
        assert self._asked_s is not None
        self.answer_s, self._asked_s = max(self.answer_s, time.monotonic() - self._asked_s), None

    def _receive_prediction(self, cloud: Any, information: Mapping[str, int]) -> None:  # type: ignore[override]
        super()._receive_prediction(cloud)
        stamp_ns = cloud.header.stamp.sec * NANOSECONDS + cloud.header.stamp.nanosec
        self.ages_s.append((information['source_timestamp'] - stamp_ns) / NANOSECONDS)
        self.age_s = max(self.age_s, self.ages_s[-1])

    def _subscribe_wrench(self) -> None:
        from geometry_msgs.msg import WrenchStamped

        def receive(_: object, information: Mapping[str, int]) -> None:
            self.wrenches_s.append(information['source_timestamp'] / NANOSECONDS)

        self._node.create_subscription(WrenchStamped, 'foc/guidance/wrench', receive, 100)

    def _receive_health(self, array: Any) -> None:
        super()._receive_health(array)
        now_s = time.monotonic()
        self.gap_s, self._heard_s = max(self.gap_s, now_s - (self._heard_s or now_s)), now_s


def count(health: Mapping[str, str], name: str) -> int:
    """Return a count of the diagnostics."""
    return int(health.get(f'count {name}', 0))


def measure_case(case: Case, strategy: str, seconds: float) -> dict[str, float]:
    """Run a node in a scene for some seconds and return what was measured."""
    parameters = {'foc.strategy': strategy, **case.parameters}
    options = [word for name, value in parameters.items() for word in ('-p', f'{name}:={value}')]
    command = [sys.executable, '-m', 'foc_ros.ros.main', '--ros-args', *options]
    with Watcher(case) as watcher, subprocess.Popen(command, stderr=subprocess.PIPE, text=True) as process:
        began = time.monotonic()
        while count(watcher.health, 'predictions') == 0 and time.monotonic() - began < START_S and process.poll() is None:
            watcher.tick()
        watcher.forget()
        before, began, memory = dict(watcher.health), time.monotonic(), 0.0
        while time.monotonic() - began < seconds:
            watcher.tick()
            if memory == 0.0 and time.monotonic() - began > seconds / 3.0:
                memory = measure_process(process.pid)['memory']
        watcher.end()
        grown = measure_process(process.pid)['memory'] / memory
        process.send_signal(signal.SIGTERM)
        _, errors = process.communicate(timeout=30)
    made = count(watcher.health, 'predictions') + count(watcher.health, 'predict_too_late')
    over = count(watcher.health, 'predict_over_budget') - count(before, 'predict_over_budget')
    made -= count(before, 'predictions') + count(before, 'predict_too_late')
    p50, _, p99 = watcher.health['solve time p50, p99 [ms]'].partition(', ')
    return {
        'made': made,
        'p50 [ms]': float(p50 if p99 else 'nan'),
        'p99 [ms]': float(p99 or 'nan'),
        'over': over,
        'gap [s]': watcher.gap_s,
        'answer [s]': watcher.answer_s,
        'age [s]': watcher.age_s,
        'memory': grown,
        'errors': count(watcher.health, 'internal_errors') + (process.returncode != 0 or 'Traceback' in errors),
    }


def find_failures(row: Mapping[str, float]) -> list[str]:
    """Return the names of the values of a row that are beyond their limits."""
    limits = {
        'gap [s]': GAP_S,
        'answer [s]': ANSWER_S,
        'age [s]': Config().estimator.hand_timeout_s,
        'over': (1.0 - PUNCTUAL) * row['made'],
        'memory': GROWTH,
        'errors': 0,
    }
    return [name for name, limit in limits.items() if not row[name] <= limit] + ['made'] * (row['made'] == 0)


@contextmanager
def run_node(*parameters: str) -> Iterator[subprocess.Popen[str]]:
    """Start a node with parameters, and stop it at the end."""
    command = [sys.executable, '-m', 'foc_ros.ros.main', '--ros-args', *(word for each in parameters for word in ('-p', each))]
    with subprocess.Popen(command, stderr=subprocess.DEVNULL, text=True) as process:
        try:
            yield process
        finally:
            process.terminate()
            process.wait(30)


def read_cpu_s(process: subprocess.Popen[str]) -> float:
    """Return the CPU time of a process [s]."""
    fields = Path(f'/proc/{process.pid}/stat').read_text('ascii').rpartition(')')[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf('SC_CLK_TCK')


def play(player: Player, seconds: float) -> None:
    """Publish for some seconds."""
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        player.tick()


def measure_rates(seconds: float) -> dict[str, float]:
    """Measure predictions and guidance under a hand at 1 kHz."""
    case, began = Case(scatter(50, 0.008, (0.03, -0.15), (0.27, 0.15))), time.monotonic()
    with run_node('guidance.enabled:=true', 'guidance.clearance:=0.0') as process, Watcher(case, FAST_S) as watcher:
        while not watcher.ages_s and time.monotonic() - began < START_S and process.poll() is None:
            watcher.tick()
        start_s = time.monotonic() - began
        play(watcher, 2.0)
        watcher.forget()
        play(watcher, seconds)
        watcher.end()
    ages, periods = np.array(watcher.ages_s or [np.nan]), np.diff(watcher.wrenches_s or [np.nan] * 2)
    return {
        'from start to the first prediction [s]': start_s,
        'predictions [Hz]': len(watcher.ages_s) / seconds,
        'median age [s]': float(np.median(ages)),
        'largest age [s]': float(ages.max()),
        'wrenches [Hz]': len(watcher.wrenches_s) / seconds,
        'period of the wrench, p99 / nominal': float(np.percentile(periods, 99)) * Config().guidance.rate_hz,
        'longest answer of the clutch [s]': watcher.answer_s,
    }


def measure_intake(seconds: float) -> dict[str, float]:
    """Measure the CPU time of a node that hardly predicts, with a hand at 1 kHz and without."""
    with run_node('rate_hz:=0.1') as process, Player(period_s=FAST_S) as player:
        while not player.is_connected:
            player.spin(0.1)
        play(player, 2.0)
        before, sent = read_cpu_s(process), player.sent['good']
        play(player, seconds)
        used, hertz = read_cpu_s(process) - before, (player.sent['good'] - sent) / seconds
        player.spin(1.0)
        before = read_cpu_s(process)
        player.spin(seconds)
        idle = read_cpu_s(process) - before
    return {
        'poses published [Hz]': hertz,
        'cost of 1 kHz [cores]': (used - idle) / seconds * 1e3 / hertz,
        'without [cores]': idle / seconds,
    }


app = App(name='stress', help=__doc__, help_format='plaintext', default_parameter=Parameter(negative=()))


@app.command(name='soak')
def run_soak(minutes: float = 10.0) -> int:
    """Run a node for a long time among faulty publishers and judge it."""
    with isolated_graph():
        command = [sys.executable, '-m', 'foc_ros.ros.main', '--ros-args', '-p', 'homotopy.max_candidates:=2']
        with Player(is_timed=True) as player, subprocess.Popen(command, stderr=subprocess.PIPE, text=True) as process:
            wait_for_node(player)
            table = soak(process, player, 60.0 * minutes)
            found = judge(table, player, *count_lost(player))
            process.send_signal(signal.SIGTERM)
            _, errors = process.communicate(timeout=30)
    found[f'exit code {process.returncode}'] = process.returncode == 0 and 'Traceback' not in errors
    for requirement, is_met in found.items():
        print(f'{"holds" if is_met else "FAILS"}: {requirement}')
    return 0 if all(found.values()) else 1


@app.command(name='stops')
def run_stops(count: int = 100) -> int:
    """Stop so many nodes by each signal and print how they ended."""
    generator, failures = random.Random(0), 0
    with isolated_graph(), Player() as player:
        for turn in range(count):
            for number in (signal.SIGTERM, signal.SIGINT):
                error = stop_one_node(player, number, generator.uniform(0.0, SPREAD_S))
                failures += error is not None
                if error is not None or (turn + 1) % 10 == 0:
                    print(f'{number.name} {turn + 1} of {count}: {error or "no error"}', flush=True)
    print(f'{2 * count - failures} of {2 * count} stops with exit code 0 and no traceback')
    return min(failures, 1)


@app.command(name='hostile')
def run_hostile(
    seconds: float = 6.0,
    only: Annotated[tuple[str, ...], Parameter(choices=CASES, consume_multiple=True)] = tuple(CASES),
    strategy: Annotated[tuple[str, ...], Parameter(choices=STRATEGIES, consume_multiple=True)] = STRATEGIES,
) -> int:
    """Run a node in every scene with every strategy and print a table."""
    failed = 0
    with isolated_graph():
        for name in only:
            for each in strategy:
                row = measure_case(CASES[name], each, seconds)
                failures = find_failures(row)
                failed += bool(failures)
                values = '  '.join(f'{key} {value:.4g}' for key, value in row.items())
                print(f'{name:15} {each:8} {values}  {"FAILS: " + ", ".join(failures) if failures else "holds"}', flush=True)
    return min(failed, 1)


@app.command(name='rates')
def run_rates(seconds: float = 10.0) -> int:
    """Print rates, delays and costs under a hand at 1 kHz."""
    with isolated_graph():
        for measure in (measure_rates, measure_intake):
            for name, value in measure(seconds).items():
                print(f'{name:40} {value:.4g}', flush=True)
    return 0


if __name__ == '__main__':
    app()
