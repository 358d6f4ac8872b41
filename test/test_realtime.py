# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The real-time priority of the thread of guidance."""

from __future__ import annotations

import itertools
import os
import threading
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import pytest

from foc_ros.core.config import Config
from foc_ros.ros.guidance import GuidanceLoop

GUIDED = Config().with_values({'guidance.enabled': True, 'guidance.realtime_priority': 7})


def run_in_thread(function: Callable[[], Any]) -> Any:
    """Return what a function returns in a thread of its own."""
    with ThreadPoolExecutor(1) as threads:
        return threads.submit(function).result(10.0)


def get_policy() -> tuple[int, int]:
    """Return policy and priority of this thread."""
    return os.sched_getscheduler(0) & ~os.SCHED_RESET_ON_FORK, os.sched_getparam(0).sched_priority


def wait_until(condition: Callable[[], bool]) -> None:
    end = time.monotonic() + 10.0
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.001)


def make_loop(warn: Callable[[str], None] = lambda _: None) -> GuidanceLoop:
    return GuidanceLoop(GUIDED, lambda *_: None, lambda _: None, warn)


def test_the_priority_holds_for_the_thread_alone_and_can_be_given_back() -> None:
    loop, ordinary = make_loop(), (os.SCHED_OTHER, 0)

    def set_and_back() -> list[tuple[int, int]]:
        loop._set_priority(7)
        found = [get_policy(), run_in_thread(get_policy)]
        loop._set_priority(0)
        return [*found, get_policy()]

    found = run_in_thread(set_and_back)
    if found[0] == ordinary:
        pytest.skip('this user may not set a real-time priority (rtprio)')
    assert found == [(os.SCHED_FIFO, 7), ordinary, ordinary]
    assert get_policy() == ordinary


@pytest.mark.parametrize('error', [PermissionError(1, 'Operation not permitted'), AttributeError('not on this system')])
def test_a_priority_that_is_not_permitted_is_told_once(monkeypatch: pytest.MonkeyPatch, error: Exception) -> None:
    def refuse(*_: object) -> None:
        raise error

    monkeypatch.setattr(os, 'sched_setscheduler', refuse)
    told: list[str] = []
    loop = make_loop(told.append)
    for each in (0, 50, 50, 60):
        loop._set_priority(each)
    assert loop._priority == 0
    assert len(told) == 1
    assert all(word in told[0] for word in ('50', 'not permitted', 'rtprio', 'guidance.realtime_priority'))


def test_the_thread_of_guidance_has_it_while_guidance_is_enabled(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[tuple[str, int]] = []
    monkeypatch.setattr(
        os, 'sched_setscheduler', lambda _, __, to: asked.append((threading.current_thread().name, to.sched_priority))
    )
    loop = make_loop()

    def wait_for(*priorities: int) -> None:
        wait_until(lambda: asked == [('guidance', each) for each in priorities])

    loop.start()
    try:
        wait_for(7)
        loop.reconfigure(Config())
        wait_for(7, 0)
        loop.reconfigure(GUIDED)
        wait_for(7, 0, 7)
    finally:
        loop.stop()


def test_a_late_update_leaves_the_processor_to_others(monkeypatch: pytest.MonkeyPatch) -> None:
    """The thread has a priority before all others, so that it must sleep between updates that take longer than their period."""
    updates: list[tuple[float, float]] = []

    def update_slowly(_: GuidanceLoop, now_s: float) -> None:
        time.sleep(0.02)  # four periods
        updates.append((now_s, time.monotonic()))

    monkeypatch.setattr(GuidanceLoop, 'update', update_slowly)
    loop = make_loop()
    loop.start()
    wait_until(lambda: len(updates) >= 5)
    loop.stop()
    pauses = [began - ended for (_, ended), (began, _) in itertools.pairwise(updates)]
    assert min(pauses) > 0.09 / GUIDED.guidance.rate_hz
