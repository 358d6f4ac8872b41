"""What a command shows: a progress bar on standard error, and only on a terminal; tables on standard output."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from typing import TypeVar

from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.markup import escape
from rich.progress import Progress
from rich.table import Table

T = TypeVar('T')
WIDE = 400
"""Columns within which no table is cut off; it takes no more than it needs."""


def track(items: Iterable[T], words: str, total: int) -> Iterator[T]:
    """Yield the items, with a bar that says how far they are."""
    console = Console(stderr=True)
    if not console.is_terminal:
        yield from items
        return
    with Progress(console=console, transient=True) as progress:
        yield from progress.track(items, total=total, description=words)


def show_table(columns: Sequence[str], rows: Iterable[Sequence[str]], title: str | None = None) -> None:
    """Print a table on standard output, as wide as it needs to be."""
    made = Table(title=None if title is None else escape(title), title_justify='left', box=SIMPLE_HEAD, pad_edge=False)
    for column in columns:
        made.add_column(column, no_wrap=True)
    for row in rows:
        made.add_row(*row)
    Console(width=WIDE).print(made)
