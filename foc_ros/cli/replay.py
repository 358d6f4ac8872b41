"""`replay`: predictions from a recording, as numbers, as a bag to look at beside the recording, or as a report."""

from __future__ import annotations

import argparse
import json
import shutil
import sys
from collections.abc import Mapping
from contextlib import ExitStack
from pathlib import Path
from tempfile import TemporaryFile
from typing import Any, Protocol, TextIO

from foc_ros.analysis.learn_demonstrations import Learner
from foc_ros.analysis.replay import Replay, Step
from foc_ros.analysis.replay_summary import Summary, facts
from foc_ros.core.errors import InputError
from foc_ros.core.homotopy.demonstrations import Demonstration
from foc_ros.core.types import HandSample
from foc_ros.io.bags import TYPESTORE, BagReader, BagWriter
from foc_ros.io.class_library import load_library, save_library
from foc_ros.io.json_output import prediction_answer
from foc_ros.io.terminal import show_table, track
from foc_ros.ros.messages.outputs import output_messages
from foc_ros.ros.messages.types import RosbagsTypes
from foc_ros.ros.parameters import given_config

NODE = '/foc'
"""Name of the node whose topics the output bag has."""


class Sink(Protocol):
    """Whatever takes the steps of a replay."""

    def add(self, step: Step) -> None:
        """Take one step."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare what the command takes."""
    parser.add_argument('bag', type=Path, metavar='BAG', help='bag directory, or a .mcap or .db3 file')
    parser.add_argument('--output', type=Path, metavar='NEW_BAG', help='write inputs and predictions to a new bag')
    parser.add_argument('--report', type=Path, metavar='DIR', help='write a page with pictures')
    parser.add_argument('--params', type=Path, metavar='YAML', help="the node's parameter file")
    parser.add_argument(
        '--learn', type=Path, metavar='FILE', help='add the ways demonstrated to a class library, for homotopy.library'
    )
    parser.add_argument('--json', action='store_true', help='print one JSON object')
    words = 'take an input from a topic, as in hand_pose:=/PSM1/measured_cp (default: by name, else by type)'
    parser.add_argument('--remap', action='append', default=[], metavar='INPUT:=TOPIC', help=words)


def run(arguments: argparse.Namespace) -> int:
    """Replay; 3 where no prediction has a solved candidate."""
    replayed, summary = Replay(given_config(arguments.params)), Summary()
    report = None if arguments.report is None else Report()
    learner = None if arguments.learn is None else Learner(replayed.pipeline, _known(arguments.learn))
    with TemporaryFile('w+', encoding='utf-8') as answers:
        sinks: list[Sink] = [
            summary,
            *([Answers(answers)] if arguments.json else []),
            *([report] if report else []),
            *([learner] if learner else []),
        ]
        duration_s = _play(arguments, replayed, sinks)
        answer = summary.answer(replayed.intake.counts, duration_s)
        if learner is not None:
            learner.finish()
            save_library(arguments.learn, learner.ways)
            answer['learned'] = learner.learned
        if report is not None:
            report.write(arguments.report, arguments.bag.resolve().name, facts(answer))
        if arguments.json:
            _print_json(answer, answers)
        else:
            show_table(('', str(arguments.bag)), facts(answer).items())
    if summary.solved:
        return 0
    reason = replayed.pipeline.blocked() or replayed.intake.last_refusal or 'see the candidates not solved'
    print(f'foc_ros replay: no prediction has a solved candidate: {reason}', file=sys.stderr)
    return 3


def _play(arguments: argparse.Namespace, replayed: Replay, sinks: list[Sink]) -> float:
    """Hand every step to the sinks, and to the output bag where one is wanted; return the recording's duration [s]."""
    with ExitStack() as stack:
        reader = stack.enter_context(BagReader(arguments.bag, _chosen(arguments.remap)))
        if arguments.output is not None:
            writer = stack.enter_context(BagWriter(arguments.output))
            sinks = [*sinks, OutputBag(reader, writer, replayed.pipeline.config.plane)]
        for step in replayed.steps(track(reader, 'replay', reader.message_count)):
            for sink in sinks:
                sink.add(step)
        return reader.duration_s


def _print_json(answer: Mapping[str, Any], answers: TextIO) -> None:
    print(f'{{"summary": {json.dumps(answer)}, "predictions": [', end='')
    answers.seek(0)
    shutil.copyfileobj(answers, sys.stdout)
    print(']}')


class OutputBag:
    """The inputs as they were, and beside each hand pose what a node would have published for it."""

    def __init__(self, reader: BagReader, writer: BagWriter, plane: str) -> None:
        self._reader, self._writer, self._plane = reader, writer, plane
        self._types = RosbagsTypes(TYPESTORE)

    def add(self, step: Step) -> None:
        """Write one step."""
        item, prediction = step.item, step.prediction
        self._writer.copy(item, self._reader)
        if prediction is not None:
            obstacles = step.scene.obstacles(prediction.stamp_ns)
            for name, message in output_messages(prediction, obstacles, self._plane, self._types).items():
                self._writer.write(f'{NODE}/{name}', message, item.log_ns)


class Answers:
    """The predictions as elements of a JSON list, in a file until it is known that the recording is sound to its end."""

    def __init__(self, file: TextIO) -> None:
        self._file = file

    def add(self, step: Step) -> None:
        """Write one step's prediction."""
        if step.prediction is not None:
            separator = ',\n' if self._file.tell() else '\n'
            self._file.write(separator + json.dumps(prediction_answer(step.prediction), allow_nan=False))


class Report:
    """What the report's pictures are made of."""

    def __init__(self) -> None:
        from foc_ros.reporting import report  # noqa: F401 (a missing library is told before the work, not after it)
        from foc_ros.reporting.snapshots import Snapshot, snapshot_of_prediction

        self._moment_of = snapshot_of_prediction
        self._samples: list[HandSample] = []
        self._moments: list[Snapshot] = []

    def add(self, step: Step) -> None:
        """Keep one step."""
        if step.sample is not None:
            self._samples.append(step.sample)
        if step.prediction is not None and step.scene.goals is not None:
            obstacles = step.scene.obstacles(step.prediction.stamp_ns)
            self._moments.append(self._moment_of(step.prediction, obstacles, step.scene.goals))

    def write(self, directory: Path, title: str, words: dict[str, str]) -> None:
        """Write the report."""
        from foc_ros.reporting.report import write_report
        from foc_ros.reporting.snapshots import track_of

        write_report(directory, title, track_of(self._samples), self._moments, words)


def _known(file: Path) -> tuple[Demonstration, ...]:
    return load_library(str(file)) if file.exists() else ()


def _chosen(remaps: list[str]) -> dict[str, str]:
    chosen: dict[str, str] = {}
    for remap in remaps:
        role, separator, topic = remap.partition(':=')
        if not separator or not topic or role in chosen:
            raise InputError('--remap', 'INPUT:=TOPIC, once for an input', remap)
        chosen[role] = topic
    return chosen
