# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""A live node in its own process under stress. Other programs of the machine lengthen all times: run it alone.

    python scripts/stress.py soak [--minutes 10]
    python scripts/stress.py hostile [--seconds 6] [--only SCENE ...]
    python scripts/stress.py rates [--seconds 6]

soak: inputs at 100 Hz and random faults. The exit code is 0 if the memory and the 99th percentile of the cycle time do not grow
after the first third, no thread or file remains open, no valid pose is lost, and the node has no internal error and stops
without one. A valid pose is lost if the node never receives it or refuses it; due poses before the newest one are
counted as dropped cycles and are not lost.

hostile: scenes that are hard to predict in. The exit code is 0 if, for each scene and strategy, the longest gap between two
diagnostics is below GAP_S and the longest answer of `~/engage` below ANSWER_S; no prediction is published later than
`estimator.hand_timeout_s` after the stamp of its pose; PUNCTUAL of the predictions are computed within `budget_s` and 2 ms;
the memory does not grow after the first third; and the node has no internal error and stops without one.

rates: a hand at 1 kHz and 50 obstacles, with guidance. It prints how soon and how often the node predicts, the ages of
predictions, the period of the wrench over the nominal one, the longest answer of the clutch, and what the hand costs: the CPU
time of a node that predicts once in ten seconds, with the hand and without, as a share of one core.
"""

from __future__ import annotations

import argparse
import math
import random
import sys
import tempfile
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import psutil

from foc_ros.core.config import Config
from foc_ros.core.types import NANOSECONDS, Array
from foc_ros.ros.isolated_node import NodeProcess, isolated_graph
from foc_ros.ros.messages.encode_inputs import encode_goals, encode_hand_pose, encode_obstacles
from foc_ros.ros.messages.types import RclpyTypes

PERIOD_S, FAST_S, SETTLE_S = 0.01, 0.001, 2.0
FRAME = 'world'
GOALS = np.array([[0.3, 0.0, 0.0], [0.3, 0.1, 0.0]])
Rows = Sequence[tuple[float, ...]]
ROWS: Rows = [(0.15, 0.02, 0.0, 0.03, 0.002, 7), (0.2, 0.08, 0.0, 0.02, 0.002, 8)]
CROWD: Rows = [(0.0, 1.0 + 0.001 * i, 0.0, 0.001, 0.0, i) for i in range(10_000)]
BAD_POSES = {'nan': 'hand_lost', 'camera': 'hand_wrong_frame', 'again': 'hand_duplicate', 'late': 'hand_late'}
"""The node's count of each kind of bad pose; a late pose right after a reset starts a movement, and is not counted."""
FAULTS = (*BAD_POSES, 'burst', 'truncated', 'negative', 'flip', 'parameter', 'wrong parameter', 'crowd', 'clutch', 'reset')
BURST, BURST_NS, LATE_NS = 20, 100_000, 50_000_000
"""Number of poses sent at once, as after a stall of the network; least difference of their stamps; how late a late one is."""
GROWTH, SLOWER = 1.05, 1.5
"""Largest accepted growth of the memory, and of the 99th percentile of the cycle time, after a third of the time."""
START_S, ASK_EVERY = 120.0, 10
"""Time within which a node has to start [s], and number of periods between two calls of the clutch."""
GAP_S, ANSWER_S, PUNCTUAL = 1.3, 0.05, 0.999


