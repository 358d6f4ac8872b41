"""The subscription of the hand is polled only while its messages arrive more often than it is polled."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest
import ros_helpers

ros_helpers.require_ros()

from foc_ros.ros import queue_polling  # noqa: E402


class FakeNode:
    """A node with one timer, which is called by hand, and its time."""

    def __init__(self) -> None:
        self.now_s, self.is_polled = 0.0, False

    def create_timer(self, _period_s: float, tick: Callable[[], None], **_: Any) -> FakeNode:
        self.is_polled, self.tick = True, tick
        return self

    def cancel(self) -> None:
        self.is_polled = False

    def reset(self) -> None:
        self.is_polled = True

    def is_canceled(self) -> bool:
        return not self.is_polled


@pytest.mark.parametrize(('rate_hz', 'share'), [(1000.0, 1.0), (500.0, 1.0), (120.0, 0.0), (60.0, 0.0)])
def test_polling_ends_with_the_burst_that_began_it(monkeypatch: pytest.MonkeyPatch, rate_hz: float, share: float) -> None:
    """Two messages come at once, and then one each period: a message of a slow hand must not wait for a poll."""
    node, waiting, polled = FakeNode(), [0.0], 0
    polling = queue_polling.QueuePolling(node, lambda: [waiting.pop() for _ in waiting[:]] != [])
    monkeypatch.setattr(queue_polling, 'monotonic', lambda: node.now_s)
    polling.note_message()
    node.now_s = 0.001
    polling.note_message()
    assert node.is_polled
    ticks = [(row * queue_polling.POLL_S, node.tick) for row in range(1, 200)]
    messages = [(0.002 + row / rate_hz, None) for row in range(1, int(0.9 * rate_hz))]
    for node.now_s, tick in sorted(ticks + messages, key=lambda each: each[0]):
        if tick is not None and node.is_polled:
            tick()
        elif tick is None and node.is_polled:
            polled += 1
            waiting.append(node.now_s)
        elif tick is None:
            polling.note_message()
    assert polled / len(messages) == pytest.approx(share, abs=0.03)
