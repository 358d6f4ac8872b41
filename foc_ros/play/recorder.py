"""The files of a session: one bag of everything, and a small bag of the inputs for each trial, as `fit` and `evaluate` want them.

DIR/2026-01-31_12-00-00/session      inputs and outputs of the whole session
DIR/2026-01-31_12-00-00/unguided/    trials without guidance: trial_001, trial_002, ...
DIR/2026-01-31_12-00-00/guided/      trials with guidance
"""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from datetime import datetime
from pathlib import Path

from foc_ros.core.errors import InputError, RecordingError
from foc_ros.io.bags import BagWriter
from foc_ros.io.topics import TYPES

SESSION, UNGUIDED, GUIDED = 'session', 'unguided', 'guided'
Entry = tuple[str, bytes, int]
"""Input, bytes and log time [ns] of a message."""


def make_session_folder(data: Path) -> Path:
    """Make a folder for a session, named by the time of day; raises InputError."""
    name = datetime.now().astimezone().strftime('%Y-%m-%d_%H-%M-%S')
    try:
        data.mkdir(parents=True, exist_ok=True)
        number = 1
        while (folder := data / (name if number == 1 else f'{name}_{number}')).exists():
            number += 1
        folder.mkdir()
    except OSError as error:
        raise InputError('--data', 'a folder that can be written', f'{data}: {error.strerror}') from error
    return folder


class Recorder:
    """Writes the bags of one session.

    Attributes: folder; trials, the number of recorded trials without and with guidance.

    Parameters
    ----------
    folder
        The folder of the session.
    scene
        The present message of `obstacles` and of `goals`, so that the bag has a scene before the first hand.
    now_ns
        Log time of these [ns].
    """

    def __init__(self, folder: Path, scene: Mapping[str, bytes], now_ns: int) -> None:
        self.folder = folder
        self.trials = {UNGUIDED: 0, GUIDED: 0}
        self._scene: dict[str, bytes] = {}
        self._trial: list[Entry] | None = None
        self._bag = BagWriter(folder / SESSION).__enter__()
        for role, raw in scene.items():
            self.add_input(role, raw, now_ns)

    def add_input(self, role: str, raw: bytes, now_ns: int) -> None:
        """Record a message to the predictor."""
        self._bag.write_raw(f'/{role}', TYPES[role], raw, now_ns)
        if role in ('obstacles', 'goals'):
            self._scene[role] = raw
        if self._trial is not None:
            self._trial.append((role, raw, now_ns))

    def add_output(self, topic: str, kind: str, raw: bytes, now_ns: int) -> None:
        """Record a message of the predictor."""
        self._bag.write_raw(topic, kind, raw, now_ns)

    def begin_trial(self, now_ns: int) -> None:
        """Record the inputs for a trial from now on."""
        self._trial = [(role, raw, now_ns) for role, raw in self._scene.items()]

    def end_trial(self, is_guided: bool) -> None:
        """Write the bag of the trial."""
        assert self._trial is not None
        kind = GUIDED if is_guided else UNGUIDED
        self.trials[kind] += 1
        (self.folder / kind).mkdir(exist_ok=True)
        with BagWriter(self.folder / kind / f'trial_{self.trials[kind]:03d}') as bag:
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
