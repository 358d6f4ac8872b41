"""What a command shows: a progress bar on standard error where that is a terminal, and tables on standard output."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from typing import TypeVar

from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.progress import Progress
from rich.table import Table

T = TypeVar('T')
MAX_COLUMNS = 400
"""Width up to which no table is cut off [characters]; a table takes no more than it needs."""


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
    """A number that is shown in a progress bar. Attributes: done, the number."""

    def __init__(self, progress: Progress, words: str, total: int) -> None:
        self.done = 0
        self._progress, self._task = progress, progress.add_task(words, total=total)

    def show(self, done: int) -> None:
        """Show a number."""
        self.done = done
        self._progress.update(self._task, completed=done)


@contextmanager
def show_counter(words: str, total: int) -> Iterator[Counter]:
    """Return a counter with a progress bar; words: its description; total: the number at its end."""
    console = Console(stderr=True)
    with Progress(console=console, transient=True, disable=not console.is_terminal) as progress:
        yield Counter(progress, words, total)


def show_table(columns: Sequence[str], rows: Iterable[Sequence[str]], title: str | None = None) -> None:
    """Print a table on standard output, as wide as it needs to be; its texts are shown as they are, without rich's markup."""
    table = Table(title=title, title_justify='left', box=SIMPLE_HEAD, pad_edge=False)
    for column in columns:
        table.add_column(column, no_wrap=True)
    for row in rows:
        table.add_row(*row)
    _Console(width=MAX_COLUMNS, markup=False, emoji=False).print(table)
