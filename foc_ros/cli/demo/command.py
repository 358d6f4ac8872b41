"""The command: from nothing to an output bag and a report in less than a minute."""

from __future__ import annotations

import argparse
import shutil
import signal
import sys
import tempfile
import threading
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from importlib.util import find_spec
from pathlib import Path

import numpy as np

from foc_ros.core.config import Config
from foc_ros.core.errors import FocError, InputError
from foc_ros.core.types import NANOSECONDS
from foc_ros.io.bags import BagReader, BagWriter, Item
from foc_ros.reporting.snapshots import track_of

from .environment import free_domain, held, private_environment
from .node_process import NodeDiedError, NodeProcess
from .recorder import Recorder

RECORDING = Path(__file__).resolve().parents[2] / 'recordings' / 'reaching.mcap'
MARK = '.foc_ros_demo'
"""File that says that a directory's bag and report are a demo's, and may be replaced by the next one's."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare what the command takes."""
    words = 'where bag and report are left (default: %(default)s); those of an earlier demo are replaced, nothing else is'
    parser.add_argument('--output', type=Path, default=Path('demo_output'), metavar='DIR', help=words)


def run(arguments: argparse.Namespace) -> int:
    """Play, show, report; 1 where the node fails, 130 where it was interrupted."""
    if find_spec('rclpy') is None:
        raise FocError('rclpy is not installed: run `make setup`, or source a ROS 2 installation, or install the extra `ros`')
    from foc_ros.reporting import report  # noqa: F401 (missing matplotlib is told before the demo, not after it)

    return perform(arguments.output)


def perform(output: Path, recording: Path = RECORDING, last_s: float = np.inf, domain: int | None = None) -> int:
    """Run the demo and return the exit code.

    last_s: seconds of the recording that are played; domain: of the ROS graph, a free one by default.
    """
    items = _items(recording, last_s)
    ledger = Recorder(Config())
    prepare(output)
    try:
        with _interruption() as stopped, BagWriter(output / 'bag') as bag:
            _play(items, bag, ledger, free_domain() if domain is None else domain, stopped)
    except NodeDiedError as error:
        return _failed(str(error))
    if stopped.is_set():
        print(f'interrupted; what was recorded until then is in {output / "bag"}')
        return 130
    if not ledger.moments:
        return _failed('the node sent no prediction')
    summary = _summary(ledger, (items[-1].log_ns - items[0].log_ns) / NANOSECONDS)
    from foc_ros.reporting.report import write_report

    write_report(output / 'report', 'Reaching among obstacles, live', track_of(ledger.samples), ledger.moments, summary)
    _tell(output, ledger, summary)
    return 0


def _play(items: list[Item], bag: BagWriter, ledger: Recorder, domain: int, stopped: threading.Event) -> None:
    from .display import Display
    from .player import Player

    duration_s = (items[-1].log_ns - items[0].log_ns) / NANOSECONDS
    with tempfile.TemporaryDirectory(prefix='foc_ros_demo_') as logs:
        environment = private_environment(domain, Path(logs))
        with (
            held(environment),
            NodeProcess(environment, Path(logs) / 'node.txt') as node,
            Player(items, bag, ledger, domain) as player,
            Display(ledger, items[0].log_ns, duration_s) as display,
        ):

            def tick() -> bool:
                node.check()
                display.update(time.monotonic())
                return not stopped.is_set()

            if player.connect(tick):
                player.play(tick)


def _items(recording: Path, last_s: float) -> list[Item]:
    with BagReader(recording) as reader:
        items = list(reader)
    return [item for item in items if item.log_ns - items[0].log_ns <= last_s * NANOSECONDS]


def prepare(output: Path) -> None:
    """Make room for bag and report: take away those of an earlier demo, refuse a directory that is not a demo's."""
    if output.exists() and not (output / MARK).exists() and (not output.is_dir() or any(output.iterdir())):
        raise InputError('--output', "a new or empty directory, or an earlier demo's", f'{output}, which holds other things')
    try:
        output.mkdir(parents=True, exist_ok=True)
        (output / MARK).write_text('The next demo replaces bag and report beside this file.\n', encoding='utf-8')
        for name in ('bag', 'report'):
            if (output / name).exists():
                shutil.rmtree(output / name)
    except OSError as error:
        raise InputError('--output', 'a directory that can be written', f'{output}: {error.strerror}') from error


@contextmanager
def _interruption() -> Iterator[threading.Event]:
    """Yield what SIGINT and SIGTERM set from now on, instead of breaking off somewhere."""
    stopped = threading.Event()
    if threading.current_thread() is not threading.main_thread():
        yield stopped
        return
    before = {number: signal.signal(number, lambda *_: stopped.set()) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield stopped
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def _summary(ledger: Recorder, duration_s: float) -> dict[str, str]:
    median, late = 1e3 * np.percentile(ledger.delays, [50, 99])
    counts = [f'{name.removeprefix("count ")} {value}' for name, value in ledger.health.items() if name.startswith('count ')]
    return {
        'recording': f'{duration_s:.1f} s, played over DDS to the node in real time',
        'hand samples': str(len(ledger.samples)),
        'from hand sample to prediction': f'{median:.1f} ms (median), {late:.1f} ms (99 of 100)',
        'the node counted': ', '.join(counts),
    }


def _tell(output: Path, ledger: Recorder, summary: Mapping[str, str]) -> None:
    print(f'{len(ledger.moments)} predictions from {summary["hand samples"]} hand samples in {summary["recording"]};')
    print(f'from hand sample to prediction {summary["from hand sample to prediction"]}')
    print(f'left in {output}: bag (inputs and outputs, MCAP), report/index.html')


def _failed(reason: str) -> int:
    print(f'foc_ros demo: {reason}', file=sys.stderr)
    return 1
