"""`warm-up`: compiles what the node and the commands need, and keeps it for the user."""

from __future__ import annotations

import argparse
from time import monotonic

from foc_ros.core.config import Config
from foc_ros.core.kernels.compilation import count_kernels, follow_compilation
from foc_ros.core.registry import import_all
from foc_ros.io.terminal import show_counter


def run(_: argparse.Namespace) -> int:
    """Compile every kernel that is not kept yet, and print how many there were."""
    began = monotonic()
    with show_counter('compiling', count_kernels()) as counter, follow_compilation(counter.show):
        import_all()
        from foc_ros.core.predictor import warm_up  # not before: its import compiles

        warm_up(Config())
    print(f'{counter.done} kernels compiled in {monotonic() - began:.0f} s' if counter.done else 'nothing has to be compiled')
    return 0
