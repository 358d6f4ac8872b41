# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Predictions as they come, on a terminal: a table of the candidates."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext
from string import ascii_uppercase

import numpy as np
from rich.bar import Bar
from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.live import Live
from rich.markup import escape
from rich.table import Table

from foc_ros.core.prediction import Prediction
from foc_ros.ros.messages.ranking import compute_cost_ratios, describe_candidate

ROWS = 4
"""Rows of the table: the default number of candidates, so that its height stays the same."""
Show = Callable[[float, Prediction, str], None]
"""Function that shows a snapshot at a time [s], with a heading; it may be called often."""


@contextmanager
def show_live(console: Console | None = None) -> Iterator[Show]:
    """Yield a function that shows snapshots: as a live table on a terminal, else as a line each second."""
    console = console or Console()
    waiting = 'Waiting for the first prediction of the node ...'
    live = Live(waiting, console=console, auto_refresh=False) if console.is_terminal else None
    next_update = -np.inf

    def show(now: float, snapshot: Prediction, heading: str) -> None:
        nonlocal next_update
        if now < next_update:
            return
        next_update = now + (1.0 if live is None else 0.125)
        if live is not None:
            live.update(_make_table(snapshot, heading), refresh=True)
            return
        goals, shown = len(snapshot.goal_positions), snapshot.candidates_with_likelihood
        listed = [f'{100 * each.likelihood:.0f} % {describe_candidate(each, goals)}' for each in shown[:2]]
        line = f'{heading}   {"   ".join(listed) or "no solved candidate"}'
        console.print(line, highlight=False, soft_wrap=True, markup=False)

    with live or nullcontext():
        yield show


def _make_table(snapshot: Prediction, title: str) -> Table:
    table = Table(title=title, title_justify='left', caption_justify='left', box=SIMPLE_HEAD, padding=(0, 0))
    table.caption = '* not known to keep the wanted eta: compromised, or estimated'
    for name, width in (('candidate', 54), ('', 4), ('likely', 6), ('cost', 6), ('eta', 5)):
        table.add_column(name, width=width, no_wrap=True, justify='right' if width < 10 else 'left')
    shown, goals = snapshot.candidates_with_likelihood, len(snapshot.goal_positions)
    for letter, each, ratio in zip(ascii_uppercase[:ROWS], shown, compute_cost_ratios(shown), strict=False):
        bar = Bar(1.0, 0.0, each.likelihood, color='bright_blue')
        eta = f'{each.eta:.2f}' + '*' * (not each.is_solved)
        words = escape(f'{letter} {describe_candidate(each, goals)}')
        table.add_row(words, bar, f'{100 * each.likelihood:.0f} %', f'x {ratio:.3g}', eta)
    for row in range(len(shown), ROWS):
        table.add_row('' if row else 'no solved candidate')
    return table
