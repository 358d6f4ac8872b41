"""`demo`: plays the packaged recording over DDS in real time to the real node, which runs in a process of its own."""

from __future__ import annotations

import argparse


def run(arguments: argparse.Namespace) -> int:
    """Run the demo; return 1 if the node fails, 130 after an interrupt."""
    print('A recorded hand moves among a box, three posts and a wall; the node predicts where it goes. Loading ...', flush=True)
    from .command import run as run_command  # not before: its import takes seconds

    return run_command(arguments)
