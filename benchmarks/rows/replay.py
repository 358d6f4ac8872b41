"""The packaged recording through the predictor, compared with the time that it took to record."""

from __future__ import annotations

from importlib.resources import files
from pathlib import Path

import numpy as np
from measurement import GAIN, Agreement, Result, Timing, at_least, compute_median_ms, time_in_turn

from foc_ros.analysis.replay import replay
from foc_ros.core.config import Config
from foc_ros.core.types import NANOSECONDS, Prediction


def measure_replay(is_quick: bool) -> Result:
    """Measure the replay at default parameters: 50 Hz, up to 4 classes."""
    recording = Path(str(files('foc_ros'))) / 'recordings' / 'reaching.mcap'
    answers: list[list[Prediction]] = []
    times = time_in_turn({'ours': lambda: answers.append(list(replay(recording, Config())))}, 1 if is_quick else 3)['ours']
    stamps = [each.stamp_ns for each in answers[0]]
    recorded_ms = (stamps[-1] - stamps[0]) / NANOSECONDS * 1e3
    is_same = all(_is_same(*pair) for pair in zip(answers[0], answers[-1], strict=True))
    ours_ms = compute_median_ms(times)
    return Result(
        Timing(f'replay of the packaged recording, {len(stamps)} predictions at 50 Hz', ours_ms),
        Timing('the time it took to record', recorded_ms),
        GAIN,
        Agreement(is_same, 'the first and the last replay are the same to the last bit' if is_same else 'two replays differ'),
        len(times),
        at_least(10.0),
        {'ms_per_prediction': ours_ms / len(stamps)},
    )


def _is_same(one: Prediction, other: Prediction) -> bool:
    """Return whether two predictions have the same candidates with the same paths."""
    return len(one.candidates) == len(other.candidates) and all(
        a.candidate.label == b.candidate.label and np.array_equal(a.solution.mean, b.solution.mean)
        for a, b in zip(one.candidates, other.candidates, strict=True)
    )
