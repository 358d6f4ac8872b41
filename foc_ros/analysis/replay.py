# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""A recording through predictor and guidance in its own time: without ROS, clock or waiting, so that results repeat."""

from __future__ import annotations

import math
from collections import Counter, defaultdict, deque
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from foc_ros.analysis.recordings import Recording
from foc_ros.core.classes.library import Demonstration
from foc_ros.core.config import ONLINE, Config
from foc_ros.core.errors import MessageError, RecordingError, warn
from foc_ros.core.guidance.guide import GuidanceInput, GuidanceOutput, GuidanceState, GuidanceStatus, guide
from foc_ros.core.hand.kalman import FilterState
from foc_ros.core.pipeline import Pipeline
from foc_ros.core.prediction import Prediction
from foc_ros.core.scene import Scene
from foc_ros.core.types import NANOSECONDS, HandSample, SampleStatus
from foc_ros.io.bags import BagReader, Item
from foc_ros.io.class_library import load_library
from foc_ros.io.topics import HAND, STATIC_TRANSFORMS, TRANSFORMS, TYPES
from foc_ros.ros.intake import DROPPED, Intake
from foc_ros.ros.messages.encode_guidance import SampleHeader
from foc_ros.ros.transforms import Transforms, TransformTree


@dataclass(frozen=True)
class Step:
    """One recorded message and its effect: a prediction and its scene, or None where none was due or possible."""

    item: Item
    sample: HandSample | None
    prediction: Prediction | None
    scene: Scene


class Replay:
    """Feeds recorded messages to a pipeline as the node does live; `intake` keeps the counts.

    Transforms of the recording are applied by the log times of the messages. Raises RecordingError or InputError where the class
    library cannot be used.
    """

    def __init__(self, config: Config) -> None:
        self.pipeline = Pipeline(config, load_library(config.homotopy.library))
        self.intake = Intake(self.pipeline)
        self._held: dict[str, deque[Item]] = defaultdict(deque)
        self._begin_recording()

    def _begin_recording(self) -> None:
        self._tree = TransformTree()
        self._transforms = Transforms(self._tree, self.intake)
        self._received: Counter[str] = Counter()
        self._refused: Counter[tuple[str, str]] = Counter()
        self._reasons: dict[tuple[str, str], str] = {}
        self._counts_before = Counter(self.intake.counts)

    def take(self, items: Iterable[Item]) -> Iterator[tuple[Item, HandSample | None]]:
        """Pass the messages to the pipeline in the order in which the node does, without predicting; yield each with its sample.

        The sample is None for other messages than hand poses and for rejected ones.
        """
        for item in items:
            now_s = item.log_ns / NANOSECONDS
            if item.role in (TRANSFORMS, STATIC_TRANSFORMS):
                if isinstance(item.message, MessageError):
                    self.intake.refuse(item.role, item.message)
                    self._note(item.role, None)
                else:
                    left_out = self._tree.add(item.message, is_static=item.role == STATIC_TRANSFORMS)
                    self.intake.count_dropped(item.role, 'not_usable', left_out)
                    self._note(item.role, SampleStatus.ACCEPTED)
                yield item, None
            else:
                self._held[item.role].append(item)
                self._transforms.add(item.role, item.message, now_s)
            for role in self._transforms.roles:
                yield from self._release(role, now_s)
        for role in self._transforms.roles:
            yield from self._release(role, math.inf)

    def steps(self, items: Iterable[Item]) -> Iterator[Step]:
        """Process the messages in their order and yield the effect of each; warn at the end of a class library of no use."""
        for item, sample in self.take(items):
            prediction = self.pipeline.predict() if sample is not None and self.pipeline.is_due else None
            yield Step(item, sample, prediction, self.pipeline.scene)
        if self.pipeline.library_doubt:
            warn(f'{self.pipeline.config.homotopy.library}: {self.pipeline.library_doubt}')

    def forget_scene(self) -> None:
        """Forget scene, working frame, transforms and counts of refusals: another recording has its own."""
        for source in tuple(self.pipeline.scene.sources):
            self.intake.remove_source(source)
        self.pipeline.forget_scene()
        hand = self.pipeline.hand_state
        if hand is not None:  # the next sample restarts the filter, also if its stamp is only a little earlier than the last one
            self.pipeline.hand_state = replace(hand, stamp_ns=2**63 - 1)
        self._begin_recording()

    def describe_losses(self) -> str:
        """Return how many messages were refused, with the last reason of each kind, and how many of their parts were left out."""
        refused = [
            f'{count} of {self._received[key[0]]} messages of {key[0]} refused, the last: {self._reasons[key]}'
            for key, count in self._refused.items()
        ]
        counts = Counter(self.intake.counts) - self._counts_before
        parts = [(count, *name.split(DROPPED)) for name, count in counts.items() if DROPPED in name]
        left_out = [f'{count} parts of {role} left out ({reason})' for count, role, reason in parts]
        wrong = SampleStatus.WRONG_FRAME.value
        late = sum(count for name, count in counts.items() if name.endswith(wrong))
        late -= sum(count for (_, status), count in self._refused.items() if status == wrong)
        if late > 0:
            left_out.append(f'{late} messages before the first hand pose left out: they are in another frame than it')
        return '; '.join([*refused, *left_out])

    def _release(self, role: str, now_s: float) -> Iterator[tuple[Item, HandSample | None]]:
        for arrival in self._transforms.release(role, now_s):
            try:
                status = self.intake.take_arrival(role, arrival)
            except (AttributeError, TypeError, ValueError) as error:  # the recording defines the message in another way than ROS
                self.intake.refuse(role, MessageError('message', f'the fields of {TYPES[role]}', error))
                status = None
            self._note(role, status)
            is_taken = role == HAND and status is not None and status.is_taken
            yield self._held[role].popleft(), self.intake.sample if is_taken else None

    def _note(self, role: str, status: SampleStatus | None) -> None:
        """Count a message, and why it was refused if it was."""
        self._received[role] += 1
        if status is None or status.is_refused:
            key = role, 'invalid' if status is None else status.value
            self._refused[key] += 1
            self._reasons[key] = self.intake.last_refusal or ''


