"""A command that computes loads the solver, which takes seconds, or minutes to compile it for the first time; it says so."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager

WORDS = 'compiling the solver, once for this machine'


@contextmanager
def show_compilation() -> Iterator[None]:
    """Say on a terminal that the solver is loaded within the context; show the progress of a compilation in any case.

    If anything has to be compiled there, compile everything.
    """
    is_terminal = sys.stderr.isatty()
    if is_terminal:
        print('loading ...', end='\r', file=sys.stderr, flush=True)
    from foc_ros.core.kernels.compilation import count_kernels, follow_compilation  # not before: it imports numba
    from foc_ros.io.terminal import Counter, show_counter

    with ExitStack() as stack:
        counters: list[Counter] = []

        def report(done: int) -> None:
            if not counters:
                counters.append(stack.enter_context(show_counter(WORDS, count_kernels())))
            counters[0].show(done)

        with follow_compilation(report):
            yield
            if counters:
                from foc_ros.core.registry import import_all

                import_all()
    if is_terminal:
        print(' ' * len('loading ...'), end='\r', file=sys.stderr, flush=True)
