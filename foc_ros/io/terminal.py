# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What a command shows: a progress bar on standard error where that is a terminal, and tables on standard output."""

from __future__ import annotations

import sys
import time
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from textwrap import fill
from typing import TypeVar

from rich.box import SIMPLE_HEAD
from rich.cells import cell_len
from rich.console import Console
from rich.progress import Progress
from rich.table import Table

T = TypeVar('T')
COLUMNS = 80
"""Width of a terminal, into which all tables fit [characters]."""
QUIET_S = 3.0
"""Time after which a progress is printed, where there is no terminal [s]."""


class _Console(Console):
    """A console that leaves a closed pipe to the program; rich itself exits with code 1."""

    def on_broken_pipe(self) -> None:
        """Raise the error that is being handled."""
        raise  # noqa: PLE0704


def show_progress(items: Iterable[T], words: str, total: int) -> Iterator[T]:
    """Yield the items and show a progress bar, or a line of text every some seconds where there is no terminal."""
    console = Console(stderr=True)
    if not console.is_terminal:
        next_s = time.monotonic() + QUIET_S
        for done, item in enumerate(items, 1):
            yield item
            if time.monotonic() >= next_s:
                print(f'{words}: {done} of {total}', file=sys.stderr, flush=True)
                next_s = time.monotonic() + QUIET_S
        return
    with Progress(console=console, transient=True) as progress:
        yield from progress.track(items, total=total, description=words)


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
