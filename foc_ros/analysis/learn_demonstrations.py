"""Demonstrations in a recording: what a node with `experience.learning` would have learnt while it was made."""

from __future__ import annotations

from collections.abc import Mapping

from foc_ros.core.classes.library import Demonstration
from foc_ros.core.config import ONLINE, Config
from foc_ros.core.errors import FocError, RecordingError, warn
from foc_ros.io.terminal import show_progress

from .recordings import Recording
from .replay import Replay


def learn_recording(recording: Recording, config: Config) -> tuple[Demonstration, ...]:
    """Return the movements of a recording that end at a goal (`foc_ros.core.learning.movements`), at most the last `MOST_LEARNT`.

    Raises RecordingError where the recording cannot be read or contains none.
    """
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


def learn_recordings(recordings: Mapping[str, Recording], config: Config) -> tuple[list[Demonstration], dict[str, str]]:
    """Return the movements of all recordings, with a progress bar, and why recordings could not be used, by name."""
    learnt, failed = list[Demonstration](), dict[str, str]()
    for name, recording in show_progress(recordings.items(), 'learn', len(recordings)):
        try:
            learnt.extend(learn_recording(recording, config))
        except FocError as error:
            failed[name] = str(error)
    return learnt, failed
