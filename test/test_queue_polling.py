"""The subscription of the hand is polled only while its messages arrive more often than it is polled."""

from __future__ import annotations

import pytest
import ros_helpers

ros_helpers.require_ros()

from foc_ros.ros import queue_polling  # noqa: E402


class FakeExecutor:
    """An executor that waits for messages of a group, with its own time. One is needed every unneeded_s."""

    def __init__(self, rate_hz: float, unneeded_s: float = 0.0, taken_beside: int = 0) -> None:
        self._spins, self._taken_beside = 0, taken_beside
        self.now_s, self.polled, self.woken, self.polls = 0.0, 0, 0, 0
        self._arrivals = [0.0, 0.001, *(0.002 + row / rate_hz for row in range(1, int(rate_hz)))]
        self.group = queue_polling.QueuePolling(self._poll, lambda: unneeded_s)

    def spin_once(self, timeout_sec: float) -> None:
        """Wait for a message, unless the group is polled, and for the timeout at most."""
        end_s = self.now_s + timeout_sec
        self._spins += 1
        if self.group.is_polling or not self._arrivals or self._arrivals[0] > end_s:
            self.now_s = end_s
            if self._taken_beside and self._spins % self._taken_beside == 0:
                self.group.take()
            return
        self.now_s = self._arrivals.pop(0)
        self.woken += 1
        self.group.note_message()

    def _poll(self) -> int:
        number = sum(each <= self.now_s for each in self._arrivals)
        del self._arrivals[:number]
        self.polled, self.polls = self.polled + number, self.polls + 1
        return number

    def run(self, monkeypatch: pytest.MonkeyPatch) -> None:
        """Spin for a second."""
        monkeypatch.setattr(queue_polling, 'monotonic', lambda: self.now_s)
        while self.now_s < 1.0:
            self.group.spin_once(self, 0.1)


@pytest.mark.parametrize('unneeded_s', [0.0, 0.016])
@pytest.mark.parametrize(('rate_hz', 'share'), [(1000.0, 1.0), (500.0, 1.0), (120.0, 0.0), (60.0, 0.0)])
def test_polling_ends_with_the_burst_that_began_it(
    monkeypatch: pytest.MonkeyPatch, rate_hz: float, share: float, unneeded_s: float
) -> None:
    """Two messages come at once, and then one each period: a message of a slow hand must not wait for a poll."""
    executor = FakeExecutor(rate_hz, unneeded_s)
    executor.run(monkeypatch)
    assert executor.polled / (executor.polled + executor.woken) == pytest.approx(share, abs=0.05)


@pytest.mark.parametrize(('unneeded_s', 'period_s'), [(0.0, 0.005), (-1.0, 0.005), (0.016, 0.016), (10.0, 0.02)])
def test_a_poll_comes_when_a_message_is_needed(monkeypatch: pytest.MonkeyPatch, unneeded_s: float, period_s: float) -> None:
    """Every 5 ms at most, and every 20 ms at least, because the queue is finite."""
    executor = FakeExecutor(1000.0, unneeded_s)
    executor.run(monkeypatch)
    assert executor.polls == pytest.approx(1.0 / period_s, abs=2)


def test_polling_goes_on_where_the_end_of_a_prediction_takes_the_messages(monkeypatch: pytest.MonkeyPatch) -> None:
    executor = FakeExecutor(1000.0, 0.016, taken_beside=2)
    executor.run(monkeypatch)
    assert executor.woken <= 3
