# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What a command shows: a progress bar on standard error where that is a terminal, and tables on standard output."""

from __future__ import annotations

import math
import sys
import threading
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import suppress
from pathlib import Path
from textwrap import fill
from typing import TypeVar

from rich.box import SIMPLE_HEAD
from rich.cells import cell_len
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, ProgressColumn
from rich.table import Table
from rich.text import Text

T = TypeVar('T')
COLUMNS = 80
"""Width of a terminal, into which all tables fit [characters]."""
QUIET_S = 3.0
"""Time after which a progress is printed, where there is no terminal [s]; infinite: none is."""


class _Console(Console):
    """A console that leaves a closed pipe to the program; rich itself exits with code 1."""

    def on_broken_pipe(self) -> None:
        """Raise the error that is being handled."""
        raise  # noqa: PLE0704


class _Words(ProgressColumn):
    """Words that change while nothing is done, so that a reader sees that the program works."""

    def __init__(self, say: Callable[[], str]) -> None:
        super().__init__()
        self._say = say

    def render(self, _: object) -> Text:
        """Return the words of now."""
        return Text(self._say())


def show_progress(
    items: Iterable[T], words: str, total: int, count: Callable[[], int] | None = None, *, is_stage: bool = False
) -> Iterator[T]:
    """Yield the items and show a progress bar, or a line of text every some seconds where there is no terminal.

    count: returns the number of predictions made so far, also for items that are not done; is_stage: whether also the end has a
    line of text.
    """
    console, done, told, began_s = Console(stderr=True), 0, '', time.monotonic()

    def say() -> str:
        made = count() if count is not None else 0
        return f'{words}, {time.monotonic() - began_s:.0f} s{f", {made} predictions" if made else ""}'

    if console.is_terminal:
        columns = _Words(say), BarColumn(16), MofNCompleteColumn()
        with Progress(*columns, console=console, transient=True) as progress:
            yield from progress.track(items, total=total)
        return

    def print_line() -> None:
        nonlocal told
        with suppress(OSError):
            if (line := f'{say()}: {done} of {total}') != told:
                print(line, file=sys.stderr, flush=True)
            told = line

    def watch() -> None:
        while not ended.wait(min(QUIET_S, threading.TIMEOUT_MAX)):
            print_line()

    ended, thread = threading.Event(), threading.Thread(target=watch, daemon=True)
    thread.start()
    try:
        for item in items:
            done += 1
            yield item
    finally:
        ended.set()
        thread.join()
    if is_stage and not math.isinf(QUIET_S):
        print_line()


def name_stage(stage: str, stages: Sequence[str]) -> str:
    """Return the words of a progress for one of several stages."""
    return f'stage {stages.index(stage) + 1} of {len(stages)}, {stage}'


def show_table(columns: Sequence[str], rows: Iterable[Sequence[str]], title: str | None = None) -> None:
    """Print a table on standard output, with at most `COLUMNS` characters in a line.

    Long texts of its first and last columns are folded, those of the first between words where these are short. If that is not
    enough, the table is divided into parts, each with the first column and as many others as fit.
    """
    cells = [[*each] for each in rows]
    first, *widths = [max(map(_measure, column)) for column in zip(columns, *cells, strict=True)]
    is_folded = True
    gap = int(first + sum(each + 2 for each in widths) <= COLUMNS)  # between two columns, beside 1
    if not gap:
        longest_word = max((len(word) for row in (columns, *cells) for word in row[0].split()), default=0)
        widths[-1:] = [min(each, 12) for each in widths[-1:]]
        is_enough = longest_word + sum(each + 1 for each in widths) <= COLUMNS
        widest, first = first, min(longest_word if is_enough else first, 32)
        is_folded = widest > first
    parts, left = [[0]], COLUMNS - first
    for number, width in enumerate(widths, 1):
        if width + gap >= left and len(parts[-1]) > 1:
            parts.append([0])
            left = COLUMNS - first
        parts[-1].append(number)
        left -= width + 1 + gap
    for part in parts:
        heading = title if part is parts[0] else ''
        table = Table(title=heading, title_justify='left', box=SIMPLE_HEAD, show_edge=False, padding=(0, gap, 0, 0))
        for number in part:
            table.add_column(columns[number], no_wrap=is_folded <= number < len(columns) - 1, overflow='fold')
        for row in cells:
            table.add_row(*(row[number] for number in part))
        _Console(width=COLUMNS, markup=False, emoji=False).print(table)


def _measure(text: str) -> int:
    return max((cell_len(line) for line in text.splitlines()), default=0)


def show_text(text: str) -> None:
    """Print a text on standard output, with line breaks between its words so that it fits into `COLUMNS`."""
    print(fill(text, COLUMNS, subsequent_indent='  ', break_long_words=False, break_on_hyphens=False))


def show_address(page: Path) -> None:
    """Print the address of a page that was written, which a terminal shows as a link."""
    print(f'report: {page.resolve().as_uri()}')
