# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The movements of recordings that end at a goal, as demonstrations for a class library."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial

from foc_ros.analysis.parallel import collect
from foc_ros.analysis.recordings import Recording
from foc_ros.analysis.replay import Replay
from foc_ros.core.classes.library import Demonstration
from foc_ros.core.config import ONLINE, Config
from foc_ros.core.errors import RecordingError, warn


def learn_recordings(recordings: Mapping[str, Recording], config: Config) -> tuple[list[Demonstration], dict[str, str]]:
    """Return the movements of all recordings, with a progress bar, and why recordings could not be used, by name."""
    learnt, failed = collect(partial(learn_recording, config=config), list(recordings.items()), 'learn')
    return [each for movements in learnt for each in movements], failed


def learn_recording(recording: Recording, config: Config) -> tuple[Demonstration, ...]:
    """Return the movements of a recording that end at a goal (`foc_ros.core.learning.movements`), the last ones.

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
        warn(losses)
    return movements.learnt
