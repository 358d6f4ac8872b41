# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""`demo`: plays the packaged recording over DDS in real time to the real node, which runs in a process of its own.

It shows the predictions, and leaves a bag and a report.
"""

from __future__ import annotations

import shutil
import signal
import threading
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from foc_ros.core.config import Config
from foc_ros.core.errors import InputError, print_messages
from foc_ros.core.learning.movements import AT_GOAL_M, find_goal_at_end
from foc_ros.core.pipeline import Pipeline
from foc_ros.core.prediction import Prediction
from foc_ros.core.scene import Scene
from foc_ros.core.types import NANOSECONDS
from foc_ros.io import topics
from foc_ros.io.bags import TYPESTORE, BagReader, BagWriter, Item
from foc_ros.io.outputs import lock_folder, make_folder
from foc_ros.io.terminal import show_address, show_table, show_text
from foc_ros.reporting.live_text import show_live
from foc_ros.reporting.report import ReportCollector, describe_late
from foc_ros.reporting.views import HandTrajectory, read_snapshot
from foc_ros.ros.intake import Intake
from foc_ros.ros.isolated_node import NodeDiedError, NodeProcess, isolated_graph
from foc_ros.ros.messages.decode_poses import decode_stamp
from foc_ros.ros.messages.encode_prediction import OUTPUTS, STAMP

RECORDING = Path(__file__).resolve().parents[1] / 'recordings' / 'reaching.mcap'
MARK = '.foc_ros_demo'
"""File that marks the output directory of a demo: the next demo may replace its bag and report."""
RECEIVED = {f'/foc/{name}': kind for name, (kind, _) in OUTPUTS.items()} | {'/diagnostics': 'diagnostic_msgs/msg/DiagnosticArray'}
"""Types of the outputs of the node."""
PAIR, DIAGNOSTICS = ('prediction', 'likelihoods'), 'diagnostics'


class Recorder(ReportCollector):
    """Keeps the hand samples that a demo sends and the predictions that it receives.

    Attributes: delays [s], from a hand sample to its prediction; health, the values of the node's diagnostics by name.
    """

    def __init__(self, config: Config) -> None:
        super().__init__(config)
        self.delays: list[float] = []
        self.health: dict[str, str] = {}
        # This pipeline never predicts. It decodes the inputs and holds the scene at each of them.
        self._intake = Intake(Pipeline(config))
        self._sent: dict[int, tuple[float, Scene]] = {}
        self._halves: dict[int, dict[str, Any]] = {}

    def add_sent(self, item: Item, now: float) -> None:
        """Record a message to the node; now [s]: of a monotonic clock."""
        self._intake.take(item.role, item.message)
        if item.role == topics.HAND and self._intake.sample is not None:
            self.samples.append(self._intake.sample)
            self._sent[self._intake.sample.stamp_ns] = (now, self._intake.pipeline.scene)

    def add_received(self, name: str, message: Any, now: float) -> None:
        """Record an output of the node by its name; the two messages of a prediction may come in any order, or be lost."""
        if name == DIAGNOSTICS:
            self.health = {each.key: each.value for status in message.status for each in status.values}
        if name not in PAIR:
            return
        is_cloud, pipeline = name == PAIR[0], self._intake.pipeline
        stamp_ns = decode_stamp(message.header) if is_cloud else int(message.layout.dim[2].label.removeprefix(STAMP))
        sent_s, scene = self._sent.get(stamp_ns, (now, pipeline.scene))
        if is_cloud:
            self.delays.append(now - sent_s)
        halves = self._halves.setdefault(stamp_ns, {})
        halves[name] = message
        if len(halves) == len(PAIR) and scene.goals is not None:
            del self._halves[stamp_ns]
            cloud, likelihoods = (halves[each] for each in PAIR)
            known = pipeline.config.plane, scene.obstacles(stamp_ns), scene.goals
            self.snapshots.append(read_snapshot(cloud, likelihoods, *known))

    @property
    def is_scene_known(self) -> bool:
        """Whether the node's diagnostics count goals and obstacles, where zero obstacles are a count, too."""
        return self.health.get('goals', 'none yet') != 'none yet' and any(name.startswith('obstacles of') for name in self.health)

    def describe(self, items: Sequence[Item]) -> str:
        """Return how far the recording has been played, with the rates of the node's diagnostics and the delay."""
        progress = f'{(self.snapshots[-1].stamp_ns - items[0].log_ns) / NANOSECONDS:4.1f} of {_measure_duration_s(items):.1f} s'
        poses, predictions = (self.health.get(f'{name} rate [Hz]', '-') for name in ('hand_pose', 'prediction'))
        delay_ms = 1e3 * float(np.median(self.delays[-50:]))
        return f'{progress}   hand samples {poses}/s, predictions {predictions}/s, delay {delay_ms:.0f} ms'


def perform(output: Path, last_s: float = np.inf) -> int:
    """Run the demo; return 1 if the node fails, 130 after an interrupt. last_s: seconds of the recording to play."""
    with BagReader(RECORDING) as reader:
        items = list(reader)
    items = [item for item in items if item.log_ns - items[0].log_ns <= last_s * NANOSECONDS]
    with prepare(output):
        return _play_and_report(items, output)


