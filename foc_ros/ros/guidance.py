# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Guidance of the node: updates at `guidance.rate_hz` by the steady clock in a thread of their own, and their topics.

The executor tells the thread what is new by replacing one record; the thread reads it at each update. So neither waits for the
other. While guidance is enabled, the thread has the priority `guidance.realtime_priority`, if that is permitted. The loop needs
no ROS; `play` uses it too.
"""

from __future__ import annotations

import math
import os
import threading
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from time import monotonic, sleep
from typing import TYPE_CHECKING, Any

import numpy as np

from foc_ros.core.config import Config
from foc_ros.core.errors import InputError
from foc_ros.core.guidance.guide import GuidanceInput, GuidanceOutput, GuidanceState, GuidanceStatus, guide
from foc_ros.core.hand.kalman import FilterState
from foc_ros.core.prediction import Prediction
from foc_ros.io.topics import COMMAND

from .health import THROTTLE_S
from .messages.encode_guidance import (
    GUIDANCE_OUTPUTS,
    LIVE_OUTPUTS,
    TWIST,
    TWIST_TYPE,
    SampleHeader,
    blend_twist,
    encode_guidance_markers,
)
from .messages.types import MessageTypes, RclpyTypes

if TYPE_CHECKING:
    from rclpy.node import Node

ZEROS = 2
"""Number of outputs without any force that are published after the hand has been released."""


@dataclass(frozen=True)
class Newest:
    """What guidance knows: the hand and the prediction, and when the hand of each was received [s, steady clock]."""

    config: Config
    hand: FilterState | None = None
    hand_s: float = 0.0
    prediction: Prediction | None = None
    prediction_s: float = 0.0
    is_released: bool = True

    @property
    def sample_header(self) -> SampleHeader | None:
        """Where the hand is, None without one."""
        hand = self.hand
        return None if hand is None else SampleHeader(hand.stamp_ns, hand.frame_id, hand.height, self.config.plane)


class GuidanceLoop:
    """Updates guidance, and publishes it until the force has become zero, and then once more.

    Attributes: newest; output, the last one; sample_header, that of the last one that was published. Called in the thread:
    publish, with each output and its header; report, with an exception of an update, after which guidance begins anew with a
    force of zero; warn, with a text if it may not have its priority.
    """

    def __init__(
        self,
        config: Config,
        publish: Callable[[GuidanceOutput, SampleHeader], object],
        report: Callable[[Exception], None] = lambda _: None,
        warn: Callable[[str], None] = lambda _: None,
    ) -> None:
        self.newest = Newest(config)
        self.output: GuidanceOutput | None = None
        self.sample_header: SampleHeader | None = None
        self._publish, self._report, self._warn = publish, report, warn
        self._priority = self._wanted_priority = 0
        self._has_warned = False
        self._state, self._zeros = GuidanceState(), ZEROS
        self._hand: FilterState | None = None  # of the last update
        self._end_s, self._enabled = math.inf, threading.Event()
        self._thread: threading.Thread | None = None

    def note_hand(self, hand: FilterState | None, now_s: float) -> None:
        """Use a new estimate of the hand; None if there is none any more. After a restart, only new predictions count."""
        before = self.newest.hand
        prediction = self.newest.prediction if before is not None and before.is_continued_by(hand) else None
        self.newest = replace(self.newest, hand=hand, hand_s=now_s, prediction=prediction)

    def note_prediction(self, prediction: Prediction, received_s: float) -> None:
        """Use a new prediction; received_s: when its hand pose was received."""
        self.newest = replace(self.newest, prediction=prediction, prediction_s=received_s)

    def set_released(self, is_released: bool) -> None:
        """Release the hand, or guide it from the next prediction on."""
        self.newest = replace(self.newest, is_released=is_released, prediction=None)

    def reconfigure(self, config: Config) -> None:
        """Use other parameters."""
        self.newest = replace(self.newest, config=config)
        if config.guidance.enabled:
            self._enabled.set()
        else:
            self._enabled.clear()

    def start(self) -> None:
        """Begin to update."""
        self._end_s = math.inf
        self.reconfigure(self.newest.config)
        self._thread = threading.Thread(target=self._run, name='guidance', daemon=True)
        self._thread.start()

    def stop(self) -> None:
        """Release the hand, and end the thread once there is no force. Nothing is published after that."""
        self.set_released(True)
        settings = self.newest.config.guidance
        longest_s = settings.ramp_s + (ZEROS + 2) / settings.rate_hz + 1.0  # an update may be late
        self._end_s = monotonic() + longest_s
        self._enabled.set()
        if self._thread is not None:
            self._thread.join(longest_s + 1.0)
            self._thread = None
        self._state, self._zeros = GuidanceState(), ZEROS

    @property
    def is_idle(self) -> bool:
        """Whether nothing is published until a hand is guided again."""
        return self._zeros > ZEROS

    def describe(self) -> dict[str, str]:
        """Return the values for the diagnostics."""
        output, settings = self.output, self.newest.config.guidance
        if not settings.enabled:
            return {'guidance': 'disabled'}
        if output is None or self.newest.hand is None:
            return {'guidance': 'no hand yet'}
        return {
            'guidance': output.status.value,
            'agreement': f'{output.agreement:.3f}',
            'authority': f'{output.authority:.3f}',
            'tank_J': f'{output.tank:.4f}',
            'force_N': f'{float((output.force @ output.force) ** 0.5):.3f}',
            'realtime_priority': str(self._priority),
        }

    def update(self, now_s: float) -> None:
        """Compute guidance at a time by the steady clock, and publish it; called in the thread."""
        newest, before = self.newest, self._hand
        is_released = newest.is_released or not newest.config.guidance.enabled
        mean = newest.hand.mean if newest.hand is not None else np.concatenate([self._state.position, np.zeros(4)])
        position, velocity, acceleration = mean.reshape(3, 2)
        self._hand = newest.hand
        if before is None or not before.is_continued_by(newest.hand):
            self._state = replace(self._state, position=position)  # the hand did not move there: that is no work
        ages = now_s - newest.hand_s, now_s - newest.prediction_s
        given = GuidanceInput(now_s, position, velocity, newest.prediction, *ages, is_released, acceleration)
        self.output, self._state = guide(newest.config, self._state, given)
        has_ended = self.output.status is not GuidanceStatus.GUIDING and not self.output.force.any() and not self.output.authority
        self._zeros = self._zeros + 1 if has_ended else 0
        if not self.is_idle:
            self.sample_header = newest.sample_header or self.sample_header
            if self.sample_header is not None:
                self._publish(self.output, self.sample_header)
        elif is_released:
            self._state = GuidanceState()  # with a full tank

    def _run(self) -> None:
        """Update once in a period; a late update shifts the following ones."""
        due_s = monotonic()
        while self._end_s == math.inf or (self._zeros < ZEROS and monotonic() < self._end_s):
            sleep(max(due_s - monotonic(), 0.0))
            if self._zeros >= ZEROS and not self._enabled.is_set():
                self._set_priority(0)
                self._enabled.wait()
                self._state = GuidanceState()
                continue
            self._set_priority(self.newest.config.guidance.realtime_priority)
            try:
                self.update(monotonic())
            except Exception as error:
                self._state = GuidanceState()
                self._report(error)
            period_s = 1.0 / self.newest.config.guidance.rate_hz
            due_s = max(due_s + period_s, monotonic() + 0.1 * period_s)  # it must not keep a processor for itself

    def _set_priority(self, priority: int) -> None:
        """Give this thread a priority of SCHED_FIFO, 0 for an ordinary one; threads that it starts have an ordinary one."""
        if priority == self._wanted_priority:
            return
        self._wanted_priority = priority
        try:
            policy = (os.SCHED_FIFO if priority else os.SCHED_OTHER) | os.SCHED_RESET_ON_FORK
            os.sched_setscheduler(0, policy, os.sched_param(priority))
            self._priority = priority
        except (OSError, AttributeError) as error:  # Python has these on Linux only
            if not self._has_warned:
                remedy = 'allow it with `rtprio` in /etc/security/limits.d, or set guidance.realtime_priority to 0'
                self._warn(f'the real-time priority {priority} of guidance is not permitted ({error}): {remedy}')
                self._has_warned = True


class GuidanceTopics:
    """Publishes guidance for a node while `loop` runs, which has to be told what is new; publishers: of the node, by topic."""

    def __init__(self, node: Node, publishers: Mapping[str, Any], config: Config, report: Callable[[Exception], None]) -> None:
        self._node, self._publishers = node, publishers
        self._thread_types = RclpyTypes()  # messages of the thread of guidance; no other thread uses them
        self.loop = GuidanceLoop(config, self._publish_output, report, node.get_logger().warning)

    def list_kinds(self) -> dict[str, str]:
        """Return the types of the outputs, by the names of their topics."""
        outputs = LIVE_OUTPUTS if self._node.get_parameter('guidance.unstamped').value else GUIDANCE_OUTPUTS
        return {name: kind for name, (kind, _) in outputs.items()} | {TWIST: TWIST_TYPE}

    def encode_markers(self, types: MessageTypes) -> list[Any]:
        """Return the markers of the last output, none if guidance is disabled or has no hand."""
        output, newest = self.loop.output, self.loop.newest
        if output is None or newest.sample_header is None or not newest.config.guidance.enabled:
            return []
        return encode_guidance_markers(output, newest.sample_header, types)

    def blend_command(self, command: Any, types: MessageTypes) -> None:
        """Publish the operator's command with the share of guidance in it, or as it is where there is no guidance."""
        output, header, config = self.loop.output, self.loop.sample_header, self.loop.newest.config
        if not config.guidance.enabled:
            return
        if output is not None and header is not None and monotonic() - output.t <= config.guidance.hold_s:
            try:
                command = blend_twist(output, header, command, types)
            except InputError as error:
                self._node.get_logger().warning(f'{COMMAND} is not blended: {error}', throttle_duration_sec=THROTTLE_S)
        self._publish(TWIST, command)

    def _publish_output(self, output: GuidanceOutput, header: SampleHeader) -> None:
        for name, (_, encode) in LIVE_OUTPUTS.items():
            if name in self._publishers and self._publishers[name].get_subscription_count():
                self._publish(name, encode(output, header, self._thread_types))

    def _publish(self, name: str, message: Any) -> None:
        if self._node.context.ok():
            self._publishers[name].publish(message)
