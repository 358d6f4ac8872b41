"""The report of a session, of the predictions that the page received."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from foc_ros.core.types import NANOSECONDS, HandSample, as_readonly
from foc_ros.io.bags import TYPESTORE
from foc_ros.reporting.report import write_report
from foc_ros.reporting.views import build_hand_trajectory, is_same_prediction, read_snapshot

from .predictors import KINDS, NODE
from .scene import FRAME, PlayScene, Point

PREDICTION, LIKELIHOODS = f'{NODE}/prediction', f'{NODE}/likelihoods'
PERIOD_NS = NANOSECONDS // 20
"""Shortest time between two predictions that are reported [ns]; a page of an hour would be too large otherwise."""


class SessionReport:
    """Keeps the hand samples, and pairs of the messages of a prediction, as bytes, with the scene that they are about."""

    def __init__(self) -> None:
        self._samples: list[HandSample] = []
        self._pairs: list[tuple[bytes, bytes, PlayScene]] = []
        self._cloud: bytes | None = None
        self._last_ns = 0

    def add_hand(self, stamp_ns: int, position: Point) -> None:
        """Keep a hand sample."""
        self._samples.append(HandSample(stamp_ns, as_readonly(np.array(position)), 0.0, FRAME))

    def add_output(self, topic: str, raw: bytes, scene: PlayScene, now_ns: int) -> None:
        """Keep a prediction when its second message has come; scene: the present one."""
        if topic == PREDICTION and now_ns - self._last_ns >= PERIOD_NS:
            self._cloud = raw
        elif topic == LIKELIHOODS and self._cloud is not None:
            self._pairs.append((self._cloud, raw, scene))
            self._cloud, self._last_ns = None, now_ns

    def write(self, directory: Path, title: str) -> None:
        """Write the report to a directory; raises InputError where that is impossible."""
        snapshots = []
        for raw_cloud, raw_likelihoods, scene in self._pairs:
            cloud = TYPESTORE.deserialize_cdr(raw_cloud, KINDS[PREDICTION])
            likelihoods = TYPESTORE.deserialize_cdr(raw_likelihoods, KINDS[LIKELIHOODS])
            if is_same_prediction(cloud, likelihoods):  # one of the two may have been lost
                snapshots.append(read_snapshot(cloud, likelihoods, 'xy', scene.tabulate(), np.array(scene.goals)))
        write_report(directory, title, build_hand_trajectory(self._samples), snapshots, {})
