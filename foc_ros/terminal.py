"""What a command shows while it works: a progress bar on standard error, and only on a terminal."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import TypeVar

from rich.console import Console
from rich.progress import Progress

T = TypeVar('T')


def track(items: Iterable[T], words: str, total: int) -> Iterator[T]:
    """Yield the items, with a bar that says how far they are."""
    console = Console(stderr=True)
    with Progress(console=console, disable=not console.is_terminal, transient=True) as progress:
        yield from progress.track(items, total=total, description=words)
