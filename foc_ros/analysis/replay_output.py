"""What a replay leaves: predictions and guidance as JSON, an output bag, and a summary of counts and computing times."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TextIO

import numpy as np

from foc_ros.analysis.replay import GuidanceReplay, GuidanceStep, Replay, Step
from foc_ros.core.types import Status
from foc_ros.io.bags import TYPESTORE, BagReader, BagWriter
from foc_ros.io.json_output import encode_guidance, encode_prediction
from foc_ros.io.terminal import show_progress
from foc_ros.io.topics import HAND
from foc_ros.ros.messages.encode_guidance import GUIDANCE_OUTPUTS
from foc_ros.ros.messages.encode_prediction import encode_outputs
from foc_ros.ros.messages.types import RosbagsTypes

NODE = '/foc'
"""Name of the node in the topics of the output bag."""
Consumer = Callable[[Step], object]
"""Function that receives every step of a replay."""
GuidanceConsumer = Callable[[Step, GuidanceStep], None]
"""Function that receives every update of guidance, with the step before which it happens."""
FAILED = 'candidate_'
"""The pipeline counts a candidate that was not solved under this prefix and its status."""


def write_steps(reader: BagReader, writer: BagWriter, plane: str) -> Consumer:
    """Return a consumer that copies the inputs to a bag and writes what a node would publish for each hand pose."""
    types = RosbagsTypes(TYPESTORE)

    def write(step: Step) -> None:
        writer.copy(step.item, reader)
        if step.prediction is not None:
            for name, message in encode_outputs(step.prediction, step.prediction.obstacles, plane, types).items():
                writer.write(f'{NODE}/{name}', message, step.item.log_ns)

    return write


def write_guidance(writer: BagWriter) -> GuidanceConsumer:
    """Return a consumer that writes to a bag what a node would publish for each update of guidance."""
    types = RosbagsTypes(TYPESTORE)

    def write(step: Step, update: GuidanceStep) -> None:
        for name, (_, encode) in GUIDANCE_OUTPUTS.items():
            writer.write(f'{NODE}/{name}', encode(update.output, update.place, types), step.item.log_ns)

    return write


def list_steps(file: TextIO) -> Consumer:
    """Return a consumer that writes the predictions as the elements of a JSON list."""

    def write(step: Step) -> None:
        if step.prediction is not None:
            _write_element(file, encode_prediction(step.prediction))

    return write


def list_guidance(file: TextIO) -> GuidanceConsumer:
    """Return a consumer that writes the updates of guidance as the elements of a JSON list."""

    def write(_: Step, update: GuidanceStep) -> None:
        _write_element(file, encode_guidance(update.stamp_ns, update.output))

    return write


def _write_element(file: TextIO, element: object) -> None:
    file.write((',\n' if file.tell() else '\n') + json.dumps(element, allow_nan=False))


def replay_to(
    output: Path | None,
    reader: BagReader,
    replay: Replay,
    guidance: GuidanceReplay | None,
    consumers: Sequence[Consumer],
    guided: Sequence[GuidanceConsumer],
) -> None:
    """Pass every step and every update of guidance to the consumers, and to the output bag if there is to be one."""
    with ExitStack() as stack:
        if output is not None:
            writer = stack.enter_context(BagWriter(output))
            consumers = [*consumers, write_steps(reader, writer, replay.pipeline.config.plane)]
            guided = [*guided, write_guidance(writer)]
        for step in replay.steps(show_progress(reader, 'replay', reader.message_count)):
            for update in guidance.add(step) if guidance is not None else ():
                for take in guided:
                    take(step, update)
            for consume in consumers:
                consume(step)


@dataclass
class Summary:
    """Counts over the steps of one replay.

    samples: hand poses read; predictions; solved: predictions with a candidate that has a likelihood; compromised, estimated:
    candidates with a likelihood; cleared_by_height: obstacles that a predicted height cleared, over all predictions; seconds:
    wall time of each prediction.
    """

    samples: int = 0
    predictions: int = 0
    solved: int = 0
    compromised: int = 0
    estimated: int = 0
    cleared_by_height: int = 0
    seconds: list[float] = field(default_factory=list)

    def add(self, step: Step) -> None:
        """Count one step."""
        self.samples += step.item.role == HAND
        if step.prediction is not None:
            self.predictions += 1
            self.solved += bool(step.prediction.candidates_with_likelihood)
            for each in step.prediction.candidates_with_likelihood:
                self.compromised += each.status is Status.COMPROMISED
                self.estimated += each.is_estimated
            self.cleared_by_height += sum(step.prediction.cleared)
            self.seconds.append(step.prediction.solve_s)

    def answer(self, counts: Mapping[str, int], duration_s: float) -> dict[str, Any]:
        """Return all as plain values; counts: of the intake; duration_s: of the recording.

        refused: rejected messages, samples and predictions, and restarts, by kind; failures: candidates by status.
        """
        failures = Counter({name.removeprefix(FAILED): count for name, count in counts.items() if name.startswith(FAILED)})
        p50, p99 = (1e3 * np.percentile(self.seconds, (50, 99))).tolist() if self.seconds else (None, None)
        return {
            'samples': self.samples,
            'predictions': self.predictions,
            'solved': self.solved,
            'refused': {name: count for name, count in sorted(counts.items()) if not name.startswith(FAILED)},
            'compromised': self.compromised,
            'estimated': self.estimated,
            'failures': dict(sorted(failures.items())),
            'cleared_by_height': self.cleared_by_height,
            'prediction_ms': {'p50': p50, 'p99': p99},
            'duration_s': duration_s,
        }


def facts(answer: Mapping[str, Any]) -> dict[str, str]:
    """Return the answer of a summary in words, for a table or a report."""
    times = answer['prediction_ms']
    return {
        'recording': f'{answer["duration_s"]:.1f} s',
        'hand poses': str(answer['samples']),
        'predictions': f'{answer["predictions"]}, {answer["solved"]} with a solved candidate',
        'rejected': _list_counts(answer['refused']),
        'candidates compromised': _list_failures({Status.COMPROMISED.value: answer['compromised']}),
        'candidates estimated': _list_counts({'unlikely or late': answer['estimated']} if answer['estimated'] else {}),
        'candidates not solved': _list_failures(answer['failures']),
        'obstacles cleared by height': f'{answer["cleared_by_height"]} over all predictions',
        **({'demonstrations learned': str(answer['learned'])} if 'learned' in answer else {}),
        'time per prediction': '-' if times['p50'] is None else f'{times["p50"]:.1f} ms median, {times["p99"]:.1f} ms p99',
    }


def _list_failures(counts: Mapping[str, int]) -> str:
    """Return counts by status, each with its remedy."""
    return _list_counts({f'{name} ({Status(name).remedy})': count for name, count in counts.items() if count})


def _list_counts(counts: Mapping[str, int]) -> str:
    return ', '.join(f'{name} {count}' for name, count in counts.items()) or 'none'
