"""The recording of a session: a bag, a bag for each trial, and what the report will show of it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from time import time_ns

from foc_ros.core.config import Config
from foc_ros.core.errors import RecordingError
from foc_ros.ros.parameters import write_parameter_file

from . import jobs
from .predictors import KINDS
from .recorder import Recorder, make_session_folder
from .scene import PlayScene, Point
from .session_report import SessionReport


class SessionRecording:
    """Takes inputs and outputs while it runs, and ignores them otherwise.

    Parameters
    ----------
    data
        The folder for the folders of sessions.
    note_lost
        Called when a recording cannot be written; it has ended then.
    """

    def __init__(self, data: Path, note_lost: Callable[[RecordingError], None]) -> None:
        self._data, self._note_lost = data, note_lost
        self._recorder: Recorder | None = None
        self._report = SessionReport()

    @property
    def is_running(self) -> bool:
        """Whether there is a recording."""
        return self._recorder is not None

    def begin(self, config: Config, messages: Mapping[str, bytes]) -> tuple[Path, SessionReport]:
        """Begin a recording with parameters and the scene, bytes by input; return its folder and what collects its report."""
        folder = make_session_folder(self._data)
        write_parameter_file('--data', folder / jobs.PARAMETERS, config)
        self._recorder, self._report = Recorder(folder, messages, time_ns()), SessionReport()
        return folder, self._report

    def end(self) -> None:
        """End the recording, if there is one."""
        if self._recorder is not None:
            recorder, self._recorder = self._recorder, None
            recorder.close()

    def add_hand(self, stamp_ns: int, position: Point) -> None:
        """Add a hand sample to the report."""
        if self._recorder is not None:
            self._report.add_hand(stamp_ns, position)

    def add_input(self, role: str, raw: bytes) -> None:
        """Add a message of an input."""
        self._add(lambda recorder: recorder.add_input(role, raw, time_ns()))

    def add_output(self, topic: str, raw: bytes, scene: PlayScene) -> None:
        """Add a message of an output; scene: the present one."""
        if self._recorder is not None:
            self._report.add_output(topic, raw, scene, time_ns())
        self._add(lambda recorder: recorder.add_output(topic, KINDS[topic], raw, time_ns()))

    def begin_trial(self) -> None:
        """Begin the bag of a trial."""
        self._add(lambda recorder: recorder.begin_trial(time_ns()))

    def end_trial(self, is_guided: bool) -> None:
        """End the bag of a trial."""
        self._add(lambda recorder: recorder.end_trial(is_guided))

    def _add(self, add: Callable[[Recorder], None]) -> None:
        if self._recorder is None:
            return
        try:
            add(self._recorder)
        except RecordingError as error:
            recorder, self._recorder = self._recorder, None
            recorder.discard(error)
            self._note_lost(error)