def _play_and_report(items: list[Item], output: Path) -> int:
    recorder = Recorder(Config())
    print('The node starts ...', flush=True)
    try:
        with _catch_interrupts() as stopped, BagWriter(output / 'bag') as bag:
            _play(items, bag, recorder, stopped)
        if not recorder.snapshots and not stopped.is_set():
            raise NodeDiedError('the node sent no prediction')
    except NodeDiedError as error:
        print_messages('foc_ros demo', [str(error)])
        return 1
    if stopped.is_set():
        print(f'interrupted; the messages recorded so far are in {output / "bag"}')
        return 130
    print('The recording has ended. The report is written ...', flush=True)
    median, late = 1e3 * np.percentile(recorder.delays, [50, 99])
    counts = [f'{name.removeprefix("count ")} {value}' for name, value in recorder.health.items() if name.startswith('count ')]
    facts = {
        'recording': f'{_measure_duration_s(items):.1f} s, played over DDS to the node in real time',
        'hand samples': str(len(recorder.samples)),
        'delay from hand sample to prediction': f'{median:.1f} ms (median), {late:.1f} ms (99th percentile)',
    }
    counters = {'counters of the node': ', '.join(counts)}
    page = recorder.write(output / 'report', 'Reaching among obstacles, live', {**facts, **counters})
    show_table(('', str(output)), [('predictions', str(len(recorder.snapshots))), *facts.items()])
    show_text(describe_lead(recorder.hand, recorder.snapshots))
    print(f'written to {output}: bag (inputs and outputs, MCAP) and the report')
    show_address(page)
    if words := describe_late(recorder.snapshots):
        show_text(words)
    return 0


@contextmanager
def prepare(output: Path) -> Iterator[None]:
    """Make the output directory and remove bag and report of an earlier demo; no other demo has it within the context.

    Raises InputError for a directory with other contents, and for that of a demo that runs.
    """
    if output.exists() and not (output / MARK).exists() and (not output.is_dir() or any(output.iterdir())):
        raise InputError('--output', 'a new or empty directory, or one of an earlier demo', f'{output}, which has other contents')
    with make_folder('--output', output):
        (output / MARK).write_text('The next demo replaces bag and report beside this file.\n', encoding='utf-8')
    try:
        with lock_folder(output, waits=False):
            for name in ('bag', 'report'):
                if (output / name).exists():
                    shutil.rmtree(output / name)
            yield
    except BlockingIOError as error:
        raise InputError('--output', 'the directory of a demo that has ended', f'{output}, where one runs') from error


def _play(items: list[Item], bag: BagWriter, recorder: Recorder, stopped: threading.Event) -> None:
    began = np.inf

    def note(topic: str, kind: str, raw: Any, now: float) -> None:
        if now >= began:
            bag.write_raw(topic, kind, raw, items[0].log_ns + int((now - began) * NANOSECONDS))

    def receive(topic: str, raw: bytes) -> None:
        now, name = time.monotonic(), topic.rpartition('/')[2]
        note(topic, RECEIVED[topic], raw, now)
        if name in (*PAIR, DIAGNOSTICS):
            recorder.add_received(name, TYPESTORE.deserialize_cdr(raw, RECEIVED[topic]), now)

    with isolated_graph() as logs, NodeProcess(logs / 'node.txt') as node, show_live() as show:
        from foc_ros.ros.player import Player  # rclpy reads the environment when it is imported

        def tick() -> bool:
            node.check()
            now = time.monotonic()
            if recorder.snapshots:
                show(now, recorder.snapshots[-1], recorder.describe(items), recorder.samples[-1].position)
            return not stopped.is_set()

        with Player(items, RECEIVED, receive, tick) as player:
            if not player.connect(lambda: recorder.is_scene_known):
                return
            began = time.monotonic()
            for item in player.play():
                now = time.monotonic()
                recorder.add_sent(item, now)
                note(f'/{item.role}', topics.TYPES[item.role], item.raw, now)


@contextmanager
def _catch_interrupts() -> Iterator[threading.Event]:
    """Yield an event that SIGINT and SIGTERM set within the context, in place of their usual effect."""
    stopped = threading.Event()
    before = {number: signal.signal(number, lambda *_: stopped.set()) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield stopped
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def describe_lead(hand: HandTrajectory, snapshots: Sequence[Prediction]) -> str:
    """Return how long before the end of the movements the goals that were reached had become the most likely ones."""
    leads = []
    for start_ns, end_ns in hand.find_movements():
        inside = [each for each in snapshots if start_ns <= each.stamp_ns <= end_ns and each.most_likely is not None]
        if not inside:
            continue
        goal, distance = find_goal_at_end(hand.positions[hand.between(start_ns, end_ns)], inside[-1].goal_positions)
        if distance <= AT_GOAL_M:
            others = [each.stamp_ns for each in inside if each.candidates[0].candidate.goal != goal]
            first = next((each.stamp_ns for each in inside if not others or each.stamp_ns > others[-1]), end_ns)
            leads.append(((end_ns - first) / NANOSECONDS, (end_ns - start_ns) / NANOSECONDS))
    if not leads:
        return f'{len(snapshots)} predictions were made; no movement ended at a goal.'
    median, duration_s = np.median(leads, axis=0).tolist()
    times = f'{len(leads)} times, for {duration_s:.1f} s each' if len(leads) > 1 else f'once, for {duration_s:.1f} s'
    return (
        f'{len(snapshots)} predictions were made. The hand moved to a goal {times}; this goal '
        f'was the most likely one from {median:.1f} s before the arrival on (medians).'
    )


def _measure_duration_s(items: Sequence[Item]) -> float:
    return (items[-1].log_ns - items[0].log_ns) / NANOSECONDS
