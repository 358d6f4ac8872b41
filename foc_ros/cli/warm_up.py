"""`warm-up`: says that there is nothing to do any more. The command stays for one release."""

from __future__ import annotations

import argparse


def run(_: argparse.Namespace) -> int:
    """Say that there is nothing to do."""
    print('there is nothing to do: foc_ros compiles nothing any more')
    return 0
