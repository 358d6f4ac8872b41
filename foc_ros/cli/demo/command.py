"""The command: plays the recording, shows the predictions, and leaves a bag and a report."""

from __future__ import annotations

import argparse
import shutil
import signal
import sys
import tempfile
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from importlib.util import find_spec
from pathlib import Path

import numpy as np

from foc_ros.core.config import Config
from foc_ros.core.errors import FocError, InputError
from foc_ros.core.types import NANOSECONDS
from foc_ros.io.bags import BagReader, BagWriter, Item
from foc_ros.io.terminal import show_address, show_table, show_text
from foc_ros.reporting.views import build_hand_trajectory
from foc_ros.ros.isolated_node import NodeDiedError, NodeProcess, private_environment, reserve_domain, set_environment

from .recorder import Recorder, show_live
from .summary import describe_lead

RECORDING = Path(__file__).resolve().parents[2] / 'recordings' / 'reaching.mcap'
MARK = '.foc_ros_demo'
"""File that marks the output directory of a demo: the next demo may replace its bag and report."""


def run(arguments: argparse.Namespace) -> int:
    """Run the demo; return 1 if the node fails, 130 after an interrupt."""
    if find_spec('rclpy') is None:
        raise FocError('rclpy is not installed: run `make setup`, or source a ROS 2 installation, or install the extra `ros`')
    return perform(arguments.output)


def perform(output: Path, recording: Path = RECORDING, last_s: float = np.inf) -> int:
    """Run the demo and return the exit code.

    last_s: seconds of the recording to play.
    """
    from foc_ros.reporting.report import write_report  # reports a missing library before the demo, not after it

    with BagReader(recording) as reader:
        items = list(reader)
    items = [item for item in items if item.log_ns - items[0].log_ns <= last_s * NANOSECONDS]
    recorder = Recorder(Config())
    prepare(output)
    print('The node starts ...', flush=True)
    try:
        with _catch_interrupts() as stopped, BagWriter(output / 'bag') as bag:
            _play(items, bag, recorder, stopped)
        if not recorder.snapshots and not stopped.is_set():
            raise NodeDiedError('the node sent no prediction')
    except NodeDiedError as error:
        print(f'foc_ros demo: {error}', file=sys.stderr)
        return 1
    if stopped.is_set():
        print(f'interrupted; the messages recorded so far are in {output / "bag"}')
        return 130
    print('The recording has ended. The report is written ...', flush=True)
    facts = _collect_facts(recorder, items)
    title, hand = 'Reaching among obstacles, live', build_hand_trajectory(recorder.samples)
    write_report(output / 'report', title, hand, recorder.snapshots, facts)
    show_table(('', str(output)), [('predictions', str(len(recorder.snapshots))), *facts.items()])
    print(f'written to {output}: bag (inputs and outputs, MCAP) and the report')
    show_address(output / 'report' / 'index.html')
    show_text(describe_lead(hand, recorder.snapshots))
    return 0


def prepare(output: Path) -> None:
    """Make the output directory and remove bag and report of an earlier demo; refuse a directory with other contents."""
    if output.exists() and not (output / MARK).exists() and (not output.is_dir() or any(output.iterdir())):
        raise InputError('--output', 'a new or empty directory, or one of an earlier demo', f'{output}, which has other contents')
    try:
        output.mkdir(parents=True, exist_ok=True)
        (output / MARK).write_text('The next demo replaces bag and report beside this file.\n', encoding='utf-8')
        for name in ('bag', 'report'):
            if (output / name).exists():
                shutil.rmtree(output / name)
    except OSError as error:
        raise InputError('--output', 'a directory that can be written', f'{output}: {error.strerror}') from error


def _play(items: list[Item], bag: BagWriter, recorder: Recorder, stopped: threading.Event) -> None:
    from .player import Player

    with tempfile.TemporaryDirectory(prefix='foc_ros_demo_') as logs, reserve_domain() as domain:
        environment = private_environment(domain, Path(logs))
        with (
            set_environment(environment),
            NodeProcess(environment, Path(logs) / 'node.txt') as node,
            Player(items, bag, recorder, domain) as player,
            show_live(recorder, items[0].log_ns, _duration_s(items)) as show,
        ):

            def tick() -> bool:
                node.check()
                show(time.monotonic())
                return not stopped.is_set()

            if player.connect(tick):
                player.play(tick)


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


def _collect_facts(recorder: Recorder, items: list[Item]) -> dict[str, str]:
    median, late = 1e3 * np.percentile(recorder.delays, [50, 99])
    counts = [f'{name.removeprefix("count ")} {value}' for name, value in recorder.health.items() if name.startswith('count ')]
    return {
        'recording': f'{_duration_s(items):.1f} s, played over DDS to the node in real time',
        'hand samples': str(len(recorder.samples)),
        'delay from hand sample to prediction': f'{median:.1f} ms (median), {late:.1f} ms (99th percentile)',
        'counters of the node': ', '.join(counts),
    }


def _duration_s(items: list[Item]) -> float:
    return (items[-1].log_ns - items[0].log_ns) / NANOSECONDS
