# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Functions for the worker processes of tests, importable by name."""

import os
import signal
import time
from pathlib import Path

from foc_ros.core.errors import InputError


def squared(number: int) -> int:
    time.sleep(0.02 * (number % 3))
    return number**2


def process_id(_: None) -> int:
    return os.getpid()


def deadly(number: int) -> int:
    """Kill the worker at 3 and 5, as the kernel does where memory runs out."""
    if number in (3, 5):
        os.kill(os.getpid(), signal.SIGKILL)
    return squared(number)


def faulty(number: int) -> int:
    if number == 1:
        raise InputError('number', 'another than 1', number)
    if number == 2:
        raise KeyError('two')
    return number


def sleepy(seconds: float) -> float:
    time.sleep(seconds)
    return seconds


def wait_here(folder: str) -> None:
    Path(folder, str(os.getpid())).touch()
    time.sleep(120.0)
