# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The recording of a session: its files, and its report.

DIR/2026-01-31_12-00-00/parameters.yaml   what it began with
DIR/2026-01-31_12-00-00/session           inputs and outputs of the whole session
DIR/2026-01-31_12-00-00/unguided/         trials without guidance: trial_001, trial_002, ...; `fit` and `evaluate` read them
DIR/2026-01-31_12-00-00/guided/           trials with guidance
"""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from datetime import datetime
from pathlib import Path
from time import time_ns
from typing import Any

import numpy as np

from foc_ros.core.config import Config
from foc_ros.core.errors import RecordingError
from foc_ros.core.guidance.guide import GuidanceOutput
from foc_ros.core.prediction import Prediction
from foc_ros.core.types import NANOSECONDS, HandSample, as_readonly
from foc_ros.io.bags import TYPESTORE, BagWriter
from foc_ros.io.outputs import make_folder
from foc_ros.io.topics import TYPES
from foc_ros.reporting.page import Table
from foc_ros.reporting.report import ReportCollector
from foc_ros.reporting.views import build_snapshot
from foc_ros.ros.messages.encode_guidance import GUIDANCE_OUTPUTS, SampleHeader
from foc_ros.ros.messages.encode_prediction import encode_outputs
from foc_ros.ros.messages.types import MessageTypes
from foc_ros.ros.parameters import write_parameter_file

from .scene import FRAME, Point

SESSION, UNGUIDED, GUIDED = 'session', 'unguided', 'guided'
PARAMETERS, OPERATOR = 'parameters.yaml', 'operator.yaml'
"""Files of a session: the parameters that it began with, and those that were fitted to it."""


class Recording:
    """Writes the bags of one session, and keeps what its report shows.

    data: the folder for the folders of sessions; config: the parameters at the beginning; scene: the present messages of
    `obstacles` and `goals`, so that the bag has a scene before the first hand; types: makes the messages of the outputs.
    Attributes: folder; scores, a table of the report, None before tasks have ended.
    """

    def __init__(self, data: Path, config: Config, scene: Mapping[str, Any], types: MessageTypes) -> None:
        name, number = datetime.now().astimezone().strftime('%Y-%m-%d_%H-%M-%S'), 1
        with make_folder('--data', data):
            while (folder := data / (name if number == 1 else f'{name}_{number}')).exists():
                number += 1
            folder.mkdir()
        self.folder = folder
        self.scores: Table | None = None
        self._types, self._scene = types, dict[str, bytes]()
        self._trial: list[tuple[str, bytes, int]] | None = None
        self._trials = {UNGUIDED: 0, GUIDED: 0}
        self._shown = ReportCollector(config)
        write_parameter_file('--data', self.folder / PARAMETERS, config)
        self._bag = BagWriter(self.folder / SESSION).__enter__()
        for role, message in scene.items():
            self.add_input(role, message)

    @property
    def has_unguided(self) -> bool:
        """Whether there are trials without guidance, which a fit and its comparison need."""
        return self._trials[UNGUIDED] > 0

    def add_hand(self, stamp_ns: int, position: Point) -> None:
        """Keep a hand sample for the report."""
        self._shown.samples.append(HandSample(stamp_ns, as_readonly(np.array(position)), 0.0, FRAME))

    def add_input(self, role: str, message: Any) -> None:
        """Record a message to the predictor."""
        now_ns, raw = time_ns(), bytes(TYPESTORE.serialize_cdr(message, TYPES[role]))
        self._bag.write_raw(f'/{role}', TYPES[role], raw, now_ns)
        if role in ('obstacles', 'goals'):
            self._scene[role] = raw
        if self._trial is not None:
            self._trial.append((role, raw, now_ns))

    def add_prediction(self, prediction: Prediction) -> None:
        """Record a prediction, and keep a snapshot of it for the report."""
        # at 20 Hz: the page of an hour would be too large otherwise
        shown = self._shown.snapshots
        if not shown or prediction.stamp_ns - shown[-1].stamp_ns >= NANOSECONDS // 20:
            shown.append(build_snapshot(prediction))
        # markers and path say nothing more
        self._add_outputs(encode_outputs(prediction, 'xy', self._types, ('prediction', 'likelihoods')))

    def add_guidance(self, output: GuidanceOutput, header: SampleHeader) -> None:
        """Record guidance."""
        self._add_outputs({name: encode(output, header, self._types) for name, (_, encode) in GUIDANCE_OUTPUTS.items()})

    def begin_trial(self) -> None:
        """Record the inputs for a trial from now on."""
        self._trial = [(role, raw, time_ns()) for role, raw in self._scene.items()]

    def end_trial(self, is_guided: bool) -> None:
        """Write the bag of the trial."""
        assert self._trial is not None
        kind = GUIDED if is_guided else UNGUIDED
        self._trials[kind] += 1
        (self.folder / kind).mkdir(exist_ok=True)
        with BagWriter(self.folder / kind / f'trial_{self._trials[kind]:03d}') as bag:
            for role, raw, log_ns in self._trial:
                bag.write_raw(f'/{role}', TYPES[role], raw, log_ns)
        self._trial = None

    def discard(self, error: RecordingError) -> None:
        """Remove the bag of the session, after an error in writing; the bags of trials stay."""
        with suppress(RecordingError):
            self._bag.__exit__(type(error), error, None)

    def close(self) -> None:
        """End the session; a trial that is not over has no bag of its own."""
        self._bag.__exit__(None, None, None)

    def write_report(self) -> Path:
        """Write the report and return its page; raises InputError where that is impossible."""
        tables = [] if self.scores is None else [self.scores]
        return self._shown.write(self.folder / 'report', f'Session {self.folder.name}', {}, tables)

    def _add_outputs(self, messages: Mapping[str, Any]) -> None:
        for name, message in messages.items():
            self._bag.write(f'/foc/{name}', message, time_ns())
