# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The node's diagnostics: counts and times of what it did, all values that are published, and the checks that give the level."""

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Iterable
from typing import Any, NamedTuple

import numpy as np

from foc_ros.core.pipeline import Pipeline
from foc_ros.core.prediction import PredictedCandidate, Prediction
from foc_ros.io.topics import HAND

from .freshness import Freshness
from .intake import Intake
from .messages.types import MessageTypes, make_header

WINDOW = 1000
"""Number of predictions over which the percentiles are computed."""
OK, WARN, ERROR = 0, 1, 2
"""Levels of diagnostic_msgs/DiagnosticStatus."""
HARMLESS = ('candidate_', 'hand_disengaged', 'hand_duplicate', 'hand_skipped', 'predict_', 'predictions', 'transform_newest_')
"""Prefixes of the counts that are no fault by themselves; the reason why no prediction is made is reported as text."""
FAULTS = ('predict_failed', 'predict_nothing_solved', 'predict_too_late')
DROPPED = 'hand_superseded'
"""Count of hand samples that were due and were replaced by a newer one before a prediction was made from them."""
OVER_BUDGET_S = 0.002
"""Time beyond `budget_s` after which a prediction is counted as over budget [s]."""
BUSY_S = 0.5
"""Time that a prediction is computed after which the node is reported as busy [s]."""
THROTTLE_S = 5.0
"""Shortest time between two log lines of one kind [s]."""
REPORTED_NOTES = ('hand_inside', 'no_way')
"""Notes of an incomplete prediction, each counted as `scene_` and its name."""


class Health(NamedTuple):
    """Level, summary and all values of the diagnostics."""

    level: int
    message: str
    values: dict[str, str]

    def encode(self, node_name: str, stamp_ns: int, types: MessageTypes) -> Any:
        """Return a diagnostic_msgs/DiagnosticArray with one status; node_name: the node's full name, such as '/foc'."""
        values = [types.fill('diagnostic_msgs/msg/KeyValue', item) for item in self.values.items()]
        parts = self.level, f'{node_name[1:]}: prediction', self.message, node_name, values
        status = types.fill('diagnostic_msgs/msg/DiagnosticStatus', parts)
        return types.fill('diagnostic_msgs/msg/DiagnosticArray', (make_header(types, stamp_ns, ''), [status]))


