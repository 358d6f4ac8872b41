"""Guidance of a recording in the recording's own time: updates at fixed instants by stamps, so that results repeat."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

from foc_ros.core.guidance.guide import GuidanceInput, GuidanceOutput, GuidanceState, GuidanceStatus, guide
from foc_ros.core.pipeline import Pipeline
from foc_ros.core.types import NANOSECONDS, HandState, Prediction
from foc_ros.ros.messages.encode_guidance import Place

from .replay import Step


@dataclass(frozen=True)
class GuidanceStep:
    """One update: its stamp [ns], where its hand sample was, and its output."""

    stamp_ns: int
    place: Place
    output: GuidanceOutput


class GuidanceReplay:
    """Updates guidance between the steps of a replay, at `guidance.rate_hz`, as a node that receives messages without delay.

    An update at an instant knows the hand samples and predictions of stamps before it. Between movements, while there is no force
    and no fresh prediction, there are no updates.
    """

    def __init__(self, pipeline: Pipeline) -> None:
        self._pipeline = pipeline
        self._period_ns = round(NANOSECONDS / pipeline.config.guidance.rate_hz)
        self._state, self._first_ns, self._next_ns = GuidanceState(), 0, 0
        self._hand: HandState | None = None
        self._prediction: Prediction | None = None

    def add(self, step: Step) -> Iterator[GuidanceStep]:
        """Yield the updates until the hand sample of a step, then use its sample and its prediction."""
        if step.sample is None:
            return
        stamp_ns, hand = step.sample.stamp_ns, self._pipeline.hand_state
        if self._hand is None or stamp_ns < self._hand.stamp_ns:  # the recording began anew
            self._state, self._first_ns, self._next_ns, self._prediction = GuidanceState(), stamp_ns, stamp_ns, None
        elif self._hand is not None:
            yield from self._update_until(stamp_ns, self._hand)
        self._hand = hand
        if step.prediction is not None:
            self._prediction = step.prediction

    def _update_until(self, end_ns: int, hand: HandState) -> Iterator[GuidanceStep]:
        config = self._pipeline.config
        while self._next_ns < end_ns:
            output, self._state = guide(config, self._state, self._make_input(hand))
            yield GuidanceStep(self._next_ns, Place(hand.stamp_ns, hand.frame_id, hand.height, config.plane), output)
            self._next_ns += self._period_ns
            if output.status is GuidanceStatus.STALE and not output.force.any() and not output.authority:
                self._next_ns = max(self._next_ns, end_ns)
                self._state = replace(self._state, t=(self._next_ns - self._first_ns) / NANOSECONDS)

    def _make_input(self, hand: HandState) -> GuidanceInput:
        now_ns, prediction = self._next_ns, self._prediction
        prediction_ns = now_ns if prediction is None else prediction.stamp_ns
        ages = (now_ns - hand.stamp_ns) / NANOSECONDS, (now_ns - prediction_ns) / NANOSECONDS
        # seconds since the epoch would be rounded to a quarter of a microsecond
        t = (now_ns - self._first_ns) / NANOSECONDS
        return GuidanceInput(t, hand.mean[:2], hand.mean[2:4], prediction, *ages, acceleration=hand.mean[4:6])
