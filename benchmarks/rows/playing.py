"""The packaged recording through the predictor, against the time it took to record."""

from __future__ import annotations

import time
from importlib.resources import files
from pathlib import Path

import numpy as np
from measure import median_ms
from results import Result, at_least

from foc_ros.analysis.replay import replay as predictions_of
from foc_ros.core.config import Config
from foc_ros.core.types import NANOSECONDS, Prediction


def replay(quick: bool) -> Result:
    """Measure the replay at default parameters: 50 Hz, up to 4 classes."""
    recording, repetitions = Path(str(files('foc_ros'))) / 'recordings' / 'reaching.mcap', (1 if quick else 3)
    times: list[float] = []
    answers: list[list[Prediction]] = []
    for _ in range(max(repetitions, 2)):
        began = time.perf_counter()
        answers.append(list(predictions_of(recording, Config())))
        times.append(time.perf_counter() - began)
    stamps = [each.stamp_ns for each in answers[0]]
    recorded_ms = (stamps[-1] - stamps[0]) / NANOSECONDS * 1e3
    ours_ms = median_ms(times)
    same = all(_same(*pair) for pair in zip(answers[0], answers[-1], strict=True))
    return Result(
        'replay',
        f'replay of the packaged recording, {len(stamps)} predictions at 50 Hz',
        'the time it took to record',
        ours_ms,
        recorded_ms,
        recorded_ms / ours_ms,
        'peer / ours',
        same,
        'the first and the last replay are the same to the last bit' if same else 'two replays differ',
        len(times),
        at_least(10.0),
        {'ms_per_prediction': ours_ms / len(stamps)},
    )


def _same(one: Prediction, other: Prediction) -> bool:
    """Return whether two predictions have the same ways with the same paths."""
    return len(one.candidates) == len(other.candidates) and all(
        a.candidate.label == b.candidate.label and np.array_equal(a.solution.mean, b.solution.mean)
        for a, b in zip(one.candidates, other.candidates, strict=True)
    )
