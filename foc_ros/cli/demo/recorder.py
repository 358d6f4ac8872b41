"""What went to the node and what came back: rates, delays, and the moments that the display and the report show."""

from __future__ import annotations

from collections import deque
from typing import Any

from foc_ros.core.config import Config
from foc_ros.core.obstacles.scene import Scene
from foc_ros.core.pipeline import Pipeline
from foc_ros.core.types import HandSample
from foc_ros.io import topics
from foc_ros.io.bags import Item
from foc_ros.reporting.readback import belong_together, snapshot_of_messages
from foc_ros.reporting.snapshots import Snapshot
from foc_ros.ros.intake import Intake
from foc_ros.ros.messages.inputs import stamp_of

WINDOW_S = 1.0
"""Seconds over which rates are counted."""
KEPT = 20
"""Messages kept to be paired: a table of likelihoods has no stamp, and may come before or after its prediction."""


class Recorder:
    """Told of every message by the player.

    Attributes: samples, the hand samples sent; moments, the predictions received; delays [s], from sending a hand sample to
    receiving the prediction made from it; health, the figures of the node's diagnostics, by name.
    """

    def __init__(self, config: Config) -> None:
        self.samples: list[HandSample] = []
        self.moments: list[Snapshot] = []
        self.delays: list[float] = []
        self.health: dict[str, str] = {}
        # never asked to predict: it reads the messages and knows which scene held at each of them
        self._intake = Intake(Pipeline(config))
        self._sent: dict[int, tuple[float, Scene]] = {}
        self._clouds: deque[Any] = deque(maxlen=KEPT)
        self._tables: deque[Any] = deque(maxlen=KEPT)
        self._hand_times: deque[float] = deque()
        self._prediction_times: deque[float] = deque()

    def sent(self, item: Item, now: float) -> None:
        """Note a message to the node; now [s]: of a clock that never jumps."""
        self._intake.take(item.role, item.message)
        if item.role == topics.HAND and self._intake.sample is not None:
            self.samples.append(self._intake.sample)
            self._sent[self._intake.sample.stamp_ns] = (now, self._intake.pipeline.scene)
            self._hand_times.append(now)

    def received(self, name: str, message: Any, now: float) -> None:
        """Note an output of the node by its name."""
        if name == 'prediction':
            self._prediction_times.append(now)
            began, _ = self._sent.get(stamp_of(message.header), (now, None))
            self.delays.append(now - began)
            self._clouds.append(message)
        elif name == 'likelihoods':
            self._tables.append(message)
        elif name == 'diagnostics':
            self.health = {each.key: each.value for status in message.status for each in status.values}
        self._pair()

    @property
    def scene_known(self) -> bool:
        """Whether the node's diagnostics count obstacles (none is a count, too) and goals."""
        return self.health.get('goals', 'none yet') != 'none yet' and any(name.startswith('obstacles of') for name in self.health)

    def hand_rate(self, now: float) -> int:
        """Return how many hand samples were sent within the last second."""
        return _within(self._hand_times, now)

    def prediction_rate(self, now: float) -> int:
        """Return how many predictions came back within the last second."""
        return _within(self._prediction_times, now)

    def _pair(self) -> None:
        # by place, for messages with arrays in them cannot be asked whether they are equal
        for place in range(len(self._clouds) - 1, -1, -1):
            cloud = self._clouds[place]
            partner = next((i for i, table in enumerate(self._tables) if belong_together(cloud, table)), None)
            if partner is not None:
                self._enter(cloud, self._tables[partner])
                del self._clouds[place], self._tables[partner]

    def _enter(self, cloud: Any, table: Any) -> None:
        stamp_ns = stamp_of(cloud.header)
        _, scene = self._sent.get(stamp_ns, (0.0, self._intake.pipeline.scene))
        if scene.goals is not None:
            plane = self._intake.pipeline.config.plane
            self.moments.append(snapshot_of_messages(cloud, table, plane, scene.obstacles(stamp_ns), scene.goals))


def _within(times: deque[float], now: float) -> int:
    while times and times[0] <= now - WINDOW_S:
        times.popleft()
    return len(times)
