"""The messages of a demo: what was sent and received, and a live display of it."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext
from typing import Any

import numpy as np
from rich.bar import Bar
from rich.box import SIMPLE_HEAD
from rich.console import Console, Group
from rich.live import Live
from rich.markup import escape
from rich.table import Table
from rich.text import Text

from foc_ros.core.config import Config
from foc_ros.core.pipeline import Pipeline
from foc_ros.core.scene import Scene
from foc_ros.core.types import NANOSECONDS, HandSample
from foc_ros.io import topics
from foc_ros.io.bags import Item
from foc_ros.reporting.draw import Bounds
from foc_ros.reporting.views import CandidateView, Snapshot, is_same_prediction, read_snapshot
from foc_ros.ros.intake import Intake
from foc_ros.ros.messages.decode_poses import decode_stamp

from .scene_text import LEGEND, draw_scene, extend_bounds

WINDOW_S = 1.0
"""Seconds over which rates are counted."""
REDRAW_S, LINE_S = 0.125, 1.0
"""Seconds between two updates of the table on a terminal, and between two lines of text elsewhere."""
ROWS = 4
"""Rows of the table: the default number of candidates, so that its height stays the same."""
LISTED = 2
"""Number of candidates in a line of text."""


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
            sent, _ = self._sent.get(decode_stamp(message.header), (now, None))
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
        pipeline, stamp_ns = self._intake.pipeline, decode_stamp(cloud.header)
        _, scene = self._sent.get(stamp_ns, (0.0, pipeline.scene))
        if scene.goals is not None:
            obstacles = scene.obstacles(stamp_ns)
            self.snapshots.append(read_snapshot(cloud, likelihoods, pipeline.config.plane, obstacles, scene.goals))


@contextmanager
def show_live(
    recorder: Recorder, first_ns: int, duration_s: float, console: Console | None = None
) -> Iterator[Callable[[float], None]]:
    """Yield a function that shows the newest snapshot: as a live scene and table on a terminal, else as a line each second.

    The function takes the time [s] of the recorder's clock and may be called often; first_ns and duration_s: of the recording.
    """
    console = console or Console()
    waiting = 'Waiting for the first prediction of the node ...'
    live = Live(waiting, console=console, auto_refresh=False) if console.is_terminal else None
    next_update: float = -np.inf
    bounds: Bounds | None = None

    def update(now: float) -> None:
        nonlocal next_update, bounds
        if now < next_update or not recorder.snapshots:
            return
        next_update = now + (LINE_S if live is None else REDRAW_S)
        snapshot, rates = recorder.snapshots[-1], 'hand samples {}/s, predictions {}/s'.format(*recorder.rates(now))
        delay_ms = 1e3 * float(np.median(recorder.delays[-50:]))
        progress = f'{(snapshot.stamp_ns - first_ns) / NANOSECONDS:4.1f} of {duration_s:.1f} s'
        heading = f'{progress}   {rates}, delay {delay_ms:.0f} ms'
        if live is not None:
            hand = recorder.samples[-1].position
            bounds = extend_bounds(snapshot, hand, bounds)
            drawing = Text(draw_scene(snapshot, hand, bounds))
            live.update(Group(drawing, Text(LEGEND), _make_table(snapshot, heading)), refresh=True)
            return
        shares = '   '.join(_describe(each) for each in snapshot.candidates[:LISTED])
        console.print(f'{heading}   {shares or "no solved candidate"}', highlight=False, soft_wrap=True, markup=False)

    with live or nullcontext():
        yield update


def _describe(candidate: CandidateView) -> str:
    return f'{100 * candidate.likelihood:.0f} % {candidate.description or candidate.label}'


def _make_table(snapshot: Snapshot, title: str) -> Table:
    table = Table(title=title, title_justify='left', caption_justify='left', box=SIMPLE_HEAD, padding=(0, 0))
    table.caption = '* compromised: eta is below the wanted one'
    table.add_column('candidate', width=46, no_wrap=True)
    table.add_column('likelihood', width=10)
    for name, width in (('', 5), ('cost', 6), ('eta', 5)):
        table.add_column(name, justify='right', width=width)
    for each in snapshot.candidates[:ROWS]:
        bar = Bar(1.0, 0.0, each.likelihood, color='bright_blue')
        share, ratio = f'{100 * each.likelihood:.0f} %', f'x {each.cost_ratio:.3g}'
        eta = f'{each.eta:.2f}' + '*' * each.is_compromised
        table.add_row(escape(each.description or each.label), bar, share, ratio, eta)
    for row in range(len(snapshot.candidates), ROWS):
        table.add_row('' if row else 'no solved candidate')
    return table
