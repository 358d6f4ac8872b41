# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""What a replay leaves: predictions and guidance as JSON, an output bag, and a summary of counts and computing times."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import Any, TextIO

import numpy as np

from foc_ros.analysis.replay import GuidanceReplay, Replay, Step
from foc_ros.core.solution import Status
from foc_ros.io.bags import TYPESTORE, BagReader, BagWriter
from foc_ros.io.json_output import encode_guidance, encode_prediction
from foc_ros.io.terminal import show_progress
from foc_ros.io.topics import HAND
from foc_ros.ros.messages.encode_guidance import GUIDANCE_OUTPUTS
from foc_ros.ros.messages.encode_prediction import encode_outputs
from foc_ros.ros.messages.types import RosbagsTypes

NODE = '/foc'
"""Name of the node in the topics of the output bag."""
FAILED = 'candidate_'
"""The pipeline counts a candidate that was not solved under this prefix and its status."""


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

    output: new bag for the inputs and what a node would publish; predictions, updates: files for the elements of JSON lists of
    the predictions and of the updates of guidance.
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