class Player:
    """Publishes hand poses, the scene and faults to a running node, and keeps what it hears. Use as a context manager.

    rows, goals: the scene; period_s: of the hand; asks: whether the clutch is called all the time.
    Attributes: sent: number of poses by kind; health: the newest diagnostics; predictions and not_finite: numbers of them;
    ages_s of predictions, when they were published; wrenches_s: when each wrench was; gap_s, answer_s: the longest gap between
    diagnostics, and answer of the clutch.
    """

    def __init__(self, rows: Rows = ROWS, goals: Array = GOALS, period_s: float = PERIOD_S, asks: bool = False) -> None:
        import rclpy
        from diagnostic_msgs.msg import DiagnosticArray
        from geometry_msgs.msg import PoseArray, PoseStamped, WrenchStamped
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
        names = zip(('player', 'tracker'), self._contexts, strict=True)
        self._node, self._tracker = (rclpy.create_node(name, context=context) for name, context in names)
        self._executor = SingleThreadedExecutor(context=self._contexts[0])
        self._executor.add_node(self._node)
        kinds = {'obstacles': PointCloud2, 'goals': PoseArray}
        self._publishers = {name: self._node.create_publisher(kind, name, 10) for name, kind in kinds.items()}
        self._publishers['hand_pose'] = self._tracker.create_publisher(PoseStamped, 'hand_pose', qos_profile_sensor_data)
        self._node.create_subscription(PointCloud2, 'foc/prediction', self._receive_prediction, 100)
        self._node.create_subscription(WrenchStamped, 'foc/guidance/wrench', self._receive_wrench, 100)
        self._node.create_subscription(DiagnosticArray, '/diagnostics', self._receive_health, 10)
        services = {'set_parameters_atomically': SetParametersAtomically, 'engage': SetBool, 'reset': Trigger}
        self._clients = {name: self._node.create_client(kind, f'foc/{name}') for name, kind in services.items()}
        self._types, self._random, self._rows, self._goals = RclpyTypes(), random.Random(1), rows, goals
        self._start = self._next = time.monotonic()
        self._turn, self._stamp_ns, self._period_s, self._asks = 0, 0, period_s, asks
        self._heard_s: float | None = None
        self._asked_s: float | None = None
        self.sent = dict.fromkeys(('good', *BAD_POSES), 0)
        self.health: Mapping[str, str] = {}
        self.forget()

    def __enter__(self) -> Player:
        return self

    def __exit__(self, *_: object) -> None:
        self._executor.shutdown()
        for node, context in zip((self._node, self._tracker), self._contexts, strict=True):
            node.destroy_node()
            context.try_shutdown()

    def forget(self) -> None:
        """Forget what was measured so far."""
        self.predictions, self.not_finite, self.gap_s, self.answer_s = 0, 0, 0.0, 0.0
        self.ages_s: list[float] = []
        self.wrenches_s: list[float] = []

    def spin(self, seconds: float) -> None:
        """Process messages for a while [s]."""
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            self._executor.spin_once(timeout_sec=max(end - time.monotonic(), 0.0))

    def play(self, seconds: float, faulty: bool = False) -> None:
        """Publish for a while [s], and count the waiting times that have not ended then."""
        end = time.monotonic() + seconds
        while (now_s := time.monotonic()) < end:
            self._tick(faulty)
        self.gap_s = max(self.gap_s, now_s - (self._heard_s or now_s))
        self.answer_s = max(self.answer_s, now_s - (self._asked_s or now_s))

    def _tick(self, faulty: bool) -> None:
        """Publish the messages of one period, and process messages for the rest of it."""
        stamp_ns = max(self._node.get_clock().now().nanoseconds, self._stamp_ns + BURST_NS)
        scene_turns = round(0.1 / self._period_s)
        if self._turn % scene_turns == 0:
            self._publish_obstacles(stamp_ns, self._rows)
        if self._turn % (5 * scene_turns) == 0:
            self._publishers['goals'].publish(encode_goals(self._types, stamp_ns, FRAME, self._goals))
        self._publish_pose(stamp_ns)
        if faulty and self._turn % 20 == 7:
            self._publish_fault(self._random.choice(FAULTS), stamp_ns)
        if self._asks and self._asked_s is None and self._turn % ASK_EVERY == 0:
            self._ask()
        self._turn += 1
        self._next = max(self._next + self._period_s, time.monotonic() - PERIOD_S)
        self._executor.spin_once(timeout_sec=0.0)  # even if this program is late
        self.spin(max(self._next - time.monotonic(), 0.0))

    def _publish_obstacles(self, stamp_ns: int, rows: Rows, cut: int = 0) -> None:
        message = encode_obstacles(self._types, stamp_ns, FRAME, rows)
        message.data = message.data[: len(message.data) - cut]
        self._publishers['obstacles'].publish(message)

    def _publish_pose(self, stamp_ns: int, kind: str = 'good') -> None:
        progress = 0.5 - 0.5 * np.cos(2.0 * np.pi * (time.monotonic() - self._start) / 1.5)
        position = np.array([np.nan if kind == 'nan' else 0.28 * progress, 0.05 * progress, 0.1])
        frame, late_ns = 'camera' if kind == 'camera' else FRAME, LATE_NS if kind == 'late' else 0
        self._publishers['hand_pose'].publish(encode_hand_pose(self._types, stamp_ns - late_ns, frame, position))
        self.sent[kind] += 1
        self._stamp_ns = max(self._stamp_ns, stamp_ns - late_ns)

    def _publish_fault(self, name: str, stamp_ns: int) -> None:
        from rclpy.parameter import Parameter as RosParameter

        if name in BAD_POSES:
            self._publish_pose(stamp_ns, name)
        elif name == 'burst':
            for i in range(1, BURST + 1):
                self._publish_pose(stamp_ns + i * BURST_NS)
        elif name == 'flip':
            self._publishers['goals'].publish(encode_goals(self._types, stamp_ns, FRAME, GOALS[::-1]))
        elif name in ('parameter', 'wrong parameter'):
            eta = 5.0 if name == 'wrong parameter' else self._random.uniform(0.5, 0.9)
            self._call('set_parameters_atomically', parameters=[RosParameter('foc.eta', value=eta).to_parameter_msg()])
        elif name == 'clutch':
            self._call('engage', data=False)
            self._call('engage', data=True)
        elif name == 'reset':
            self._call('reset')
        else:
            rows = {'crowd': CROWD, 'negative': [(0.0, 0.0, 0.0, -1.0, 0.0, 1)], 'truncated': ROWS}[name]
            self._publish_obstacles(stamp_ns, rows, cut=3 if name == 'truncated' else 0)

    def _call(self, name: str, **fields: Any) -> Any:
        """Call a service if it is there; return the future."""
        client = self._clients[name]
        return client.call_async(client.srv_type.Request(**fields)) if client.service_is_ready() else None

    def _ask(self) -> None:
        asked_s = time.monotonic()

        def note(_: object) -> None:
            self.answer_s, self._asked_s = max(self.answer_s, time.monotonic() - asked_s), None

        if (future := self._call('engage', data=True)) is not None:
            self._asked_s = asked_s
            future.add_done_callback(note)

    def _receive_prediction(self, cloud: Any, information: Mapping[str, int]) -> None:
        self.predictions += 1
        rows = np.frombuffer(cloud.data, dtype=np.uint8).reshape(-1, cloud.point_step)
        self.not_finite += not np.isfinite(np.ascontiguousarray(rows[:, :52]).view('<f4')).all()
        stamp_ns = cloud.header.stamp.sec * NANOSECONDS + cloud.header.stamp.nanosec
        self.ages_s.append((information['source_timestamp'] - stamp_ns) / NANOSECONDS)

    def _receive_wrench(self, _: object, information: Mapping[str, int]) -> None:
        self.wrenches_s.append(information['source_timestamp'] / NANOSECONDS)

    def _receive_health(self, array: Any) -> None:
        self.health = {entry.key: entry.value for entry in array.status[0].values}
        now_s = time.monotonic()
        self.gap_s, self._heard_s = max(self.gap_s, now_s - (self._heard_s or now_s)), now_s

    def count(self, name: str) -> int:
        """Return a count of the diagnostics."""
        return int(self.health.get(f'count {name}', 0))

    def read_percentiles(self, kind: str) -> tuple[float, float]:
        """Return the median and the 99th percentile [ms] of the diagnostics for `solve` or `cycle` times."""
        p50, _, p99 = self.health.get(f'{kind} time p50, p99 [ms]', '').partition(', ')
        return (float(p50), float(p99)) if p99 else (math.nan, math.nan)

    def count_received(self) -> int:
        """Return how many poses the node has received."""
        return int(self.health.get('hand_pose refused', '0 of 0').split(' of ')[1])


