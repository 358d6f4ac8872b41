"""Demonstrations in a recording: each movement that ends near a goal becomes a way of the class library."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from foc_ros.core.homotopy.demonstrations import Demonstration, is_same_demonstration, record_demonstration
from foc_ros.core.obstacles.scene import Scene
from foc_ros.core.pipeline import Pipeline
from foc_ros.core.types import Array

from .replay import Step

AT_GOAL = 0.05
"""A movement that ends no farther from a goal than this reached it [m]."""
SHORTEST = 0.05
"""Shorter movements demonstrate nothing [m]."""


class Learner:
    """Takes the steps of a replay. Attributes: ways, those known before and those learned; learned, how many are new."""

    def __init__(self, pipeline: Pipeline, known: Sequence[Demonstration]) -> None:
        self.ways = list(known)
        self.learned = 0
        self._pipeline = pipeline
        self._path: list[Array] = []
        self._onset_ns: int | None = None
        self._scene = Scene()
        self._stamp_ns = 0

    def add(self, step: Step) -> None:
        """Follow the hand."""
        state = self._pipeline.hand_state
        if step.sample is None or state is None:
            return
        if state.onset_ns != self._onset_ns:
            self.finish()
        self._onset_ns = state.onset_ns
        if state.onset_ns is not None:
            self._path.append(state.mean[:2])
            self._scene, self._stamp_ns = step.scene, state.stamp_ns

    def finish(self) -> None:
        """End the movement; learn it if it reached a goal by a way that is not known."""
        path, self._path = np.array(self._path), []
        goals, frame_id = self._scene.goals, self._pipeline.frame_id
        if len(path) < 2 or goals is None or not len(goals) or frame_id is None:
            return
        if np.hypot(*np.diff(path, axis=0).T).sum() < SHORTEST or np.hypot(*(goals - path[-1]).T).min() > AT_GOAL:
            return
        goal = goals[int(np.hypot(*(goals - path[-1]).T).argmin())]
        way = record_demonstration(frame_id, np.vstack([path, goal]), self._scene.obstacles(self._stamp_ns))
        if not any(is_same_demonstration(way, known) for known in self.ways):
            self.ways.append(way)
            self.learned += 1
