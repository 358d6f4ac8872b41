"""A ROS graph of our own, that stays on this host and meets nobody else's."""

from __future__ import annotations

import os
import socket
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

import foc_ros

DOMAINS = range(1, 102)
"""Domains whose ports lie below the ephemeral ones of Linux."""


def private_environment(domain: int, log_directory: Path) -> dict[str, str]:
    """Return the environment of a ROS graph that stays on this host, in a domain of its own, and logs into a directory."""
    inherited = {
        name: value
        for name, value in os.environ.items()
        if name not in ('ROS_LOCALHOST_ONLY', 'ROS_STATIC_PEERS', 'ROS_DISCOVERY_SERVER')
    }
    package = str(Path(foc_ros.__file__).parents[1])
    return inherited | {
        'ROS_DOMAIN_ID': str(domain),
        'ROS_AUTOMATIC_DISCOVERY_RANGE': 'LOCALHOST',
        'ROS_LOG_DIR': str(log_directory),
        'PYTHONPATH': os.pathsep.join(filter(None, [package, os.environ.get('PYTHONPATH')])),
        'PYTHONUNBUFFERED': '1',
    }


def free_domain() -> int:
    """Return a domain that nobody on this host is in, told by the ports that DDS gives to its first participant."""
    start = os.getpid()
    candidates = [DOMAINS[(start + turn) % len(DOMAINS)] for turn in range(len(DOMAINS))]
    return next((domain for domain in candidates if _unused(domain)), candidates[0])


def _unused(domain: int) -> bool:
    base = 7400 + 250 * domain
    for port in (base, base + 10):
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
            try:
                probe.bind(('', port))
            except OSError:
                return False
    return True


@contextmanager
def held(values: Mapping[str, str]) -> Iterator[None]:
    """Hold environment variables for as long as our own ROS context lives."""
    before = dict(os.environ)
    os.environ.update(values)
    try:
        yield
    finally:
        os.environ.clear()
        os.environ.update(before)
