# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The web server of the page: its files, a WebSocket, and the last report. It serves one page at a time.

Only files that are named here are served. A request has to name this computer as its host, and a WebSocket has to come from the
page of this server: other pages in the same browser can neither steer the hand nor read predictions.
"""

from __future__ import annotations

import asyncio
import json
import re
import signal
import sys
from collections.abc import Sequence
from pathlib import Path
from socket import socket
from typing import Any

from tornado.httpserver import HTTPServer
from tornado.ioloop import PeriodicCallback
from tornado.web import Application, HTTPError, RequestHandler
from tornado.websocket import WebSocketClosedError, WebSocketHandler

from foc_ros.core.config import Config
from foc_ros.core.errors import FocError
from foc_ros.reporting import page as report_page

from .address import describe_page, is_loopback
from .messages import LONGEST_MESSAGE, parse_message
from .predictor import Predictor, Receive
from .session import Session

FOLDER = Path(__file__).parent / 'page'
TYPES = {'.html': 'text/html', '.css': 'text/css', '.js': 'text/javascript'}
FILES = {
    '/': FOLDER / 'index.html',
    **{f'/{name}': FOLDER / name for name in ('style.css', 'play.js', 'hand.js', 'arranging.js')},
    **{f'/{name}': report_page.FOLDER / name for name in ('frame.css', 'frame.js', 'scene.js')},
}
REPORT = '/report'
POLICY = "default-src 'none'; script-src 'self'; style-src 'self'; connect-src 'self'; img-src data:"
OWN_HOSTS = r'localhost|[\d.]+|\[[\da-f:.]+\]'
"""Names of this computer besides the host that it is started with: localhost, and addresses. A page of an attacker can let its
own name lead here; it has its own origin then, but also its own host."""


class _Handler(RequestHandler):
    def initialize(self, session: Session) -> None:
        self.session = session

    def set_default_headers(self) -> None:
        self.set_header('X-Content-Type-Options', 'nosniff')
        self.set_header('Referrer-Policy', 'no-referrer')
        self.set_header('Cache-Control', 'no-store')


class _PageHandler(_Handler):
    """Answers with a file of the page, or with the last report."""

    def get(self) -> None:
        is_report = self.request.path == REPORT
        file = self.session.report if is_report else FILES[self.request.path]
        if file is None:
            raise HTTPError(404, 'there is no report yet')
        self.set_header('Content-Type', f'{TYPES[file.suffix]}; charset=utf-8')
        self.set_header('Content-Security-Policy', report_page.POLICY if is_report else POLICY)
        self.finish(file.read_bytes())


class _SocketHandler(_Handler, WebSocketHandler):
    """The connection of the page; Tornado's own `check_origin` refuses a page that does not come from this host."""

    def open(self, *_: str, **__: str) -> None:
        self.set_nodelay(True)
        self.session.open(self.send)

    def send(self, message: dict[str, Any]) -> None:
        try:
            sent = asyncio.ensure_future(self.write_message(json.dumps(message, allow_nan=False)))
            sent.add_done_callback(lambda done: done.cancelled() or done.exception())  # a page may leave early
        except WebSocketClosedError:
            self.session.close_page(self.send)

    def on_message(self, message: str | bytes) -> None:
        try:
            self.session.take(parse_message(message), self.send)
        except FocError as error:
            self.send({'type': 'error', 'text': str(error)})

    def on_close(self) -> None:
        self.session.close_page(self.send)


def listen(session: Session, host: str, sockets: Sequence[socket]) -> HTTPServer:
    """Start to serve a session on the sockets of a host (`open_sockets`); return the server."""
    given = {'session': session}
    routes: list[Any] = [*((path, _PageHandler, given) for path in (*FILES, REPORT)), ('/socket', _SocketHandler, given)]
    application = Application(websocket_max_message_size=LONGEST_MESSAGE, log_function=lambda _: None)
    application.add_handlers(rf'({re.escape(host.lower())}|{OWN_HOSTS})', routes)  # a request to another host finds nothing
    server = HTTPServer(application)
    server.add_sockets(sockets)
    return server


async def serve(config: Config, data: Path, host: str, sockets: Sequence[socket]) -> None:
    """Serve the page on the sockets of a host (`open_sockets`) until an interrupt, and say where it is.

    config: to begin with; data: the folder for recordings.
    """
    loop, ended = asyncio.get_running_loop(), asyncio.Event()
    for number in (signal.SIGINT, signal.SIGTERM):
        loop.add_signal_handler(number, ended.set)
    sys.setswitchinterval(0.001)  # a thread that waits for Python's global lock gets it sooner than after 5 ms

    def make_predictor(given: Config, receive: Receive) -> Predictor:
        return Predictor(given, lambda outcome: loop.call_soon_threadsafe(receive, outcome))

    session = Session(make_predictor, config, data)
    server = listen(session, host, sockets)
    ticking = PeriodicCallback(session.tick, 500)  # [ms]
    try:
        session.predictor.start()
        ticking.start()
        if not is_loopback(host):
            words = f'everybody who reaches {host} can steer the hand and start recordings; there is no password'
            print(f'foc_ros play: warning: {words}', file=sys.stderr)
        print(f'foc_ros play: open {describe_page(host, sockets[0].getsockname()[1])}; Ctrl-C ends it', flush=True)
        await ended.wait()
    finally:
        ticking.stop()
        server.stop()
        session.close()
