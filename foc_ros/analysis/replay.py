# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""A recording through predictor and guidance in its own time: without ROS, clock or waiting, so that results repeat.

A replay leaves predictions and guidance as JSON, an output bag, and a summary of counts and computing times.
"""

from __future__ import annotations

import json
import math
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, TextIO

import numpy as np

from foc_ros.analysis.recordings import Recording
from foc_ros.core.classes.library import Demonstration
from foc_ros.core.config import ONLINE, Config, replace_values
from foc_ros.core.errors import MessageError, RecordingError, warn
from foc_ros.core.guidance.guide import GuidanceOutput
from foc_ros.core.pipeline import Pipeline
from foc_ros.core.prediction import Prediction
from foc_ros.core.scene import Scene
from foc_ros.core.solution import Status
from foc_ros.core.types import NANOSECONDS, HandSample, SampleStatus
from foc_ros.io.bags import TYPESTORE, BagReader, BagWriter, Item
from foc_ros.io.class_library import load_library
from foc_ros.io.json_output import encode_guidance, encode_prediction
from foc_ros.io.terminal import show_progress
from foc_ros.io.topics import HAND, STATIC_TRANSFORMS, TRANSFORMS, TYPES
from foc_ros.ros.guidance import GuidanceLoop
from foc_ros.ros.intake import DROPPED, Arrival, Intake
from foc_ros.ros.messages.encode_guidance import GUIDANCE_OUTPUTS, SampleHeader
from foc_ros.ros.messages.encode_prediction import encode_outputs
from foc_ros.ros.messages.types import RosbagsTypes
from foc_ros.ros.transforms import Transforms, TransformTree

NODE = '/foc'
"""Name of the node in the topics of the output bag."""
FAILED = 'candidate_'
"""The pipeline counts a candidate that was not solved under this prefix and its status."""


@dataclass(frozen=True)
class Step:
    """One recorded message and its effect: a prediction and its scene, or None where none was due or possible."""

    item: Item
    sample: HandSample | None
    prediction: Prediction | None
    scene: Scene


class Replay:
    """Feeds recorded messages to a pipeline as the node does live; `intake` keeps the counts. Raises as `load_library` does."""

    def __init__(self, config: Config) -> None:
        self.pipeline = Pipeline(config, load_library(config.homotopy.library))
        self._begin_recording()

    def _begin_recording(self) -> None:
        self.intake, self._tree = Intake(self.pipeline), TransformTree()
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
                self._transforms.add(item.role, Arrival(item.message, now_s, item))
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
            yield arrival.item, self.intake.sample if is_taken else None

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


GuidanceUpdate = tuple[int, GuidanceOutput, SampleHeader]
"""Stamp [ns] of an update, its output, and where its hand sample was."""


class GuidanceReplay:
    """Updates guidance between the steps of a replay, at `guidance.rate_hz`, as a node that receives messages without delay."""

    def __init__(self, pipeline: Pipeline) -> None:
        self._pipeline, self._config = pipeline, replace_values(pipeline.config, {'guidance.enabled': True})
        self._period_ns = round(NANOSECONDS / self._config.guidance.rate_hz)
        self._first_ns = self._hand_ns = self._next_ns = 0
        self._loop: GuidanceLoop | None = None
        self._updates: list[GuidanceUpdate] = []

    def add(self, step: Step) -> list[GuidanceUpdate]:
        """Return the updates until the hand sample of a step, then use its sample and its prediction."""
        self._updates = []
        if step.sample is None:
            return self._updates
        stamp_ns = step.sample.stamp_ns
        if self._loop is None or stamp_ns < self._hand_ns:  # the recording begins, or begins anew
            self._loop = GuidanceLoop(self._config, self._keep)
            self._loop.set_released(False)
            self._first_ns = self._next_ns = stamp_ns
        while self._next_ns < stamp_ns:
            self._loop.update(self._seconds(self._next_ns))
            self._next_ns += self._period_ns
            if self._loop.is_idle:  # it stays so until the next sample, which may be years later
                self._next_ns = max(self._next_ns, stamp_ns)
        self._loop.note_hand(self._pipeline.hand_state, self._seconds(stamp_ns))
        if step.prediction is not None:
            self._loop.note_prediction(step.prediction, self._seconds(stamp_ns))
        self._hand_ns = stamp_ns
        return self._updates

    def _keep(self, output: GuidanceOutput, header: SampleHeader) -> None:
        self._updates.append((self._next_ns, output, header))

    def _seconds(self, stamp_ns: int) -> float:
        return (stamp_ns - self._first_ns) / NANOSECONDS  # since the epoch they would be rounded to a quarter of a microsecond


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


def replay_to(
    reader: BagReader,
    replay: Replay,
    consumers: Sequence[Callable[[Step], object]],
    guidance: GuidanceReplay | None = None,
    output: Path | None = None,
    predictions: TextIO | None = None,
    updates: TextIO | None = None,
) -> None:
    """Pass every step of a recording to consumers, and write what was predicted.

    output: new bag; predictions, updates: files for the elements of JSON lists of the predictions and of the updates of guidance.
    """
    types, plane = RosbagsTypes(TYPESTORE), replay.pipeline.config.plane
    with ExitStack() as stack:
        writer = None if output is None else stack.enter_context(BagWriter(output))
        for step in replay.steps(show_progress(reader, 'replay', reader.message_count)):
            for stamp_ns, guided, header in guidance.add(step) if guidance is not None else ():
                if updates is not None:
                    _write_element(updates, encode_guidance(stamp_ns, guided))
                if writer is not None:
                    for name, (_, encode) in GUIDANCE_OUTPUTS.items():
                        writer.write(f'{NODE}/{name}', encode(guided, header, types), step.item.log_ns)
            for consume in consumers:
                consume(step)
            if writer is not None:
                writer.copy(step.item, reader)
            if step.prediction is None:
                continue
            if predictions is not None:
                _write_element(predictions, encode_prediction(step.prediction))
            if writer is not None:
                for name, message in encode_outputs(step.prediction, plane, types).items():
                    writer.write(f'{NODE}/{name}', message, step.item.log_ns)


def _write_element(file: TextIO, element: object) -> None:
    file.write((',\n' if file.tell() else '\n') + json.dumps(element, allow_nan=False))


class Summary:
    """Counts over the steps of one replay, and the wall time of each prediction [s]."""

    def __init__(self) -> None:
        self.seconds: list[float] = []
        names = ('samples', 'predictions', 'solved', 'compromised', 'estimated', 'cleared_by_height')
        self.counts = Counter(dict.fromkeys(names, 0))

    def add(self, step: Step) -> None:
        """Count one step."""
        self.counts['samples'] += step.item.role == HAND
        if step.prediction is not None:
            likely = step.prediction.candidates_with_likelihood
            self.counts.update(
                predictions=1,
                solved=bool(likely),
                compromised=sum(each.status is Status.COMPROMISED for each in likely),
                estimated=sum(each.is_estimated for each in likely),
                cleared_by_height=sum(step.prediction.cleared),
            )
            self.seconds.append(step.prediction.solve_s)

    def answer(self, counts: Mapping[str, int], duration_s: float) -> dict[str, Any]:
        """Return all as plain values; counts: of the intake; duration_s: of the recording."""
        failures = Counter({name.removeprefix(FAILED): count for name, count in counts.items() if name.startswith(FAILED)})
        p50, p99 = (1e3 * np.percentile(self.seconds, (50, 99))).tolist() if self.seconds else (None, None)
        return {
            **self.counts,
            'refused': {name: count for name, count in sorted(counts.items()) if not name.startswith(FAILED)},
            'failures': dict(sorted(failures.items())),
            'prediction_ms': {'p50': p50, 'p99': p99},
            'duration_s': duration_s,
        }


def facts(answer: Mapping[str, Any]) -> dict[str, str]:
    """Return the answer of a summary in words, for a table or a report."""
    times, compromised, estimated = answer['prediction_ms'], answer['compromised'], answer['estimated']
    unsolved = {f'{name} ({Status(name).remedy})': count for name, count in answer['failures'].items() if count}
    return {
        'recording': f'{answer["duration_s"]:.1f} s',
        'hand poses': str(answer['samples']),
        'predictions': f'{answer["predictions"]}, {answer["solved"]} with a solved candidate',
        'rejected': _list_counts(answer['refused']),
        'candidates compromised': f'{compromised} ({Status.COMPROMISED.remedy})' if compromised else 'none',
        'candidates estimated': f'{estimated} (unlikely or late)' if estimated else 'none',
        'candidates not solved': _list_counts(unsolved),
        'obstacles cleared by height': f'{answer["cleared_by_height"]} over all predictions',
        **({'demonstrations learned': str(answer['learned'])} if 'learned' in answer else {}),
        'time per prediction': '-' if times['p50'] is None else f'{times["p50"]:.1f} ms median, {times["p99"]:.1f} ms p99',
    }


def _list_counts(counts: Mapping[str, int]) -> str:
    return ', '.join(f'{name} {count}' for name, count in counts.items()) or 'none'
