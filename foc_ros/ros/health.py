"""What the node knows of its own health: rates, ages and times by a steady clock, counts, and the judgement from them."""

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from foc_ros.core.pipeline import Pipeline
from foc_ros.core.types import PredictedCandidate, Prediction

from .intake import Intake
from .messages.diagnostics import ERROR, OK, WARN, Health

WINDOW = 1000
"""Predictions over which the percentiles are taken."""
HARMLESS = ('candidate_', 'hand_disengaged', 'hand_duplicate', 'predict_', 'predictions')
"""Beginnings of the counts that are no fault by themselves: what keeps predictions from being made is told in words."""
FAULTS = ('predict_failed', 'predict_nothing_solved')
TOLD = ('goal_inside', 'hand_inside', 'no_way')
"""Notes of a prediction that answers less than was asked for: it is counted as `scene_` and their name."""


@dataclass
class _Input:
    received: int = 0
    refused: int = 0
    received_before: int = 0
    last_s: float = 0.0


class Monitor:
    """Takes note of what happens; :meth:`health` judges what happened since it was last asked. Times: steady clock [s]."""

    def __init__(self, now_s: float) -> None:
        self._inputs: dict[str, _Input] = {}
        self._prediction: Prediction | None = None
        self._predicted_s: float | None = None
        self._own: Counter[str] = Counter()
        self._error = ''
        self._solve_ms: deque[float] = deque(maxlen=WINDOW)
        self._cycle_ms: deque[float] = deque(maxlen=WINDOW)
        self._before: Counter[str] = Counter()
        self._asked_s = now_s

    def received(self, role: str, now_s: float, *, taken: bool) -> tuple[int, int]:
        """Note a message of an input, taken or refused; return how many were refused, of how many."""
        entry = self._inputs.setdefault(role, _Input())
        entry.received, entry.refused, entry.last_s = entry.received + 1, entry.refused + (not taken), now_s
        return entry.refused, entry.received

    def predicted(self, prediction: Prediction, began_s: float, now_s: float) -> None:
        """Note a prediction, computed and published between two times."""
        self._prediction, self._predicted_s = prediction, now_s
        self._own['predictions'] += 1
        self._own.update(f'scene_{name}' for name in TOLD if prediction.notes.get(name))
        self._solve_ms.append(1e3 * prediction.solve_s)
        self._cycle_ms.append(1e3 * (now_s - began_s))

    def withheld(self, kind: str) -> None:
        """Note that nothing was predicted from a pose that was due."""
        self._own[f'predict_{kind}'] += 1

    def failed(self, error: BaseException) -> None:
        """Note an error that should not happen."""
        self._own['internal_errors'] += 1
        self._error = f'{type(error).__name__}: {error}'

    def health(self, now_s: float, intake: Intake, state: str, not_ready_reason: str | None) -> Health:
        """Return level, message and figures, with everything that the intake and its pipeline counted.

        state: of the managed node; not_ready_reason: why nothing is to be predicted by the clocks.
        """
        pipeline, seconds = intake.pipeline, max(now_s - self._asked_s, 1e-3)
        totals = Counter(intake.counts) + self._own
        recent = totals - self._before
        level, message = self._judged(pipeline, recent, state, not_ready_reason)
        values = {
            'state': state,
            'engaged': str(pipeline.engaged),
            'working frame': pipeline.frame_id if pipeline.frame_id is not None else 'not known yet',
            **_scene_values(pipeline),
            **self._input_values(now_s, seconds),
            'prediction rate [Hz]': f'{recent["predictions"] / seconds:.1f}',
            'prediction age [s]': 'none yet' if self._predicted_s is None else f'{now_s - self._predicted_s:.3f}',
            'solve time p50, p99 [ms]': _percentiles(self._solve_ms),
            'cycle time p50, p99 [ms]': _percentiles(self._cycle_ms),
            'dropped cycles': str(totals['hand_superseded']),
            **_candidate_values(self._prediction),
            **{f'count {name}': str(count) for name, count in sorted(totals.items())},
            'last refusal': intake.last_refusal or 'none',
            'last internal error': self._error or 'none',
        }
        self._before, self._asked_s = totals, now_s
        for entry in self._inputs.values():
            entry.received_before = entry.received
        return Health(level, message, values)

    def _judged(self, pipeline: Pipeline, recent: Counter[str], state: str, not_ready_reason: str | None) -> tuple[int, str]:
        if recent['internal_errors']:
            return ERROR, f'{recent["internal_errors"]} internal errors, the last: {self._error}'
        if state != 'active':
            return OK, f'{state}: nothing is predicted'
        if not pipeline.engaged:
            return OK, 'disengaged'
        faults = {name: count for name, count in recent.items() if name in FAULTS or not name.startswith(HARMLESS)}
        words = [f'{name} {count}' for name, count in sorted(faults.items())]
        blocked = pipeline.blocked() or not_ready_reason
        if blocked is not None:
            words.insert(0, f'no prediction: {blocked}')
        return (WARN, '; '.join(words)) if words else (OK, 'predicting')

    def _input_values(self, now_s: float, seconds: float) -> dict[str, str]:
        values = {}
        for role, entry in self._inputs.items():
            values[f'{role} age [s]'] = f'{now_s - entry.last_s:.3f}'
            values[f'{role} refused'] = f'{entry.refused} of {entry.received}'
            values[f'{role} rate [Hz]'] = f'{(entry.received - entry.received_before) / seconds:.1f}'
        return values


def _scene_values(pipeline: Pipeline) -> dict[str, str]:
    scene = pipeline.scene
    values = {f'obstacles of {source}': str(len(part.obstacles)) for source, part in scene.parts.items()}
    return {**values, 'goals': 'none yet' if scene.goals is None else str(len(scene.goals))}


def _candidate_values(prediction: Prediction | None) -> dict[str, str]:
    if prediction is None:
        return {}
    values = {f'candidate {outcome.candidate.label}': _described(outcome) for outcome in prediction.candidates}
    notes = {f'note {name}': str(count) for name, count in sorted(prediction.notes.items())}
    return {'most likely': prediction.most_likely or 'none', **values, **notes}


def _described(outcome: PredictedCandidate) -> str:
    solution = outcome.solution
    if not outcome.is_solved:
        return f'{solution.status.value}: {solution.message}'
    return f'{solution.status.value}, likelihood {outcome.likelihood:.3f}, eta {solution.eta:.3f}, effort {solution.effort:.4g}'


def _percentiles(milliseconds: Iterable[float]) -> str:
    values = list(milliseconds)
    return 'none yet' if not values else ', '.join(f'{value:.2f}' for value in np.percentile(values, [50, 99]))
