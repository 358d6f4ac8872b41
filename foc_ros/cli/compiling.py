"""The first command on a machine compiles the solver, which takes minutes, and shows its progress."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import ExitStack, contextmanager

WORDS = 'compiling the solver, once for this machine'


@contextmanager
def show_compilation() -> Iterator[None]:
    """Show the progress of a compilation within the context; if anything has to be compiled there, compile everything."""
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
