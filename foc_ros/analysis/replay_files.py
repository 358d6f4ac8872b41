"""A recording through the predictor, and the files that this leaves: predictions and guidance as JSON, and a bag."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import TextIO

from foc_ros.io.bags import TYPESTORE, BagReader, BagWriter
from foc_ros.io.json_output import encode_guidance, encode_prediction
from foc_ros.io.terminal import show_progress
from foc_ros.ros.messages.encode_guidance import GUIDANCE_OUTPUTS
from foc_ros.ros.messages.encode_prediction import encode_outputs
from foc_ros.ros.messages.types import RosbagsTypes

from .replay import Replay, Step
from .replay_guidance import GuidanceReplay, GuidanceStep

NODE = '/foc'
"""Name of the node in the topics of the output bag."""
Consumer = Callable[[Step], object]
"""Function that receives every step of a replay."""
GuidanceConsumer = Callable[[Step, GuidanceStep], None]
"""Function that receives every update of guidance, with the step before which it happens."""


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