@contextmanager
def run_node(parameters: Mapping[str, object]) -> Iterator[NodeProcess]:
    """Start a node with parameters, and stop it."""
    options = [word for name, value in parameters.items() for word in ('-p', f'{name}:={value}')]
    with (
        tempfile.TemporaryDirectory() as folder,
        NodeProcess(Path(folder) / 'node.txt', '--ros-args', *options) as node,
    ):
        yield node


def measure_process(process: psutil.Process) -> dict[str, float]:
    """Return resident memory [bytes], threads and open files of a process."""
    return {'memory': process.memory_info().rss, 'threads': process.num_threads(), 'files': process.num_fds()}


def play_until_predicted(player: Player) -> float:
    """Publish until the node predicts; return the time that this took [s]. RuntimeError if it does not.

    A prediction that took longer than `estimator.hand_timeout_s` counts, though the node withholds it.
    """
    began = time.monotonic()
    while not (player.predictions or player.count('predict_too_late')):
        player.play(PERIOD_S)
        if time.monotonic() - began > START_S:
            raise RuntimeError('the node did not predict')
    return time.monotonic() - began


def scatter(count: int, radius: float, low: tuple[float, float], high: tuple[float, float]) -> Rows:
    """Return circles whose centres are uniformly distributed in a rectangle, always the same."""
    centres = np.random.default_rng(0).uniform(low, high, (count, 2)).tolist()
    return [(x, y, 0.0, radius, 0.001, number) for number, (x, y) in enumerate(centres)]


