"""What the demo shows while it runs: a live table on a terminal, else a plain line each second."""

from __future__ import annotations

from types import TracebackType

import numpy as np
from rich.bar import Bar
from rich.console import Console
from rich.live import Live
from rich.table import Table

from foc_ros.core.types import NANOSECONDS
from foc_ros.reporting.snapshots import Snapshot

from .recorder import Recorder

REDRAW_S = 0.125
LINE_S = 1.0
ROWS = 4
"""Ways in the table; as many as the node looks for by default, so that the table keeps its height."""


class Display:
    """Shows the newest moment of a ledger. Use as a context manager; call :meth:`update` as often as you like."""

    def __init__(self, ledger: Recorder, first_ns: int, duration_s: float, console: Console | None = None) -> None:
        self._ledger, self._first_ns, self._duration_s = ledger, first_ns, duration_s
        self._console = console or Console()
        self._live = Live(console=self._console, auto_refresh=False) if self._console.is_terminal else None
        self._shown = -np.inf

    def __enter__(self) -> Display:
        if self._live is not None:
            self._live.__enter__()
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        if self._live is not None:
            self._live.__exit__(kind, error, trace)

    def update(self, now: float) -> None:
        """Show what has come in, if the last time was long enough ago; now [s]: as told to the ledger."""
        if now - self._shown < (LINE_S if self._live is None else REDRAW_S) or not self._ledger.moments:
            return
        self._shown = now
        moment = self._ledger.moments[-1]
        if self._live is None:
            self._console.print(self._line(moment, now), highlight=False, soft_wrap=True, markup=False)
        else:
            self._live.update(self._table(moment, now), refresh=True)

    def _heading(self, moment: Snapshot, now: float) -> str:
        rates = f'hand {self._ledger.hand_rate(now)}/s, predictions {self._ledger.prediction_rate(now)}/s'
        delay = 1e3 * float(np.median(self._ledger.delays[-50:]))
        return (
            f'{(moment.stamp_ns - self._first_ns) / NANOSECONDS:4.1f} of {self._duration_s:.1f} s   {rates}, after {delay:.0f} ms'
        )

    def _line(self, moment: Snapshot, now: float) -> str:
        ways = '   '.join(f'{100 * way.likelihood:.0f} % {way.label}' for way in moment.ways)
        return f'{self._heading(moment, now)}   {ways or "no way solved"}'

    def _table(self, moment: Snapshot, now: float) -> Table:
        table = Table(title=self._heading(moment, now), title_justify='left', caption_justify='left', expand=False)
        table.caption = '+ passes the obstacle on the left, - on the right'
        table.add_column('way', width=24, no_wrap=True)
        table.add_column('likelihood', width=30)
        table.add_column('', justify='right', width=5)
        table.add_column('effort', justify='right', width=8)
        table.add_column('cost', justify='right', width=7)
        table.add_column('eta', justify='right', width=5)
        for way in moment.ways[:ROWS]:
            bar = Bar(1.0, 0.0, way.likelihood, color='bright_blue')
            share, ratio = f'{100 * way.likelihood:.0f} %', f'x {way.cost_ratio:.3g}'
            table.add_row(way.label, bar, share, f'{way.effort:.3g}', ratio, f'{way.eta:.2f}')
        for row in range(len(moment.ways), ROWS):
            table.add_row('' if moment.ways or row else 'no way solved')
        return table
