"""What a command shows: a progress bar on standard error where that is a terminal, and tables on standard output."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from textwrap import fill
from typing import TypeVar

from rich.box import SIMPLE_HEAD
from rich.cells import cell_len
from rich.console import Console
from rich.progress import Progress
from rich.table import Table

T = TypeVar('T')
COLUMNS = 80
"""Width of a terminal, into which tables fit where only their first and last columns are long [characters]."""
PRINTED = 20
"""A counter is printed each time that it has grown by this, where there is no terminal."""
LEAST = 12
"""Width to which the last column of a wide table is folded [characters]."""


class _Console(Console):
    """A console that leaves a closed pipe to the program; rich itself exits with code 1."""

    def on_broken_pipe(self) -> None:
        """Raise the error that is being handled."""
        raise  # noqa: PLE0704


def show_progress(items: Iterable[T], words: str, total: int) -> Iterator[T]:
    """Yield the items and show a progress bar; words: its description; total: number of items."""
    console = Console(stderr=True)
    if not console.is_terminal:
        yield from items
        return
    with Progress(console=console, transient=True) as progress:
        yield from progress.track(items, total=total, description=words)


class Counter:
    """A number that is shown in a progress bar, or where there is no terminal in a line of text at times.

    Attributes: done, the number.
    """

    def __init__(self, progress: Progress, words: str, total: int) -> None:
        self.done = 0
        self._progress, self._task = progress, progress.add_task(words, total=total)
        self._words, self._total = words, total

    def show(self, done: int) -> None:
        """Show a number."""
        self.done = done
        self._progress.update(self._task, completed=done)
        if self._progress.disable and done % PRINTED == 0:
            print(f'{self._words}: {done} of {self._total}', file=sys.stderr, flush=True)


@contextmanager
def show_counter(words: str, total: int) -> Iterator[Counter]:
    """Return a counter with a progress bar; words: its description; total: the number at its end."""
    console = Console(stderr=True)
    with Progress(console=console, transient=True, disable=not console.is_terminal) as progress:
        yield Counter(progress, words, total)


def show_table(columns: Sequence[str], rows: Iterable[Sequence[str]], title: str | None = None) -> None:
    """Print a table on standard output; its texts are shown as they are, without rich's markup.

    Long texts of its first and last columns are folded, those of the first between words. The table is wider than `COLUMNS` only
    where the others need it.
    """
    cells = [[*each] for each in rows]
    widths = [max(map(_measure, column)) for column in zip(columns, *cells, strict=True)]
    is_wide = sum(widths) + 2 * len(widths) > COLUMNS
    padding = (0, 0 if is_wide else 1, 0, 0)
    table = Table(title=title, title_justify='left', box=SIMPLE_HEAD, show_edge=False, padding=padding)
    words = [word for row in (columns, *cells) for word in row[0].split()]
    least = [max(map(_measure, words), default=0), *widths[1:-1], min(widths[-1], LEAST)]
    for number, column in enumerate(columns):
        table.add_column(column, no_wrap=0 < number < len(columns) - 1, overflow='fold', min_width=least[number])
    for row in cells:
        table.add_row(*row)
    _Console(width=max(COLUMNS, sum(least) + len(least)), markup=False, emoji=False).print(table)


def _measure(text: str) -> int:
    """Return the width of the longest line of a text [characters]."""
    return max((cell_len(line) for line in text.splitlines()), default=0)


def show_text(text: str) -> None:
    """Print a text on standard output, with line breaks between its words so that it fits into `COLUMNS`."""
    print(fill(text, COLUMNS, subsequent_indent='  ', break_long_words=False, break_on_hyphens=False))
