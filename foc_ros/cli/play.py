"""`play`: steer the hand oneself, on a page in the browser."""

from __future__ import annotations

import argparse
import asyncio
import signal
import sys
from importlib.util import find_spec

from foc_ros.core.config import Config
from foc_ros.core.errors import FocError

SWITCH_S = 0.001
"""Longest time for which a thread keeps Python's global lock while another one waits for it [s]."""


def run(arguments: argparse.Namespace) -> int:
    """Serve the page until an interrupt."""
    if not arguments.no_ros and find_spec('rclpy') is None:
        raise FocError('rclpy is not installed: use --no-ros, or source a ROS 2 installation, or install the extra `ros`')
    print('foc_ros play: loading ...', flush=True)
    sys.setswitchinterval(SWITCH_S)
    asyncio.run(_serve(arguments, arguments.config))
    return 0


async def _serve(arguments: argparse.Namespace, config: Config) -> None:
    from foc_ros.play.address import describe_page, is_loopback
    from foc_ros.play.predictors import LibraryPredictor, LivePredictor, Receive
    from foc_ros.play.server import listen, serve
    from foc_ros.play.session import Session

    loop, ended = asyncio.get_running_loop(), asyncio.Event()
    for number in (signal.SIGINT, signal.SIGTERM):
        loop.add_signal_handler(number, ended.set)

    def make_predictor(given: Config, receive: Receive) -> LivePredictor:
        def pass_on(topic: str, raw: bytes) -> None:
            loop.call_soon_threadsafe(receive, topic, raw)

        if arguments.no_ros:
            return LibraryPredictor(given, pass_on)
        from foc_ros.play.node_predictor import NodePredictor

        return NodePredictor(given, pass_on)

    session = Session(make_predictor, config, arguments.data)
    server = listen(session, arguments.host, arguments.sockets)
    port = arguments.sockets[0].getsockname()[1]
    try:
        session.predictor.start()
        if not is_loopback(arguments.host):
            words = (
                f'warning: everybody who reaches {arguments.host} can steer the hand and start recordings; there is no password'
            )
            print(f'foc_ros play: {words}', file=sys.stderr)
        print(f'foc_ros play: open {describe_page(arguments.host, port)}; Ctrl-C ends it', flush=True)
        await serve(session, ended)
    finally:
        server.stop()
        session.close()