@dataclass(frozen=True)
class Case:
    """A scene, the hand moving from (0, 0) to (0.3, 0) m and back, and parameters of the node besides the strategy."""

    rows: Rows
    goals: Array = field(default_factory=lambda: GOALS[:1])
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
SOAK = Case(ROWS, GOALS, {'homotopy.max_candidates': 2})


def measure_case(case: Case, strategy: str, seconds: float, *, is_faulty: bool = False) -> dict[str, float]:
    """Run a node in a scene for some seconds, with random faults or not, and return what was measured.

    memory, threads, files and slower, the 99th percentile of the cycle time: at the end over what they were after a third of it.
    """
    names = 'predictions', 'predict_too_late', 'predict_over_budget'
    with (
        Player(case.rows, case.goals, asks=not is_faulty) as player,
        run_node({'foc.strategy': strategy, **case.parameters}) as node,
    ):
        process = psutil.Process(node.pid)
        play_until_predicted(player)
        while not player.count_received():
            player.play(PERIOD_S)
        player.spin(SETTLE_S)
        player.sent['good'] = player.count_received()  # earlier ones may be lost
        player.forget()
        before = [player.count(name) for name in names]
        player.play(seconds / 3.0, is_faulty)
        first = measure_process(process) | {'slower': player.read_percentiles('cycle')[1]}
        player.play(2.0 * seconds / 3.0, is_faulty)
        last = measure_process(process) | {'slower': player.read_percentiles('cycle')[1]}
        for _ in range(50):
            if player.count_received() >= sum(player.sent.values()):
                break
            player.spin(0.2)
    made, late, over = (player.count(name) - count for name, count in zip(names, before, strict=True))
    p50, p99 = player.read_percentiles('solve')
    return {
        'made': made + late,
        'p50 [ms]': p50,
        'p99 [ms]': p99,
        'over': over,
        'gap [s]': player.gap_s,
        'answer [s]': player.answer_s,
        'age [s]': max(player.ages_s, default=0.0),
        'lost': sum(player.sent.values()) - player.count_received(),
        'refused': sum(max(player.count(kind) - player.sent[name], 0) for name, kind in BAD_POSES.items()),
        'not finite': player.not_finite,
        **{name: last[name] / first[name] for name in first},
        'errors': player.count('internal_errors') + (not node.is_clean),
    }


