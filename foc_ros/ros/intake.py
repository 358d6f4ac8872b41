# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""From input messages to the pipeline: decoding, counting of refusals, and lifetimes of markers; for node and replay alike."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any, NamedTuple

from foc_ros.core.errors import LostHandError, MessageError
from foc_ros.core.pipeline import Pipeline, SampleStatus
from foc_ros.core.types import NANOSECONDS, HandSample
from foc_ros.io import topics

from .messages.decode_objects import ObjectTable, decode_detections
from .messages.decode_point_cloud import decode_point_cloud
from .messages.decode_poses import FrameLookup, decode_goal, decode_goals, decode_hand_sample, decode_stamp, keep_frame

SOURCES = {role: role for role in (topics.COLLISION, topics.DETECTIONS)} | {topics.CLOUD: 'cloud', topics.MARKERS: 'markers'}
"""Name of the source of obstacles that each input is."""
DROPPED = '_dropped_'
"""Between input and reason in the name of a count of parts of messages that were left out."""
STILL_S = 1.0
"""Time with the same position after which this is told [s]: a tracker repeats its last pose, or a simulated hand rests."""


class Arrival(NamedTuple):
    """A message, when it arrived [s], its record in a bag, and the frame and transform of its headers, or the error of these."""

    message: Any
    received_s: float
    item: Any = None
    look_up: FrameLookup = keep_frame
    error: str = ''
    is_inexact: bool = False


