"""Recorded hands at a constant rate, with as much measurement noise as wanted, and the predictions made from them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from foc_ros.analysis.recordings import Recording
from foc_ros.core.config import Config
from foc_ros.core.pipeline import Pipeline
from foc_ros.core.scene import Scene
from foc_ros.core.types import NANOSECONDS, Array, HandSample, Prediction
from foc_ros.io.topics import HAND
from foc_ros.ros.intake import Intake

FRAME = 'world'


@dataclass(frozen=True, eq=False)
class Track:
    """The hand of a recording: stamps_ns (m,), positions (m, 2) [m], and the scene at each sample, None before there is one."""

    name: str
    stamps_ns: NDArray[np.int64]
    positions: Array
    scenes: tuple[Scene | None, ...]

    def resample(self, rate_hz: float) -> Track:
        """Return the track at a constant rate, by cubic interpolation."""
        stamps = np.arange(self.stamps_ns[0], self.stamps_ns[-1] + 1, round(NANOSECONDS / rate_hz))
        last = np.searchsorted(self.stamps_ns, stamps, side='right') - 1
        positions = CubicSpline(self.stamps_ns - stamps[0], self.positions)(stamps - stamps[0])
        return Track(self.name, stamps, positions, tuple(self.scenes[each] for each in last))

    def add_noise(self, stddev: float, seed: int) -> Track:
        """Return the track with Gaussian noise [m] on every position."""
        noise = np.random.default_rng(seed).normal(0.0, stddev, self.positions.shape)
        return replace(self, positions=self.positions + noise)


def read_track(recording: Recording) -> Track:
    """Return the hand of a recording and its scenes; a sample with the stamp of the one before is left out."""
    pipeline = Pipeline(Config())
    intake = Intake(pipeline)
    stamps: list[int] = []
    positions: list[Array] = []
    scenes: list[Scene | None] = []
    for item in recording.items():
        status = intake.take(item.role, item.message)
        if item.role == HAND and status is not None and status.is_taken:
            assert intake.sample is not None
            stamps.append(intake.sample.stamp_ns)
            positions.append(intake.sample.position)
            scenes.append(pipeline.scene if pipeline.not_ready_reason() is None else None)
    return Track(recording.name, np.array(stamps), np.array(positions), tuple(scenes))


def predict_track(track: Track, config: Config) -> Iterator[Prediction]:
    """Yield the predictions that the pipeline makes from a track."""
    pipeline, scene = Pipeline(config), None
    for stamp_ns, position, now in zip(track.stamps_ns.tolist(), track.positions, track.scenes, strict=True):
        if now is not None and now is not scene:
            assert now.goals is not None
            pipeline.set_obstacles('recorded', now.obstacles(stamp_ns), None, FRAME)
            pipeline.set_goals(now.goals, FRAME)
            scene = now
        pipeline.add_hand_sample(HandSample(stamp_ns, position, 0.0, FRAME))
        prediction = pipeline.predict() if scene is not None and pipeline.is_due else None
        if prediction is not None:
            yield prediction
