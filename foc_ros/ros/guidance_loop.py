"""The thread of guidance: updates at `guidance.rate_hz` by the steady clock, whatever the executor and the predictions do.

The executor tells the thread what is new by replacing one record; the thread reads it at each update. So neither waits for the
other. While guidance is enabled, the thread has the priority `guidance.realtime_priority`, if that is permitted: the thread
sleeps after each update, so that others run as well. While guidance is disabled, the thread waits without updates.
"""

from __future__ import annotations

import threading
from collections.abc import Callable
from dataclasses import dataclass, replace
from time import monotonic

import numpy as np

from foc_ros.core.config import Config
from foc_ros.core.guidance.guide import GuidanceInput, GuidanceOutput, GuidanceState, GuidanceStatus, guide
from foc_ros.core.hand.kalman import FilterState
from foc_ros.core.types import Prediction

from .messages.encode_guidance import Place
from .realtime import ThreadPriority

LEAST_SLEEP = 0.1
"""Part of the period that the thread sleeps after an update that was late: it must not keep a processor for itself."""
ZEROS = 2
"""Number of outputs without any force that are published after the hand has been released."""
END_S = 1.0
"""Longest time to wait for the end of the thread [s]."""


@dataclass(frozen=True)
class Newest:
    """What guidance knows: the hand and when it was received, the prediction and when its hand was received [s, steady clock].

    is_released: whether the clutch is open or the node is not active.
    """

    config: Config
    hand: FilterState | None = None
    hand_s: float = 0.0
    prediction: Prediction | None = None
    prediction_s: float = 0.0
    is_released: bool = True

    @property
    def place(self) -> Place | None:
        """Where the hand is, None without one."""
        hand = self.hand
        return None if hand is None else Place(hand.stamp_ns, hand.frame_id, hand.height, self.config.plane)


class GuidanceLoop:
    """Updates guidance, and publishes it until the force has become zero, and then once more.

    Attributes: newest; output, the last one, and place, that of the last one that was published, None before the first.

    Parameters
    ----------
    config
        All parameters.
    publish
        Called in the thread with each output and the place where it holds.
    report
        Called in the thread with an exception of an update, after which guidance begins anew with a force of zero.
    warn
        Called in the thread with a text if it may not have its priority.
    """

    def __init__(
        self,
        config: Config,
        publish: Callable[[GuidanceOutput, Place], None],
        report: Callable[[Exception], None],
        warn: Callable[[str], None],
    ) -> None:
        self.newest = Newest(config)
        self.output: GuidanceOutput | None = None
        self.place: Place | None = None
        self._publish, self._report, self._warn = publish, report, warn
        self._priority = 0
        self._state, self._zeros = GuidanceState(), ZEROS
        self._end, self._enabled = threading.Event(), threading.Event()
        self._thread: threading.Thread | None = None

    def note_hand(self, hand: FilterState | None, now_s: float) -> None:
        """Use a new estimate of the hand; None if there is none any more."""
        self.newest = replace(self.newest, hand=hand, hand_s=now_s, prediction=self.newest.prediction if hand else None)

    def note_prediction(self, prediction: Prediction, received_s: float) -> None:
        """Use a new prediction; received_s: when its hand pose was received."""
        self.newest = replace(self.newest, prediction=prediction, prediction_s=received_s)

    def set_released(self, is_released: bool) -> None:
        """Release the hand, or guide it from the next prediction on."""
        self.newest = replace(self.newest, is_released=is_released, prediction=None)

    def reconfigure(self, config: Config) -> None:
        """Use other parameters."""
        self.newest = replace(self.newest, config=config)
        self._wake()

    def start(self) -> None:
        """Begin to update."""
        self._end.clear()
        self._wake()
        self._thread = threading.Thread(target=self._run, name='guidance', daemon=True)
        self._thread.start()

    def stop(self) -> None:
        """End the thread. Nothing is published after that."""
        self._end.set()
        self._enabled.set()
        if self._thread is not None:
            self._thread.join(END_S)
            self._thread = None
        self._state, self._zeros = GuidanceState(), ZEROS

    def describe(self) -> dict[str, str]:
        """Return the values for the diagnostics."""
        output, settings = self.output, self.newest.config.guidance
        if not settings.enabled:
            return {'guidance': 'disabled'}
        if output is None:
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
        newest = self.newest
        is_released = newest.is_released or not newest.config.guidance.enabled
        mean = newest.hand.mean if newest.hand is not None else np.concatenate([self._state.position, np.zeros(4)])
        position, velocity, acceleration = mean.reshape(3, 2)
        if self._zeros >= ZEROS and (is_released or newest.prediction is None):
            self._state = replace(self._state, t=now_s, position=position)
            return
        ages = now_s - newest.hand_s, now_s - newest.prediction_s
        given = GuidanceInput(now_s, position, velocity, newest.prediction, *ages, is_released, acceleration)
        self.output, self._state = guide(newest.config, self._state, given)
        self._zeros = self._zeros + 1 if _has_ended(self.output) else 0
        if self._zeros <= ZEROS:
            self.place = newest.place or self.place
            if self.place is not None:
                self._publish(self.output, self.place)

    def _wake(self) -> None:
        """Let the thread update if guidance is enabled."""
        if self.newest.config.guidance.enabled:
            self._enabled.set()
        else:
            self._enabled.clear()

    def _run(self) -> None:
        """Update once in a period; a late update shifts the following ones."""
        due_s, priority = monotonic(), ThreadPriority(self._warn)
        while not self._end.wait(max(due_s - monotonic(), 0.0)):
            if self._zeros >= ZEROS and not self._enabled.is_set():
                priority.set(0)
                self._enabled.wait()
                self._state = GuidanceState()
                continue
            priority.set(self.newest.config.guidance.realtime_priority)
            self._priority = priority.priority
            try:
                self.update(monotonic())
            except Exception as error:
                self._state = GuidanceState()
                self._report(error)
            period_s = 1.0 / self.newest.config.guidance.rate_hz
            due_s = max(due_s + period_s, monotonic() + LEAST_SLEEP * period_s)


def _has_ended(output: GuidanceOutput) -> bool:
    return output.status is not GuidanceStatus.GUIDING and not output.force.any() and not output.authority
