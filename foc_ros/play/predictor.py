# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The pipeline and the guidance of the node, without a node, in two threads of this process."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from logging import getLogger
from queue import SimpleQueue
from threading import Thread
from time import monotonic
from typing import Any, Literal

from foc_ros.core.config import Config
from foc_ros.core.deadline import Deadline
from foc_ros.core.guidance.guide import GuidanceOutput
from foc_ros.core.pipeline import Pipeline
from foc_ros.core.prediction import Prediction
from foc_ros.core.solution import Status
from foc_ros.io.class_library import load_library
from foc_ros.io.topics import HAND
from foc_ros.reporting.views import find_entered, is_late
from foc_ros.ros.guidance import GuidanceLoop
from foc_ros.ros.intake import Intake
from foc_ros.ros.messages.encode_guidance import SampleHeader

from .scene import View, view_prediction

REMEMBERED = 20
"""Number of predictions from which the state is told."""
Outcome = View | tuple[GuidanceOutput, SampleHeader]
"""A prediction for the page, or guidance and where it holds."""
Receive = Callable[[Outcome], object]


@dataclass(frozen=True)
class State:
    """What the predictor does, in words; level: whether all is well, it waits for something, or something fails."""

    level: Literal['well', 'waiting', 'failing']
    text: str


class Predictor:
    """Takes messages of the inputs, and passes on predictions and guidance, between `start` and `stop`.

    config: with which it begins; receive: called with every outcome, in another thread.
    """

    def __init__(self, config: Config, receive: Receive) -> None:
        self._receive = receive
        self._intake = Intake(Pipeline(config, load_library(config.homotopy.library)))
        self._queue: SimpleQueue[tuple[float, str, Any] | Config | None] = SimpleQueue()
        self._ended_s = 0.0
        self._error = ''
        self._recent: deque[Prediction] = deque(maxlen=REMEMBERED)
        self._guidance = GuidanceLoop(config, lambda *outcome: receive(outcome), self._note_error, getLogger(__name__).warning)
        self._thread = Thread(target=self._run, name='prediction', daemon=True)

    def start(self) -> None:
        """Begin to predict."""
        self._guidance.set_released(False)
        self._guidance.start()
        self._thread.start()

    def stop(self) -> None:
        """End both threads; nothing is received after that."""
        self._queue.put(None)
        self._thread.join()
        self._guidance.stop()

    def send(self, role: str, message: Any) -> None:
        """Take a message of an input."""
        self._queue.put((monotonic(), role, message))

    def configure(self, config: Config) -> None:
        """Use other parameters, after the messages that were sent before; movement and scene are kept."""
        self._queue.put(config)

    def check(self) -> State:
        """Return the state; an internal error ends a prediction, and not the thread."""
        recent, pipeline = list(self._recent), self._intake.pipeline
        reason, budget_s = pipeline.not_ready_reason(), pipeline.config.budget_s
        if not self._thread.is_alive():
            return State('failing', 'predictions have ended: start `foc_ros play` again')
        if self._error:
            return State('failing', self._error)
        if reason:
            return State('waiting', reason)
        if recent and not recent[-1].candidates_with_likelihood:
            return State('failing', 'no path to any goal can be found')
        found = [each.candidates_with_likelihood for each in recent]
        if sum(bool(paths) and all(path.age_s for path in paths) for paths in found) > 0.5 * REMEMBERED:  # no path is new
            return State('failing', 'this computer is too busy: paths from before are shown; end other programs')
        if recent and (entered := find_entered(recent[-1])):
            return State('waiting', f'predicting, but the hand is inside obstacle {", ".join(entered)}')
        if recent and (recent[-1].candidates[0].status is Status.DEADLINE or sum(map(is_late, recent)) > 0.5 * REMEMBERED):
            return State('waiting', f'predicting, but some dotted paths are not finished within {budget_s:g} s (budget_s)')
        return State('well', 'predicting')

    def _run(self) -> None:
        while (given := self._queue.get()) is not None:
            try:
                if isinstance(given, Config):
                    self._intake.pipeline.reconfigure(given)
                    self._guidance.reconfigure(given)
                    continue
                sent_s, role, message = given
                self._take(role, message)
                # A pose that has waited for the last prediction is skipped: the page sends the next one within a frame. The
                # prediction from that pose is seen hardly later, and shows a younger hand.
                if self._queue.empty() and sent_s >= self._ended_s:
                    self._predict()
            except Exception as error:
                self._note_error(error)
                self._intake.pipeline.reset()

    def _take(self, role: str, message: Any) -> None:
        status = self._intake.take(role, message)
        if role == HAND and status is not None and status.is_taken:
            self._guidance.note_hand(self._intake.pipeline.hand_state, monotonic())

    def _predict(self) -> None:
        pipeline, received_s = self._intake.pipeline, monotonic()
        prediction = pipeline.predict(Deadline(pipeline.config.budget_s or None)) if pipeline.is_due else None
        self._ended_s = monotonic()
        if prediction is not None:
            self._error = ''
            self._guidance.note_prediction(prediction, received_s)
            # encoded in this thread: if the thread of the page did it during the next prediction, each would delay the other
            view = view_prediction(prediction)
            self._recent.append(view.prediction)
            self._receive(view)

    def _note_error(self, error: Exception) -> None:
        self._error = f'internal error: {error}'
