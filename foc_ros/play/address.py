# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The address of the page: a host and a port of this computer."""

from __future__ import annotations

import ipaddress
from socket import socket

from foc_ros.core.errors import FocError, InputError
from foc_ros.io import fields  # noqa: F401  what is missing is said before anything is loaded

try:
    from tornado.netutil import bind_sockets
except ImportError as error:
    raise FocError("play needs tornado: install python3-tornado, or pip install 'foc_ros[play]'") from error


def is_loopback(host: str) -> bool:
    """Return whether a host is reached from this computer only."""
    try:
        return host == 'localhost' or ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False


def describe_page(host: str, port: int) -> str:
    """Return the address of the page and where it can be opened."""
    words = f'http://{f"[{host}]" if ":" in host else host}:{port} in a browser'
    if host in ('0.0.0.0', '::'):  # noqa: S104  this is where it is warned of
        words += f', on other computers with an address of this one in place of {host}'
    return words


def open_sockets(host: str, port: int) -> list[socket]:
    """Open the sockets of a host at a port, 0 for a free one; raises InputError where that is impossible."""
    try:
        return bind_sockets(port, host)
    except (OSError, UnicodeError) as error:
        wanted = 'a free port of this computer, and a host that it has'
        raise InputError('--host and --port', wanted, f'{host}:{port}: {error}') from error
