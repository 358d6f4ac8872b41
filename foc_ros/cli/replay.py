"""`replay`: predictions from a recording as JSON, as a bag to be shown beside the recording, or as a report."""

from __future__ import annotations

import argparse
import json
import shutil
import sys
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path
from tempfile import TemporaryFile
from typing import TextIO

from foc_ros.analysis.replay import Replay, Step
from foc_ros.analysis.replay_guidance import GuidanceReplay, GuidanceStep
from foc_ros.analysis.replay_summary import Summary, facts
from foc_ros.core.config import ONLINE, Config
from foc_ros.io.bags import TYPESTORE, BagReader, BagWriter
from foc_ros.io.class_library import extend_library
from foc_ros.io.json_output import encode_guidance, encode_prediction
from foc_ros.io.terminal import show_address, show_progress, show_table
from foc_ros.ros.messages.encode_guidance import GUIDANCE_OUTPUTS
from foc_ros.ros.messages.encode_prediction import encode_outputs
from foc_ros.ros.messages.types import RosbagsTypes
from foc_ros.ros.parameters import write_parameter_file

NODE = '/foc'
"""Name of the node in the topics of the output bag."""
Consumer = Callable[[Step], None]
"""Function that receives every step of a replay."""
GuidanceConsumer = Callable[[Step, GuidanceStep], None]
"""Function that receives every update of guidance, with the step before which it happens."""


def run(arguments: argparse.Namespace) -> int:
    """Replay the recording; return 3 if no prediction has a solved candidate."""
    config = arguments.config if arguments.learn is None else _prepare_learning(arguments.config, arguments.learn)
    replay, summary = Replay(config), Summary()
    consumers: list[Consumer] = [summary.add]
    report = None
    if arguments.report is not None:
        from foc_ros.reporting.report import ReportCollector  # a missing library is reported before the work

        report = ReportCollector()
        consumers.append(report.add)
    # The answers wait in files: nothing is printed of a recording that turns out to be damaged.
    with TemporaryFile('w+', encoding='utf-8') as predictions, TemporaryFile('w+', encoding='utf-8') as guidance:
        guided = [_guidance_writer(guidance)] if arguments.guidance and arguments.json else []
        if arguments.json:
            consumers.append(_json_writer(predictions))
        duration_s = _play(arguments, replay, consumers, guided)
        answer = summary.answer(replay.intake.counts, duration_s)
        if arguments.learn is not None:
            answer['learned'] = extend_library(arguments.learn, replay.pipeline.learnt.movements.finish().learnt)
        if arguments.operator is not None:
            write_parameter_file('--operator', arguments.operator, replay.pipeline.adapted_config)
        if report is not None:
            report.write(arguments.report, arguments.bag.resolve().name, facts(answer))
        if arguments.json:
            print(f'{{"summary": {json.dumps(answer)}, "predictions": [', end='')
            predictions.seek(0)
            shutil.copyfileobj(predictions, sys.stdout)
            if arguments.guidance:
                print('], "guidance": [', end='')
                guidance.seek(0)
                shutil.copyfileobj(guidance, sys.stdout)
            print(']}')
        else:
            show_table(('', str(arguments.bag)), facts(answer).items())
            if report is not None:
                show_address(arguments.report / 'index.html')
    losses = list(filter(None, [replay.describe_losses(), replay.intake.describe_still_hand()]))
    if summary.solved:
        for each in losses:
            print(f'foc_ros replay: {each}', file=sys.stderr)
        return 0
    reason = '; '.join([*losses, replay.pipeline.not_ready_reason() or 'see the candidates not solved'])
    print(f'foc_ros replay: no prediction has a solved candidate: {reason}', file=sys.stderr)
    return 3


def _prepare_learning(config: Config, library: Path) -> Config:
    """Return the config with which movements are learnt, in addition to those in a class library that exists."""
    given = {'homotopy.library': str(library)} if library.exists() else {}
    return config.with_values({'experience.learning': ONLINE, **given})


def _play(arguments: argparse.Namespace, replay: Replay, consumers: list[Consumer], guided: list[GuidanceConsumer]) -> float:
    """Pass every step to the consumers and to the output bag, if there is one; return the recording's duration [s]."""
    with ExitStack() as stack:
        reader = stack.enter_context(BagReader(arguments.bag, dict(arguments.remap)))
        if arguments.output is not None:
            writer = stack.enter_context(BagWriter(arguments.output))
            consumers = [*consumers, _bag_writer(reader, writer, replay.pipeline.config.plane)]
            guided = [*guided, _guidance_bag_writer(writer)]
        guidance = GuidanceReplay(replay.pipeline) if arguments.guidance else None
        for step in replay.steps(show_progress(reader, 'replay', reader.message_count)):
            for each in guidance.add(step) if guidance is not None else ():
                for take in guided:
                    take(step, each)
            for consume in consumers:
                consume(step)
        return reader.duration_s


def _bag_writer(reader: BagReader, writer: BagWriter, plane: str) -> Consumer:
    """Return a consumer that copies the inputs and writes what a node would publish for each hand pose."""
    types = RosbagsTypes(TYPESTORE)

    def write(step: Step) -> None:
        writer.copy(step.item, reader)
        if step.prediction is not None:
            for name, message in encode_outputs(step.prediction, step.prediction.obstacles, plane, types).items():
                writer.write(f'{NODE}/{name}', message, step.item.log_ns)

    return write


def _guidance_bag_writer(writer: BagWriter) -> GuidanceConsumer:
    """Return a consumer that writes what a node would publish for each update of guidance."""
    types = RosbagsTypes(TYPESTORE)

    def write(step: Step, update: GuidanceStep) -> None:
        for name, (_, encode) in GUIDANCE_OUTPUTS.items():
            writer.write(f'{NODE}/{name}', encode(update.output, update.place, types), step.item.log_ns)

    return write


def _guidance_writer(file: TextIO) -> GuidanceConsumer:
    """Return a consumer that writes the updates of guidance as the elements of a JSON list."""

    def write(_: Step, update: GuidanceStep) -> None:
        separator = ',\n' if file.tell() else '\n'
        file.write(separator + json.dumps(encode_guidance(update.stamp_ns, update.output), allow_nan=False))

    return write


def _json_writer(file: TextIO) -> Consumer:
    """Return a consumer that writes the predictions as the elements of a JSON list."""

    def write(step: Step) -> None:
        if step.prediction is not None:
            separator = ',\n' if file.tell() else '\n'
            file.write(separator + json.dumps(encode_prediction(step.prediction), allow_nan=False))

    return write