class Intake:
    """Takes messages by the name of their input; one that cannot be decoded changes nothing and is counted.

    Attributes: pipeline; sample: the last decoded hand sample; last_refusal: why the last refused message was refused.
    """

    def __init__(self, pipeline: Pipeline) -> None:
        self.pipeline = pipeline
        self.sample: HandSample | None = None
        self._still: HandSample | None = None  # the first of those that were used with the same position as the last one
        self.last_refusal: str | None = None
        self._tables = dict.fromkeys((topics.MARKERS, topics.COLLISION, topics.DETECTIONS), ObjectTable())
        self._shown = dict.fromkeys(self._tables, (0, 0.0))  # the conditions under which each table is in the scene
        self._counts: Counter[str] = Counter()
        self._handlers: dict[str, Callable[[Any, FrameLookup], SampleStatus]] = {
            topics.HAND: self._take_hand,
            topics.CLOUD: self._take_cloud,
            topics.MARKERS: self._take_markers,
            topics.COLLISION: self._take_collision_object,
            topics.DETECTIONS: self._take_detections,
            topics.GOALS: lambda message, look_up: pipeline.set_goals(*decode_goals(message, pipeline.config.plane, look_up)),
            topics.GOAL: lambda message, look_up: pipeline.set_goals(*decode_goal(message, pipeline.config.plane, look_up)),
        }

    @property
    def counts(self) -> dict[str, int]:
        """How often each kind of refusal, drop, restart or failure occurred here and in the pipeline, by name."""
        return {**self.pipeline.counts, **self._counts}

    def take(self, role: str, message: Any) -> SampleStatus | None:
        """Take one message that is in its frame, as `take_arrival` does."""
        return self.take_arrival(role, Arrival(message, 0.0))

    def take_arrival(self, role: str, arrival: Arrival) -> SampleStatus | None:
        """Take one message, or the error of its decoding; None if it cannot be decoded."""
        if arrival.is_inexact:
            self._counts[f'transform_newest_{role}'] += 1
        refused_before = self.pipeline.refused
        try:
            if isinstance(arrival.message, MessageError):
                raise arrival.message
            status = self._handlers[role](arrival.message, arrival.look_up)
        except MessageError as error:
            self.refuse(role, error)
            return None
        if self.pipeline.refused > refused_before:
            self.last_refusal = '; '.join(filter(None, [self.pipeline.last_refusal, arrival.error]))
        return status

    def refuse(self, role: str, error: MessageError) -> None:
        """Count a message that cannot be decoded."""
        self._counts['hand_lost' if isinstance(error, LostHandError) else f'{role}_invalid'] += 1
        self.last_refusal = f'{role}: {error}'

    def describe_still_hand(self) -> str:
        """Return in words for how long all poses have had the same position; empty if that is less than `STILL_S`."""
        still_s = 0.0
        if self.sample is not None and self._still is not None:
            still_s = (self.sample.stamp_ns - self._still.stamp_ns) / NANOSECONDS
        return f'the hand does not move: the same position for {still_s:.1f} s' if still_s >= STILL_S else ''

    def is_skipped(self, stamp_ns: int) -> bool:
        """Return whether a hand pose of a stamp [ns] will be skipped if it is the next one."""
        hand, interval_s = self.pipeline.hand_state, self.pipeline.config.estimator.min_interval_s
        return hand is not None and 0 < stamp_ns - hand.stamp_ns < int(interval_s * NANOSECONDS)

    def count_dropped(self, role: str, reason: str, count: int) -> None:
        """Count parts of messages of an input, or of transforms, that were left out."""
        if count:
            self._counts[f'{role}{DROPPED}{reason}'] += count

    def remove_source(self, source: str) -> None:
        """Forget the obstacles of one source, such as 'cloud' or 'markers', as if none of its messages had been received."""
        self.pipeline.remove_source(source)
        for role in self._tables:
            if SOURCES[role] == source:
                self._tables[role], self._shown[role] = ObjectTable(), (0, 0.0)

    def _take_hand(self, message: Any, look_up: FrameLookup) -> SampleStatus:
        if self.is_skipped(decode_stamp(message.header)):
            self._counts['hand_skipped'] += 1
            return SampleStatus.SKIPPED
        self.sample = sample = decode_hand_sample(message, self.pipeline.config.plane, look_up)
        status = self.pipeline.add_hand_sample(sample)
        if status.is_taken:
            still = self._still
            is_same = still is not None and (*still.position, still.height) == (*sample.position, sample.height)
            if not is_same or status.is_restart:
                self._still = sample
            for role in self._tables:
                table = self._find_table(role)
                if self._find_conditions(table) != self._shown[role]:
                    self._set_table(role, table)
        return status

    def _take_cloud(self, message: Any, look_up: FrameLookup) -> SampleStatus:
        cloud = decode_point_cloud(message, self.pipeline.config.plane, look_up)
        status = self.pipeline.set_obstacles(SOURCES[topics.CLOUD], cloud.obstacles, cloud.stamp_ns or None, cloud.frame_id)
        return self._note_dropped(topics.CLOUD, cloud.dropped, status)

    def _take_detections(self, message: Any, look_up: FrameLookup) -> SampleStatus:
        table = decode_detections(message, self.pipeline.config.plane, look_up)
        return self._note_dropped(topics.DETECTIONS, table.dropped, self._set_table(topics.DETECTIONS, table))

    def _take_collision_object(self, message: Any, look_up: FrameLookup) -> SampleStatus:
        plane = self.pipeline.config.plane
        return self._update(topics.COLLISION, lambda table: table.with_collision_object(message, plane, look_up))

    def _take_markers(self, message: Any, look_up: FrameLookup) -> SampleStatus:
        now_ns, plane = self._now_ns(), self.pipeline.config.plane
        return self._update(topics.MARKERS, lambda table: table.with_markers(message, now_ns, plane, look_up))

    def _update(self, role: str, change: Callable[[ObjectTable], ObjectTable]) -> SampleStatus:
        """Change the table of an input; a stamp at most `estimator.gap_s` behind the newest one does not make it late."""
        before = self._find_table(role)
        table = change(before)
        if table.stamp_ns and 0 < before.stamp_ns - table.stamp_ns <= self.pipeline.config.estimator.gap_s * NANOSECONDS:
            table = replace(table, stamp_ns=before.stamp_ns)
        return self._note_dropped(role, table.dropped, self._set_table(role, table))

    def _find_table(self, role: str) -> ObjectTable:
        """Return the table of an input, without what was received in another frame before the working frame was known."""
        table = self._tables[role]
        return table if self.pipeline.frame_id in (None, table.frame_id) else ObjectTable()

    def _set_table(self, role: str, table: ObjectTable) -> SampleStatus:
        """Pass the existing objects of a table to the pipeline.

        A table without objects is valid in every frame. One that has never held any is no source: many programs send a DELETEALL
        once at their start, and no markers after it.
        """
        source, status = SOURCES[role], SampleStatus.ACCEPTED
        if table.held or source in self.pipeline.scene.sources:
            frame_id = table.frame_id if table.held else self.pipeline.frame_id or table.frame_id
            obstacles = table.obstacles(self._now_ns(), self.pipeline.config.scene.marker_radius_stddev)
            status = self.pipeline.set_obstacles(source, obstacles, table.stamp_ns or None, frame_id)
        if status.is_taken:
            self._tables[role], self._shown[role] = table, self._find_conditions(table)
        return status

    def _find_conditions(self, table: ObjectTable) -> tuple[int, float]:
        """Return what changes the obstacles of a table without a message: the number of expired ones, the deviation [m]."""
        return table.count_expired(self._now_ns()), self.pipeline.config.scene.marker_radius_stddev

    def _note_dropped(self, role: str, dropped: Mapping[str, int], status: SampleStatus) -> SampleStatus:
        for reason, count in dropped.items() if status.is_taken else ():
            self.count_dropped(role, reason, count)
        return status

    def _now_ns(self) -> int:
        return self.pipeline.hand_state.stamp_ns if self.pipeline.hand_state is not None else 0
