"""What a command shows: a progress bar on standard error where that is a terminal, and tables on standard output."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from typing import TypeVar

from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.markup import escape
from rich.progress import Progress
from rich.table import Table

T = TypeVar('T')
MAX_COLUMNS = 400
"""Width up to which no table is cut off [characters]; a table takes no more than it needs."""


def show_progress(items: Iterable[T], words: str, total: int) -> Iterator[T]:
    """Yield the items and show a progress bar; words: its description; total: number of items."""
    console = Console(stderr=True)
    if not console.is_terminal:
        yield from items
        return
    with Progress(console=console, transient=True) as progress:
        yield from progress.track(items, total=total, description=words)


def show_table(columns: Sequence[str], rows: Iterable[Sequence[str]], title: str | None = None) -> None:
    """Print a table on standard output, as wide as it needs to be."""
    table = Table(title=None if title is None else escape(title), title_justify='left', box=SIMPLE_HEAD, pad_edge=False)
    for column in columns:
        table.add_column(column, no_wrap=True)
    for row in rows:
        table.add_row(*row)
    Console(width=MAX_COLUMNS).print(table)
