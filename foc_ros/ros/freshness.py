# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The inputs by the node's clocks: counts, rates and ages of their messages, and why the clocks allow no prediction.

The pipeline knows message stamps only, so that a replay needs no clock. Times named `_s` are of the steady clock [s], those named
`clock_ns` are ROS time [ns].
"""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Iterable
from dataclasses import dataclass

from foc_ros.core.config import Config
from foc_ros.core.pipeline import SampleStatus
from foc_ros.core.types import NANOSECONDS
from foc_ros.io.topics import CLOUD, COLLISION, DETECTIONS, HAND, MARKERS

SOURCE_TOPICS = {'cloud': CLOUD, 'markers': MARKERS, COLLISION: COLLISION, DETECTIONS: DETECTIONS}
"""Topic of every source of obstacles in the scene."""


@dataclass
class Input:
    """Messages of one input: how many were received, refused, and received before the last report.

    And when the last one was received, used and refused, and why it was refused.
    """

    received: int = 0
    refused: int = 0
    reported: int = 0
    received_s: float = -math.inf
    used_s: float | None = None
    refused_s: float = -math.inf
    refusal: str = ''


class Freshness:
    """Ages of the inputs: the time since their last message, and the age of a hand pose by its stamp, if it has ROS time.

    Attributes: inputs, by topic.
    """

    def __init__(self) -> None:
        self.inputs: defaultdict[str, Input] = defaultdict(Input)
        self._age_s = 0.0
        self._has_ros_time = self._is_moving = False

    def note(self, role: str, status: SampleStatus | None, now_s: float, refusal: str | None = None) -> Input:
        """Count a message of an input, and return its counts; status: what became of it, None if it could not be decoded."""
        entry = self.inputs[role]
        entry.received, entry.received_s = entry.received + 1, now_s
        if status is None or status.is_refused:
            entry.refused, entry.refused_s, entry.refusal = entry.refused + 1, now_s, refusal or ''
        elif status.is_taken:
            entry.used_s = now_s
        return entry

    def note_pose(self, stamp_ns: int, clock_ns: int, timeout_s: float, *, is_restart: bool) -> None:
        """Store the age of a hand pose by ROS time.

        Ages count once a movement has begun with a pose that is not older or newer than the timeout. If a recording is played
        with its own stamps and without `use_sim_time`, the age of its poses means nothing, and it is not checked.
        """
        self._age_s = (clock_ns - stamp_ns) / NANOSECONDS
        if clock_ns and (is_restart or not self._is_moving):
            self._has_ros_time = self._has_ros_time or abs(self._age_s) <= timeout_s
            self._is_moving = True

    def forget_clock(self) -> None:
        """Forget whether the poses are stamped by ROS time."""
        self._has_ros_time = self._is_moving = False

    def used_s(self, role: str, now_s: float) -> float:
        """Return when a message of an input was used last; now_s if none was."""
        used_s = self.inputs[role].used_s
        return now_s if used_s is None else used_s

    def find_not_ready_reason(self, now_s: float, config: Config, sources: Iterable[str]) -> tuple[str, str] | None:
        """Return why the clocks allow no prediction, as (kind, text); None if they allow it.

        sources: the sources of obstacles. If one of them is silent, nothing is predicted: its obstacles may still be there.
        """
        hand, limit_s, age_s = self.inputs[HAND], config.estimator.hand_timeout_s, abs(self._age_s)
        limit, silence_s = f'(estimator.hand_timeout_s is {limit_s:g})', now_s - self.used_s(HAND, now_s)
        if 0.0 < limit_s < silence_s and now_s - hand.refused_s <= limit_s:
            return 'hand_refused', f'no hand_pose could be used for {silence_s:.1f} s, the last: {hand.refusal}'
        if 0.0 < limit_s < silence_s:
            return 'hand_silent', f'hand_pose silent for {silence_s:.1f} s {limit}'
        if self._has_ros_time and 0.0 < limit_s < age_s:
            relation = 'older' if self._age_s > 0.0 else 'newer'
            return 'hand_stale', f'the hand pose is {age_s:.3g} s {relation} than the time of the node {limit}'
        for source in self.find_silent_sources(now_s, config, sources):
            role = SOURCE_TOPICS[source]
            silence_s, limit = now_s - self.used_s(role, now_s), f'(scene.timeout_s is {config.scene.timeout_s:g})'
            return 'obstacles_silent', f'{role} silent for {silence_s:.1f} s {limit}'
        return None

    def find_silent_sources(self, now_s: float, config: Config, sources: Iterable[str]) -> list[str]:
        """Return the sources of obstacles that have been silent for more than `scene.timeout_s`."""
        limit_s = config.scene.timeout_s
        return [each for each in sources if 0.0 < limit_s < now_s - self.used_s(SOURCE_TOPICS[each], now_s)]

    def find_late_reason(self, stamp_ns: int, received_s: float, now_s: float, clock_ns: int, config: Config) -> str | None:
        """Return why a prediction is not published now that it is computed, None if it is.

        stamp_ns, received_s: stamp of its hand pose [ns], and when that arrived.
        """
        age_s, limit_s = now_s - received_s, config.estimator.hand_timeout_s
        if self._has_ros_time:
            age_s = max(age_s, (clock_ns - stamp_ns) / NANOSECONDS)
        if not 0.0 < limit_s < age_s:
            return None
        return f'the last prediction took until its hand pose was {age_s:.3g} s old (estimator.hand_timeout_s is {limit_s:g})'