def keep_last_run(samples: list[HandSample], sample: HandSample, *made: list[Any]) -> bool:
    """Add a sample to those of a recording, and return whether the recording begins anew with it.

    Then the samples before it, and what was made from them, are dropped.
    """
    begins_anew = bool(samples) and sample.stamp_ns <= samples[-1].stamp_ns
    if begins_anew:
        for each in (samples, *made):
            each.clear()
    samples.append(sample)
    return begins_anew


def replay(bag: Path | str, config: Config, chosen: Mapping[str, str] | None = None) -> Iterator[Prediction]:
    """Yield every prediction of a recording; chosen: topic by input name. Raises RecordingError."""
    with BagReader(bag, chosen) as reader:
        for step in Replay(config).steps(reader):
            if step.prediction is not None:
                yield step.prediction


@dataclass(frozen=True)
class GuidanceStep:
    """One update: its stamp [ns], where its hand sample was, and its output."""

    stamp_ns: int
    header: SampleHeader
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
        self._hand: FilterState | None = None
        self._prediction: Prediction | None = None

    def add(self, step: Step) -> Iterator[GuidanceStep]:
        """Yield the updates until the hand sample of a step, then use its sample and its prediction."""
        if step.sample is None:
            return
        stamp_ns, hand = step.sample.stamp_ns, self._pipeline.hand_state
        if self._hand is None or stamp_ns < self._hand.stamp_ns:  # the recording began anew
            self._state, self._first_ns, self._next_ns, self._prediction = GuidanceState(), stamp_ns, stamp_ns, None
        else:
            yield from self._update_until(stamp_ns, self._hand)
            if hand is not None and not self._hand.is_continued_by(hand):
                self._state, self._prediction = replace(self._state, position=hand.mean[:2]), None
        self._hand = hand
        if step.prediction is not None:
            self._prediction = step.prediction

    def _update_until(self, end_ns: int, hand: FilterState) -> Iterator[GuidanceStep]:
        config, prediction = self._pipeline.config, self._prediction
        while self._next_ns < end_ns:
            prediction_ns = self._next_ns if prediction is None else prediction.stamp_ns
            ages = (self._next_ns - hand.stamp_ns) / NANOSECONDS, (self._next_ns - prediction_ns) / NANOSECONDS
            # seconds since the epoch would be rounded to a quarter of a microsecond
            t = (self._next_ns - self._first_ns) / NANOSECONDS
            given = GuidanceInput(t, hand.mean[:2], hand.mean[2:4], prediction, *ages, acceleration=hand.mean[4:6])
            output, self._state = guide(config, self._state, given)
            yield GuidanceStep(self._next_ns, SampleHeader(hand.stamp_ns, hand.frame_id, hand.height, config.plane), output)
            self._next_ns += self._period_ns
            if output.status is not GuidanceStatus.GUIDING and not output.force.any() and not output.authority:
                self._next_ns = max(self._next_ns, end_ns)
                self._state = replace(self._state, t=(self._next_ns - self._first_ns) / NANOSECONDS)


def learn_recording(recording: Recording, config: Config) -> tuple[Demonstration, ...]:
    """Return the movements of a recording that end at a goal, the last ones; raises RecordingError where there is none."""
    replayed = Replay(config.with_values({'experience.learning': ONLINE, 'homotopy.library': ''}))
    for _ in replayed.take(recording.items()):
        pass
    movements = replayed.pipeline.learnt.movements.finish()
    losses = replayed.describe_losses()
    if not movements.learnt:
        standing = f'no movement: the hand was never faster than {config.estimator.onset_speed:g} m/s'
        unused = losses or replayed.pipeline.not_ready_reason()
        raise RecordingError(f'{recording.name}: {movements.refusal or unused or standing}')
    if losses:
        warn(f'{recording.name}: {losses}')
    return movements.learnt
