"""The program behind the page: serves it until an interrupt."""

from __future__ import annotations

import asyncio
import signal
import socket
import sys
from collections.abc import Sequence
from pathlib import Path

from foc_ros.core.config import Config

from .address import describe_page, is_loopback
from .predictors import LibraryPredictor, LivePredictor, Receive
from .server import listen, serve
from .session import Session

SWITCH_S = 0.001
"""Longest time for which a thread keeps Python's global lock while another one waits for it [s]."""


def run(config: Config, data: Path, host: str, sockets: Sequence[socket.socket], is_live: bool) -> None:
    """Serve the page. data: folder for recordings; host, sockets: where; is_live: whether a node predicts, not the library."""
    sys.setswitchinterval(SWITCH_S)
    asyncio.run(_serve(config, data, host, sockets, is_live))


async def _serve(config: Config, data: Path, host: str, sockets: Sequence[socket.socket], is_live: bool) -> None:
    loop, ended = asyncio.get_running_loop(), asyncio.Event()
    for number in (signal.SIGINT, signal.SIGTERM):
        loop.add_signal_handler(number, ended.set)

    def make_predictor(given: Config, receive: Receive) -> LivePredictor:
        def pass_on(topic: str, raw: bytes) -> None:
            loop.call_soon_threadsafe(receive, topic, raw)

        if not is_live:
            return LibraryPredictor(given, pass_on)
        from .node_predictor import NodePredictor

        return NodePredictor(given, pass_on)

    session = Session(make_predictor, config, data)
    server = listen(session, host, sockets)
    try:
        session.predictor.start()
        if not is_loopback(host):
            words = f'everybody who reaches {host} can steer the hand and start recordings; there is no password'
            print(f'foc_ros play: warning: {words}', file=sys.stderr)
        page = describe_page(host, sockets[0].getsockname()[1])
        print(f'foc_ros play: open {page}; Ctrl-C ends it', flush=True)
        await serve(session, ended)
    finally:
        server.stop()
        session.close()
