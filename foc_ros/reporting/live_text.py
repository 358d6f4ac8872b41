# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Predictions as they come, on a terminal: the scene as lines of text, and a table of candidates."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext
from string import ascii_uppercase

import numpy as np
from rich.bar import Bar
from rich.box import SIMPLE_HEAD
from rich.console import Console, Group
from rich.live import Live
from rich.markup import escape
from rich.table import Table
from rich.text import Text

from foc_ros.core.obstacles.geometry import measure_offsets
from foc_ros.core.prediction import Prediction
from foc_ros.core.types import Array
from foc_ros.ros.messages.ranking import compute_cost_ratios, describe_candidate, find_drawn_curve

from .draw import Bounds, compute_bounds

WIDTH, HEIGHT = 72, 13
"""Size of the drawing [characters]; with the table it fits into 24 lines."""
OBSTACLE, GOAL, HAND = '▒', '*', '@'
LEGEND = f'{HAND} hand   {GOAL} goal   {OBSTACLE} obstacle   A B C candidates, the most likely first'
ROWS = 4
"""Rows of the table: the default number of candidates, so that its height stays the same."""
Show = Callable[[float, Prediction, str, Array], None]
"""Function that shows a snapshot at a time [s], with a heading and the position of the hand (2,) [m]; it may be called often."""


@contextmanager
def show_live(console: Console | None = None) -> Iterator[Show]:
    """Yield a function that shows snapshots: as a live scene and table on a terminal, else as a line each second."""
    console = console or Console()
    waiting = 'Waiting for the first prediction of the node ...'
    live = Live(waiting, console=console, auto_refresh=False) if console.is_terminal else None
    next_update = -np.inf
    bounds: Bounds | None = None

    def show(now: float, snapshot: Prediction, heading: str, hand: Array) -> None:
        nonlocal next_update, bounds
        if now < next_update:
            return
        next_update = now + (1.0 if live is None else 0.125)
        if live is not None:
            left, right, bottom, top = compute_bounds(snapshot.obstacles, snapshot.goal_positions, (), hand[None])
            if bounds is not None:  # with those before, the drawing rarely moves
                left, right = min(left, bounds[0]), max(right, bounds[1])
                bottom, top = min(bottom, bounds[2]), max(top, bounds[3])
            bounds = left, right, bottom, top
            drawing = Text(draw_scene(snapshot, hand, bounds))
            live.update(Group(drawing, Text(LEGEND), _make_table(snapshot, heading)), refresh=True)
            return
        goals = len(snapshot.goal_positions)
        shown = sorted(snapshot.candidates_with_likelihood, key=lambda each: -each.likelihood)
        listed = [f'{100 * each.likelihood:.0f} % {describe_candidate(each, goals)}' for each in shown[:2]]
        line = f'{heading}   {"   ".join(listed) or "no solved candidate"}'
        console.print(line, highlight=False, soft_wrap=True, markup=False)

    with live or nullcontext():
        yield show


def _make_table(snapshot: Prediction, title: str) -> Table:
    table = Table(title=title, title_justify='left', caption_justify='left', box=SIMPLE_HEAD, padding=(0, 0))
    table.caption = '* not known to keep the wanted eta: compromised, or estimated'
    for name, width in (('candidate', 54), ('', 3), ('likely', 6), ('cost', 6), ('eta', 5)):
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


def draw_scene(snapshot: Prediction, hand: Array, bounds: Bounds) -> str:
    """Return the drawing; hand (2,) [m]; bounds: left, right, bottom and top [m]."""
    left, right, bottom, top = bounds
    x, y = np.linspace(left, right, WIDTH), np.linspace(top, bottom, HEIGHT)
    cells = np.full((HEIGHT, WIDTH), ' ')
    if len(snapshot.obstacles):
        points = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
        is_inside = (measure_offsets(points, snapshot.obstacles)[1] <= snapshot.obstacles.radius).any(axis=1)
        cells[is_inside.reshape(cells.shape)] = OBSTACLE
    drawn: list[tuple[Array, str]] = [(hand[None], HAND), (snapshot.goal_positions, GOAL)]
    obstacles = snapshot.obstacles
    drawn += [(obstacles.centre[[row]], name) for row, name in enumerate(obstacles.ids) if len(name) == 1]
    for letter, each in zip(ascii_uppercase[:9], snapshot.candidates_with_likelihood, strict=False):
        curve = find_drawn_curve(each)
        rows = np.linspace(0.0, len(curve) - 1.0, 4 * WIDTH)  # so many points that a line has no gaps
        drawn.append((np.column_stack([np.interp(rows, np.arange(len(curve)), axis) for axis in curve.T]), letter))
    for points, mark in reversed(drawn):
        column = np.rint((points[:, 0] - left) / (right - left) * (WIDTH - 1)).astype(int)
        row = np.rint((top - points[:, 1]) / (top - bottom) * (HEIGHT - 1)).astype(int)
        is_visible = (column >= 0) & (column < WIDTH) & (row >= 0) & (row < HEIGHT)
        cells[row[is_visible], column[is_visible]] = mark
    return '\n'.join(''.join(line).rstrip() for line in cells)