def find_failures(row: Mapping[str, float], *, is_faulty: bool = False) -> list[str]:
    """Return the names of the values of a row that are beyond their limits."""
    limits = {'memory': GROWTH, 'errors': 0.0}
    if is_faulty:
        limits |= {'threads': 1.0, 'files': 1.0, 'slower': SLOWER, 'lost': 0.0, 'refused': 0.0, 'not finite': 0.0}
    else:
        late, most = Config().estimator.hand_timeout_s, (1.0 - PUNCTUAL) * row['made']
        limits |= {'gap [s]': GAP_S, 'answer [s]': ANSWER_S, 'age [s]': late, 'over': most}
    return [name for name, limit in limits.items() if not row[name] <= limit] + ['made'] * (row['made'] == 0)


def measure_rates(seconds: float) -> dict[str, float]:
    """Measure predictions and guidance under a hand at 1 kHz."""
    rows = scatter(50, 0.008, (0.03, -0.15), (0.27, 0.15))
    parameters = {'guidance.enabled': 'true', 'guidance.clearance': 0.0}
    with Player(rows, GOALS[:1], FAST_S, asks=True) as player, run_node(parameters):
        start_s = play_until_predicted(player)
        player.play(SETTLE_S)
        player.forget()
        player.play(seconds)
    ages, periods = np.array(player.ages_s or [np.nan]), np.diff(player.wrenches_s or [np.nan] * 2)
    return {
        'from start to the first prediction [s]': start_s,
        'predictions [Hz]': len(player.ages_s) / seconds,
        'median age [s]': float(np.median(ages)),
        'largest age [s]': float(ages.max()),
        'wrenches [Hz]': len(player.wrenches_s) / seconds,
        'period of the wrench, p99 / nominal': float(np.percentile(periods, 99)) * Config().guidance.rate_hz,
        'longest answer of the clutch [s]': player.answer_s,
    }


def measure_intake(seconds: float) -> dict[str, float]:
    """Measure the CPU time of a node that hardly predicts, with a hand at 1 kHz and without."""
    with Player(period_s=FAST_S) as player, run_node({'rate_hz': 0.1}) as node:
        process = psutil.Process(node.pid)
        play_until_predicted(player)
        player.play(SETTLE_S)
        sent = player.sent['good']
        process.cpu_percent()
        player.play(seconds)
        used, hertz = process.cpu_percent() / 100.0, (player.sent['good'] - sent) / seconds
        player.spin(SETTLE_S)
        process.cpu_percent()
        player.spin(seconds)
        idle = process.cpu_percent() / 100.0
    return {'poses published [Hz]': hertz, 'cost of 1 kHz [cores]': (used - idle) * 1e3 / hertz, 'without a hand [cores]': idle}


def report(name: str, strategy: str, seconds: float, *, is_faulty: bool = False) -> int:
    """Measure a case and print a line; return the exit code."""
    row = measure_case(CASES.get(name, SOAK), strategy, seconds, is_faulty=is_faulty)
    failures = find_failures(row, is_faulty=is_faulty)
    values = '  '.join(f'{key} {value:.4g}' for key, value in row.items())
    print(f'{name:15} {strategy:8} {values}  {"FAILS: " + ", ".join(failures) if failures else "holds"}', flush=True)
    return int(bool(failures))


def main() -> int:
    """Run a part of the command line, and return the exit code."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('part', choices=('soak', 'hostile', 'rates'))
    parser.add_argument('--minutes', type=float, default=10.0, help='of soak; default: %(default)g')
    parser.add_argument('--seconds', type=float, default=6.0, help='of each scene, or of rates; default: %(default)g')
    parser.add_argument(
        '--only', nargs='+', choices=CASES, default=list(CASES), metavar='SCENE', help=', '.join(CASES).replace('%', '%%')
    )
    chosen = parser.parse_args()
    with isolated_graph():
        if chosen.part == 'soak':
            return report('soak', 'optimal', 60.0 * chosen.minutes, is_faulty=True)
        if chosen.part == 'hostile':
            return max(report(name, each, chosen.seconds) for name in chosen.only for each in ('lv', 'hc', 'optimal'))
        for name, value in (measure_rates(chosen.seconds) | measure_intake(chosen.seconds)).items():
            print(f'{name:40} {value:.4g}')
    return 0


if __name__ == '__main__':
    sys.exit(main())
