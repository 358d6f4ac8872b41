"""An evaluation as plain values, for JSON."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, is_dataclass
from typing import Any

from foc_ros.core.config import Config, flatten

from .evaluation import Evaluation
from .observations import Observations
from .scores import summary


def answer_of(
    evaluation: Evaluation,
    recordings: Sequence[Observations],
    config: Config,
    failed: Mapping[str, str],
    labels: Mapping[str, str],
) -> dict[str, Any]:
    """Return all as plain values.

    failed: reason by recording; labels: disagreement by recording. Under `questions`, by question and predictor: the scores of
    `scores.summary`; for `gap`, tenths and `right_from_half_way` count from row to row, for the others over the whole movement.
    """
    return {
        'recordings': len(recordings),
        'predictions': sum(len(recording.each) for recording in recordings),
        'failed': dict(failed),
        'labels_not_taken': dict(labels),
        'questions': {
            name: {predictor: summary(judged) for predictor, judged in by_predictor.items()}
            for name, by_predictor in evaluation.judged.items()
        },
        'settings': {
            question: {name: _plain(setting) for name, setting in by_predictor.items()}
            for question, by_predictor in evaluation.settings.items()
        },
        'positions': dict(evaluation.positions),
        'parameters': flatten(config),
    }


def _plain(setting: Any) -> Any:
    return asdict(setting) if is_dataclass(setting) and not isinstance(setting, type) else setting
