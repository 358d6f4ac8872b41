"""The summary of a replay: counts of predictions, rejections and failures, and computing times."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from foc_ros.core.types import Status
from foc_ros.io.topics import HAND

from .replay import Step

FAILED = 'candidate_'
"""The pipeline counts a candidate that was not solved under this prefix and its status."""


@dataclass
class Summary:
    """Counts over the steps of one replay.

    samples: hand poses read; predictions; solved: predictions with a candidate that has a likelihood; compromised, estimated:
    candidates with a likelihood; cleared_by_height: obstacles that a predicted height cleared, over all predictions; seconds:
    wall time of each prediction.
    """

    samples: int = 0
    predictions: int = 0
    solved: int = 0
    compromised: int = 0
    estimated: int = 0
    cleared_by_height: int = 0
    seconds: list[float] = field(default_factory=list)

    def add(self, step: Step) -> None:
        """Count one step."""
        self.samples += step.item.role == HAND
        if step.prediction is not None:
            self.predictions += 1
            self.solved += bool(step.prediction.candidates_with_likelihood)
            for each in step.prediction.candidates_with_likelihood:
                self.compromised += each.status is Status.COMPROMISED
                self.estimated += each.is_estimated
            self.cleared_by_height += sum(step.prediction.cleared)
            self.seconds.append(step.prediction.solve_s)

    def answer(self, counts: Mapping[str, int], duration_s: float) -> dict[str, Any]:
        """Return all as plain values; counts: of the intake; duration_s: of the recording.

        refused: rejected messages, samples and predictions, and restarts, by kind; failures: candidates by status.
        """
        failures = Counter({name.removeprefix(FAILED): count for name, count in counts.items() if name.startswith(FAILED)})
        p50, p99 = (1e3 * np.percentile(self.seconds, (50, 99))).tolist() if self.seconds else (None, None)
        return {
            'samples': self.samples,
            'predictions': self.predictions,
            'solved': self.solved,
            'refused': {name: count for name, count in sorted(counts.items()) if not name.startswith(FAILED)},
            'compromised': self.compromised,
            'estimated': self.estimated,
            'failures': dict(sorted(failures.items())),
            'cleared_by_height': self.cleared_by_height,
            'prediction_ms': {'p50': p50, 'p99': p99},
            'duration_s': duration_s,
        }


def facts(answer: Mapping[str, Any]) -> dict[str, str]:
    """Return the answer of a summary in words, for a table or a report."""
    times = answer['prediction_ms']
    return {
        'recording': f'{answer["duration_s"]:.1f} s',
        'hand poses': str(answer['samples']),
        'predictions': f'{answer["predictions"]}, {answer["solved"]} with a solved candidate',
        'rejected': _list_counts(answer['refused']),
        'candidates compromised': _list_failures({Status.COMPROMISED.value: answer['compromised']}),
        'candidates estimated': _list_counts({'unlikely or late': answer['estimated']} if answer['estimated'] else {}),
        'candidates not solved': _list_failures(answer['failures']),
        'obstacles cleared by height': f'{answer["cleared_by_height"]} over all predictions',
        **({'demonstrations learned': str(answer['learned'])} if 'learned' in answer else {}),
        'time per prediction': '-' if times['p50'] is None else f'{times["p50"]:.1f} ms median, {times["p99"]:.1f} ms p99',
    }


def _list_failures(counts: Mapping[str, int]) -> str:
    """Return counts by status, each with its remedy."""
    return _list_counts({f'{name} ({Status(name).remedy})': count for name, count in counts.items() if count})


def _list_counts(counts: Mapping[str, int]) -> str:
    return ', '.join(f'{name} {count}' for name, count in counts.items()) or 'none'
