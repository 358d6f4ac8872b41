"""The web server of the page: its files, a WebSocket, and the last report. It serves one page at a time.

Only files that are named here are served. A request has to name this computer as its host, and a WebSocket has to come from the
page of this server: other pages in the same browser can neither steer the hand nor read predictions.
"""

from __future__ import annotations

import asyncio
import ipaddress
import json
from collections.abc import Sequence
from pathlib import Path
from socket import socket
from typing import Any

from tornado.httpserver import HTTPServer
from tornado.ioloop import PeriodicCallback
from tornado.web import Application, HTTPError, RequestHandler
from tornado.websocket import WebSocketClosedError, WebSocketHandler

from foc_ros.core.errors import FocError
from foc_ros.reporting import page as report_page

from .page_messages import LONGEST_MESSAGE, parse_message
from .session import Session

FOLDER = Path(__file__).parent / 'page'
TYPES = {'.html': 'text/html', '.css': 'text/css', '.js': 'text/javascript'}
FILES = {
    '/': FOLDER / 'index.html',
    **{f'/{name}': FOLDER / name for name in ('style.css', 'play.js', 'hand.js', 'drawing.js', 'arranging.js')},
    **{f'/{name}': report_page.FOLDER / name for name in ('frame.css', 'frame.js')},
}
POLICY = "default-src 'none'; script-src 'self'; style-src 'self'; connect-src 'self'; img-src data:"
HEADERS = {'X-Content-Type-Options': 'nosniff', 'Referrer-Policy': 'no-referrer', 'Cache-Control': 'no-store'}
TICK_MS = 500


class _Handler(RequestHandler):
    """A handler that answers requests to this computer only."""

    def initialize(self, session: Session, host: str) -> None:
        self.session = session
        self.host = host

    def prepare(self) -> None:
        if not is_own_host(self.request.host_name, self.host):
            raise HTTPError(403, 'the host %r is not this server', self.request.host_name)

    def set_default_headers(self) -> None:
        for name, value in HEADERS.items():
            self.set_header(name, value)


class _PageHandler(_Handler):
    def get(self) -> None:
        file = FILES[self.request.path]
        self.set_header('Content-Type', f'{TYPES[file.suffix]}; charset=utf-8')
        self.set_header('Content-Security-Policy', POLICY)
        self.finish(file.read_bytes())


class _ReportHandler(_Handler):
    def get(self) -> None:
        if self.session.report is None:
            raise HTTPError(404, 'there is no report yet')
        self.set_header('Content-Type', 'text/html; charset=utf-8')
        self.set_header('Content-Security-Policy', report_page.POLICY)
        self.finish(self.session.report.read_bytes())


class _SocketHandler(_Handler, WebSocketHandler):
    """The connection of the page; Tornado's own `check_origin` refuses a page that does not come from this host."""

    def open(self, *_: str, **__: str) -> None:
        self.set_nodelay(True)
        self.session.open(self.send)

    def send(self, message: dict[str, Any]) -> None:
        try:
            sent = asyncio.ensure_future(self.write_message(json.dumps(message, allow_nan=False)))
            sent.add_done_callback(lambda done: done.exception())  # a page may leave before it has received everything
        except WebSocketClosedError:
            self.session.close_page(self.send)

    def on_message(self, message: str | bytes) -> None:
        try:
            self.session.take(parse_message(message), self.send)
        except FocError as error:
            self.send({'type': 'error', 'text': str(error)})

    def on_close(self) -> None:
        self.session.close_page(self.send)


def is_own_host(name: str, host: str) -> bool:
    """Return whether the host of a request is this server: an address, localhost, or the name that it was started with.

    A page of an attacker can let its own name lead here. It has its own origin then, but also its own host.
    """
    if name in ('localhost', host):
        return True
    try:
        ipaddress.ip_address(name.strip('[]'))
    except ValueError:
        return False
    return True


def make_application(session: Session, host: str) -> Application:
    """Return the application for a session."""
    given = {'session': session, 'host': host}
    routes: list[Any] = [(path, _PageHandler, given) for path in FILES]
    routes += [('/report', _ReportHandler, given), ('/socket', _SocketHandler, given)]
    return Application(routes, websocket_max_message_size=LONGEST_MESSAGE, log_function=lambda _: None)


def listen(session: Session, host: str, sockets: Sequence[socket]) -> HTTPServer:
    """Start to serve on the sockets of a host (`open_sockets`); return the server."""
    server = HTTPServer(make_application(session, host))
    server.add_sockets(sockets)
    return server


async def serve(session: Session, ended: asyncio.Event) -> None:
    """Serve until an event."""
    ticking = PeriodicCallback(session.tick, TICK_MS)
    ticking.start()
    try:
        await ended.wait()
    finally:
        ticking.stop()
