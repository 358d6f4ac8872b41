"""Progress of the compilation that happens once on a machine."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from numba.core import event

ENTRY = re.compile(rb'^@(compiled|compiled_exactly)$', re.MULTILINE)
"""The decorator of an entry kernel."""


class _Listener(event.Listener):
    """Reports each kernel with a cache that is compiled; one that is found in the cache causes no event."""

    def __init__(self, report: Callable[[int], None]) -> None:
        self._report, self._done = report, 0

    def on_start(self, started: Any) -> None:
        """Report the first kernel before it is compiled."""
        if not self._done and _has_cache(started):
            self._report(0)

    def on_end(self, ended: Any) -> None:
        """Report a kernel that was compiled."""
        if _has_cache(ended):
            self._done += 1
            self._report(self._done)


def _has_cache(compilation: Any) -> bool:
    return type(compilation.data['dispatcher']._cache).__name__ != 'NullCache'  # noqa: SLF001 (numba has no public way to it)


def count_kernels() -> int:
    """Return the number of entry kernels, an upper bound of those that are compiled."""
    return sum(len(ENTRY.findall(each.read_bytes())) for each in Path(__file__).parents[1].glob('**/*.py'))


@contextmanager
def follow_compilation(report: Callable[[int], None]) -> Iterator[None]:
    """Call `report(done)` when the first kernel begins to be compiled, with 0, and after each; not at all if none has to be."""
    with event.install_listener('numba:compile', _Listener(report)):
        yield
