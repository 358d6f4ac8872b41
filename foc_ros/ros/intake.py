"""Messages of the inputs, converted and handed to the pipeline: the same way in for the node and for a recording."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable
from typing import Any

from foc_ros.core.errors import MessageError
from foc_ros.core.pipeline import Pipeline, SampleStatus
from foc_ros.core.types import NANOSECONDS, HandSample
from foc_ros.io import topics

from .messages.inputs import goal_of_pose, goals_of_pose_array, hand_sample
from .messages.marker_scene import MarkerScene
from .messages.obstacle_cloud import cloud_obstacles


class Intake:
    """Takes messages by the name of their input; one that cannot be converted changes nothing and is counted.

    Time is the hand's: markers whose lifetime ends before a hand sample's stamp are gone for it. Attributes: pipeline; sample,
    the last hand sample that could be read; last_refusal, what was wrong with the last message refused.
    """

    def __init__(self, pipeline: Pipeline) -> None:
        self.pipeline = pipeline
        self.sample: HandSample | None = None
        self.last_refusal: str | None = None
        self._markers = MarkerScene()
        self._markers_ns = 0
        self._markers_hold = (-math.inf, math.inf)
        self._counts: Counter[str] = Counter()
        self._takers: dict[str, Callable[[Any], SampleStatus]] = {
            topics.HAND: self._hand,
            topics.CLOUD: self._cloud,
            topics.MARKERS: self._marker_array,
            topics.GOALS: self._goals,
            topics.GOAL: self._goal,
        }

    @property
    def counts(self) -> dict[str, int]:
        """How often each kind of refusal, drop, restart or failure occurred here and in the pipeline, by name."""
        return {**self.pipeline.counts, **self._counts}

    def take(self, role: str, message: Any) -> SampleStatus | None:
        """Take one message; None where it cannot be converted."""
        before = self.pipeline.refused
        try:
            verdict = self._takers[role](message)
        except MessageError as error:
            self._counts[f'{role}_invalid'] += 1
            self.last_refusal = f'{role}: {error}'
            return None
        if self.pipeline.refused > before:
            self.last_refusal = self.pipeline.last_refusal
        return verdict

    def _hand(self, message: Any) -> SampleStatus:
        sample = hand_sample(message, self.pipeline.config.plane)
        self.sample = sample
        verdict = self.pipeline.hand(sample)
        since_ns, until_ns = self._markers_hold
        if verdict.taken and not since_ns <= sample.stamp_ns < until_ns:
            self._show(self._markers)
        return verdict

    def _cloud(self, message: Any) -> SampleStatus:
        scene = cloud_obstacles(message, self.pipeline.config.plane)
        verdict = self.pipeline.set_obstacles('cloud', scene.obstacles, scene.stamp_ns, scene.frame_id)
        self._count_dropped(topics.CLOUD, scene.dropped if verdict.taken else {})
        return verdict

    def _marker_array(self, message: Any) -> SampleStatus:
        config = self.pipeline.config
        # markers that came before the working frame was known, and turned out to be in another one, are none of the scene's
        held = self._markers if self.pipeline.frame_id in (None, self._markers.frame_id) else MarkerScene()
        updated = held.updated(message, self._now_ns(), config.plane, config.scene.marker_radius_stddev)
        verdict = self._show(updated)
        self._count_dropped(topics.MARKERS, dict(updated.dropped) if verdict.taken else {})
        return verdict

    def _show(self, markers: MarkerScene) -> SampleStatus:
        """Hand over the markers that live now.

        Several publishers may add to the table, each with its own delay: a stamp a little behind the newest does not make the
        table late. A table without markers is in every frame.
        """
        behind_ns = self._markers_ns - markers.stamp_ns
        within = markers.stamp_ns and 0 < behind_ns <= self.pipeline.config.estimator.gap_s * NANOSECONDS
        stamp_ns = self._markers_ns if within else markers.stamp_ns
        frame_id = markers.frame_id if markers.markers else self.pipeline.frame_id or markers.frame_id
        verdict = self.pipeline.set_obstacles('markers', markers.obstacles(self._now_ns()), stamp_ns, frame_id)
        if verdict.taken:
            self._markers, self._markers_ns, self._markers_hold = markers, stamp_ns, markers.unchanged(self._now_ns())
        return verdict

    def _goals(self, message: Any) -> SampleStatus:
        return self.pipeline.set_goals(*goals_of_pose_array(message, self.pipeline.config.plane))

    def _goal(self, message: Any) -> SampleStatus:
        return self.pipeline.set_goals(*goal_of_pose(message, self.pipeline.config.plane))

    def _now_ns(self) -> int:
        return self.pipeline.hand_state.stamp_ns if self.pipeline.hand_state is not None else 0

    def _count_dropped(self, role: str, dropped: dict[str, int]) -> None:
        for reason, count in dropped.items():
            self._counts[f'{role}_dropped_{reason}'] += count
