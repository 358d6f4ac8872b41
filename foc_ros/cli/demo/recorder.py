"""The messages of a demo: what was sent and received, and a live display of it."""

from __future__ import annotations

from bisect import bisect_right
from types import TracebackType
from typing import Any

import numpy as np
from rich.bar import Bar
from rich.console import Console
from rich.live import Live
from rich.table import Table

from foc_ros.core.config import Config
from foc_ros.core.obstacles.scene import Scene
from foc_ros.core.pipeline import Pipeline
from foc_ros.core.types import NANOSECONDS, HandSample
from foc_ros.io import topics
from foc_ros.io.bags import Item
from foc_ros.reporting.snapshots import Snapshot, is_same_prediction, read_snapshot
from foc_ros.ros.intake import Intake
from foc_ros.ros.messages.inputs import stamp_of

WINDOW_S = 1.0
"""Seconds over which rates are counted."""
REDRAW_S, LINE_S = 0.125, 1.0
"""Seconds between two updates of the table on a terminal, and between two lines of text elsewhere."""
ROWS = 4
"""Rows of the table: the default number of candidates, so that its height stays the same."""


class Recorder:
    """Keeps all messages of a demo.

    Attributes: samples, the hand samples sent; snapshots, the predictions received; delays [s], from sending a hand sample to
    receiving its prediction; health, the values of the node's diagnostics by name.
    """

    def __init__(self, config: Config) -> None:
        self.samples: list[HandSample] = []
        self.snapshots: list[Snapshot] = []
        self.delays: list[float] = []
        self.health: dict[str, str] = {}
        # This pipeline never predicts. It decodes the inputs and holds the scene at each of them.
        self._intake = Intake(Pipeline(config))
        self._sent: dict[int, tuple[float, Scene]] = {}
        self._sent_times: list[float] = []
        self._received_times: list[float] = []
        self._unpaired: dict[str, list[Any]] = {'prediction': [], 'likelihoods': []}

    def add_sent(self, item: Item, now: float) -> None:
        """Record a message to the node; now [s]: of a monotonic clock."""
        self._intake.take(item.role, item.message)
        if item.role == topics.HAND and self._intake.sample is not None:
            self.samples.append(self._intake.sample)
            self._sent[self._intake.sample.stamp_ns] = (now, self._intake.pipeline.scene)
            self._sent_times.append(now)

    def add_received(self, name: str, message: Any, now: float) -> None:
        """Record an output of the node, by its name."""
        if name == 'diagnostics':
            self.health = {each.key: each.value for status in message.status for each in status.values}
            return
        if name == 'prediction':
            self._received_times.append(now)
            sent, _ = self._sent.get(stamp_of(message.header), (now, None))
            self.delays.append(now - sent)
        self._pair(name, message)

    @property
    def is_scene_known(self) -> bool:
        """Whether the node's diagnostics count goals and obstacles, where zero obstacles are a count, too."""
        return self.health.get('goals', 'none yet') != 'none yet' and any(name.startswith('obstacles of') for name in self.health)

    def rates(self, now: float) -> tuple[int, int]:
        """Return how many hand samples were sent and how many predictions were received within the last second."""
        sent, received = (len(times) - bisect_right(times, now - WINDOW_S) for times in (self._sent_times, self._received_times))
        return sent, received

    def _pair(self, name: str, message: Any) -> None:
        """Pair the two messages of a prediction; both topics keep their order, but a message of either may be lost."""
        others = self._unpaired['likelihoods' if name == 'prediction' else 'prediction']
        for row, other in enumerate(others):
            cloud, likelihoods = (message, other) if name == 'prediction' else (other, message)
            if is_same_prediction(cloud, likelihoods):
                del others[: row + 1]
                self._unpaired[name].clear()
                self._add_snapshot(cloud, likelihoods)
                return
        self._unpaired[name].append(message)

    def _add_snapshot(self, cloud: Any, likelihoods: Any) -> None:
        pipeline, stamp_ns = self._intake.pipeline, stamp_of(cloud.header)
        _, scene = self._sent.get(stamp_ns, (0.0, pipeline.scene))
        if scene.goals is not None:
            obstacles = scene.obstacles(stamp_ns)
            self.snapshots.append(read_snapshot(cloud, likelihoods, pipeline.config.plane, obstacles, scene.goals))


class Display:
    """Shows the newest snapshot of a recorder: as a live table on a terminal, else as a line of text each second."""

    def __init__(self, recorder: Recorder, first_ns: int, duration_s: float, console: Console | None = None) -> None:
        self._recorder, self._first_ns, self._duration_s = recorder, first_ns, duration_s
        self._console = console or Console()
        self._live = Live(console=self._console, auto_refresh=False) if self._console.is_terminal else None
        self._updated = -np.inf

    def __enter__(self) -> Display:
        if self._live is not None:
            self._live.__enter__()
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        if self._live is not None:
            self._live.__exit__(kind, error, trace)

    def update(self, now: float) -> None:
        """Show the newest snapshot if the last update is long enough ago; now [s]: of the recorder's clock."""
        if now - self._updated < (LINE_S if self._live is None else REDRAW_S) or not self._recorder.snapshots:
            return
        self._updated = now
        snapshot, heading = self._recorder.snapshots[-1], self._describe_progress(now)
        if self._live is not None:
            self._live.update(_make_table(snapshot, heading), refresh=True)
            return
        shares = '   '.join(f'{100 * each.likelihood:.0f} % {each.label}' for each in snapshot.candidates)
        self._console.print(f'{heading}   {shares or "no solved candidate"}', highlight=False, soft_wrap=True, markup=False)

    def _describe_progress(self, now: float) -> str:
        elapsed_s = (self._recorder.snapshots[-1].stamp_ns - self._first_ns) / NANOSECONDS
        sent, received = self._recorder.rates(now)
        delay_ms = 1e3 * float(np.median(self._recorder.delays[-50:]))
        progress = f'{elapsed_s:4.1f} of {self._duration_s:.1f} s'
        return f'{progress}   hand samples {sent}/s, predictions {received}/s, delay {delay_ms:.0f} ms'


def _make_table(snapshot: Snapshot, title: str) -> Table:
    table = Table(title=title, title_justify='left', caption_justify='left', expand=False)
    table.caption = '+ passes the obstacle on the left, - on the right'
    table.add_column('candidate', width=24, no_wrap=True)
    table.add_column('likelihood', width=30)
    for name, width in (('', 5), ('effort', 8), ('cost', 7), ('eta', 5)):
        table.add_column(name, justify='right', width=width)
    for each in snapshot.candidates[:ROWS]:
        bar = Bar(1.0, 0.0, each.likelihood, color='bright_blue')
        share, ratio = f'{100 * each.likelihood:.0f} %', f'x {each.cost_ratio:.3g}'
        table.add_row(each.label, bar, share, f'{each.effort:.3g}', ratio, f'{each.eta:.2f}')
    for row in range(len(snapshot.candidates), ROWS):
        table.add_row('' if row else 'no solved candidate')
    return table
