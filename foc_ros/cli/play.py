"""`play`: steer the hand oneself, on a page in the browser."""

from __future__ import annotations

import argparse
import asyncio


def run(arguments: argparse.Namespace) -> int:
    """Serve the page until an interrupt."""
    print('foc_ros play: loading ...', flush=True)
    from foc_ros.play.server import serve

    asyncio.run(serve(arguments.config, arguments.data, arguments.host, arguments.sockets))
    return 0