class Monitor:
    """Counts and times of what the node did; :meth:`report` judges what happened since its last call. Attributes: counts.

    Times are of the steady clock [s]; now_s: the present one.
    """

    def __init__(self, intake: Intake, freshness: Freshness, now_s: float) -> None:
        self._intake, self._freshness = intake, freshness
        self.counts: Counter[str] = Counter()
        self._prediction: Prediction | None = None
        self._predicted_s: float | None = None
        self._error, self._late = '', ''
        self._solve_ms: deque[float] = deque(maxlen=WINDOW)
        self._cycle_ms: deque[float] = deque(maxlen=WINDOW)
        self._reported: Counter[str] = Counter()
        self._reported_s = now_s

    def note_computed(self, prediction: Prediction, budget_s: float) -> None:
        """Store how long a prediction was computed; budget_s: the time that it had, 0 for no limit."""
        self._solve_ms.append(1e3 * prediction.solve_s)
        self.counts['predict_over_budget'] += 0.0 < budget_s < prediction.solve_s - OVER_BUDGET_S

    def note_prediction(self, prediction: Prediction, start_s: float, now_s: float) -> None:
        """Count a prediction that was computed and published between two times."""
        self._prediction, self._predicted_s = prediction, now_s
        self.counts['predictions'] += 1
        self.counts.update(f'scene_{name}' for name in REPORTED_NOTES if prediction.notes.get(name))
        self._cycle_ms.append(1e3 * (now_s - start_s))

    def note_late(self, reason: str) -> None:
        """Count a prediction that was too old when it had been computed."""
        self.counts['predict_too_late'] += 1
        self._late = reason

    def note_error(self, error: BaseException) -> None:
        """Count an internal error."""
        self.counts['internal_errors'] += 1
        self._error = f'{type(error).__name__}: {error}'

    def report(self, now_s: float, state: str, not_ready_reason: str | None, busy_s: float, unheard: Iterable[str]) -> Health:
        """Return the health since the last call.

        state: of the managed node; not_ready_reason: text, None if ready; busy_s: for how long the present prediction has been
        computed, 0 if there is none [s]; unheard: a text for each publisher that cannot be heard.
        """
        totals = Counter(self._intake.counts) + self.counts
        recent = totals - self._reported
        hand, repeated = self._freshness.inputs[HAND], recent['hand_duplicate']
        poses = hand.received - hand.reported
        checks = (
            (not_ready_reason is not None, f'no prediction: {not_ready_reason}'),
            (
                2 * repeated >= poses > 0,
                f'hand_pose: stamps repeat: {repeated} of {poses} poses have that of the pose before',
            ),
            (busy_s > BUSY_S, f'busy: a prediction has been computed for {busy_s:.1f} s'),
            (recent['predict_too_late'] > 0, f'busy: {self._late}'),
        )
        reasons = [*unheard, *(text for is_found, text in checks if is_found)]
        values = self._list_values(now_s, state, totals, recent)
        is_fresh = self._predicted_s is not None and now_s - self._predicted_s < BUSY_S
        if is_fresh and not recent['predict_over_budget'] and not recent['predict_too_late']:
            del recent[DROPPED]  # hand samples between predictions that are fresh are not missed
        level, message = self._judge(recent, state, reasons)
        self._reported, self._reported_s = totals, now_s
        for entry in self._freshness.inputs.values():
            entry.reported = entry.received
        return Health(level, '; '.join(filter(None, [message, self._intake.describe_still_hand()])), values)

    def _judge(self, recent: Counter[str], state: str, reasons: list[str]) -> tuple[int, str]:
        if recent['internal_errors']:
            return ERROR, f'{recent["internal_errors"]} internal errors, the last: {self._error}'
        if state != 'active':
            return OK, f'{state}: nothing is predicted'
        if not self._intake.pipeline.is_engaged:
            return OK, 'disengaged'
        faults = {name: count for name, count in recent.items() if name in FAULTS or not name.startswith(HARMLESS)}
        parts = reasons + [f'{name} {count}' for name, count in sorted(faults.items())]
        return (WARN, '; '.join(parts)) if parts else (OK, 'predicting')

    def _list_values(self, now_s: float, state: str, totals: Counter[str], recent: Counter[str]) -> dict[str, str]:
        pipeline, seconds = self._intake.pipeline, max(now_s - self._reported_s, 1e-3)
        inputs = {}
        for role, entry in self._freshness.inputs.items():
            if entry.received:
                inputs[f'{role} age [s]'] = f'{now_s - entry.received_s:.3f}'
                inputs[f'{role} refused'] = f'{entry.refused} of {entry.received}'
                inputs[f'{role} rate [Hz]'] = f'{(entry.received - entry.reported) / seconds:.1f}'
        return {
            'state': state,
            'engaged': str(pipeline.is_engaged),
            'working frame': pipeline.frame_id if pipeline.frame_id is not None else 'not known yet',
            **{f'obstacles of {source}': str(len(part.obstacles)) for source, part in pipeline.scene.sources.items()},
            'goals': 'none yet' if pipeline.scene.goals is None else str(len(pipeline.scene.goals)),
            'operator': _describe_learnt(pipeline),
            **inputs,
            'prediction rate [Hz]': f'{recent["predictions"] / seconds:.1f}',
            'prediction age [s]': 'none yet' if self._predicted_s is None else f'{now_s - self._predicted_s:.3f}',
            'solve time p50, p99 [ms]': _describe_percentiles(self._solve_ms),
            'cycle time p50, p99 [ms]': _describe_percentiles(self._cycle_ms),
            'dropped cycles': str(totals[DROPPED]),
            **_describe_prediction(self._prediction),
            **{f'count {name}': str(count) for name, count in sorted(totals.items())},
            'last refusal': self._intake.last_refusal or 'none',
            'last internal error': self._error or 'none',
        }


def _describe_learnt(pipeline: Pipeline) -> str:
    """Return what was learnt of the operator and of the scene, and from how many movements and errors."""
    pace, dispersion, movements = pipeline.learnt.pace, pipeline.learnt.dispersion, pipeline.learnt.movements
    arrival, factor = pace.find_best(pipeline.config.duration)
    durations = f'{pace.movements} movements ended, durations x {factor:.2f}, arrival {arrival}'
    now, later = dispersion.factors
    errors = f'{dispersion.errors} errors, standard deviations x {now:.2f} now, x {later:.2f} at the end'
    return f'{durations}; {errors}; {len(movements.learnt)} movements recorded, {movements.refused} refused'


def _describe_prediction(prediction: Prediction | None) -> dict[str, str]:
    if prediction is None:
        return {}
    return {
        'most likely': prediction.most_likely or 'none',
        'unknown': f'{prediction.unknown:.3f}',
        'other goal': f'{prediction.other:.3f}',
        **{f'candidate {each.candidate.label}': _describe_candidate(each) for each in prediction.candidates},
        **{f'note {name}': str(count) for name, count in sorted(prediction.notes.items())},
    }


def _describe_candidate(outcome: PredictedCandidate) -> str:
    solution = outcome.solution
    if not outcome.has_likelihood:
        return f'{solution.status.value}: {solution.message}'
    numbers = f'likelihood {outcome.likelihood:.3f}, eta {solution.eta:.3f}, effort {solution.effort:.4g}'
    age = f', answer of {outcome.age_s:.3g} s ago' if outcome.age_s else ''
    return f'{solution.status.value}, {numbers}{age}'


def _describe_percentiles(milliseconds: deque[float]) -> str:
    return ', '.join(f'{each:.2f}' for each in np.percentile(milliseconds, [50, 99])) if milliseconds else 'none yet'
