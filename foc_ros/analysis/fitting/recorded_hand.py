"""The hand in a recording: its positions as the estimator receives them, and the scene in which it moved."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from foc_ros.analysis.recordings import Recording
from foc_ros.analysis.replay import Replay
from foc_ros.core.config import Config, EstimatorConfig
from foc_ros.core.errors import RecordingError
from foc_ros.core.hand.kalman import Update, update
from foc_ros.core.types import NANOSECONDS, Array, HandSample, HandState, Obstacles, Record

MIN_SAMPLES = 10


@dataclass(frozen=True, eq=False)
class RecordedHand(Record):
    """One recording: stamps_ns (m,), rising; positions (m, 2) [m]; obstacles at the first stamp; goals (g, 2) [m]; frame_id."""

    name: str
    stamps_ns: NDArray[np.int64]
    positions: Array
    obstacles: Obstacles
    goals: Array
    frame_id: str = ''

    @cached_property
    def times(self) -> Array:
        """Seconds since the first sample, (m,)."""
        return np.asarray((self.stamps_ns - self.stamps_ns[0]) / NANOSECONDS)

    def filter(self, config: EstimatorConfig) -> list[Update]:
        """Return what an estimator makes of each sample: the state, and whether it continues or starts anew."""
        updates, state = list[Update](), None
        for stamp_ns, position in zip(self.stamps_ns.tolist(), self.positions, strict=True):
            updates.append(update(state, HandSample(stamp_ns, position, frame_id=self.frame_id), config))
            state = updates[-1].state
        return updates

    def estimate_states(self, config: Config) -> list[HandState]:
        """Return the state that the estimator of a configuration gives at each sample."""
        return [each.state for each in self.filter(config.estimator)]


def read_hand(recording: Recording, config: Config) -> RecordedHand:
    """Read a recording as a replay does, without predicting; raises RecordingError for one without goals or with few samples."""
    replayed = Replay(config)
    samples: list[HandSample] = []
    for _, status in replayed.take(recording.items()):
        sample = replayed.intake.sample
        if status is not None and status.is_taken and sample is not None and (not samples or sample is not samples[-1]):
            samples = samples if not samples or sample.stamp_ns > samples[-1].stamp_ns else []
            samples.append(sample)
    goals = replayed.pipeline.scene.goals
    if goals is None or not len(goals):
        raise RecordingError(f'{recording.name}: {replayed.pipeline.not_ready_reason() or "no goal received"}')
    if len(samples) < MIN_SAMPLES:
        raise RecordingError(f'{recording.name}: expected at least {MIN_SAMPLES} hand poses, got {len(samples)}')
    stamps_ns = np.array([sample.stamp_ns for sample in samples])
    positions = np.array([sample.position for sample in samples])
    obstacles = replayed.pipeline.scene.obstacles(samples[0].stamp_ns)
    return RecordedHand(recording.name, stamps_ns, positions, obstacles, goals, samples[0].frame_id)
