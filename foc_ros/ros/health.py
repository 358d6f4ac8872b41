# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Health of the node: freshness of the inputs by the clocks, counts, rates and times, and the diagnostics made from them.

Times named `now_s` are of the steady clock [s].
"""

from __future__ import annotations

import math
from collections import Counter, deque
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from foc_ros.core.config import Config
from foc_ros.core.pipeline import Pipeline
from foc_ros.core.types import NANOSECONDS, PredictedCandidate, Prediction
from foc_ros.io.topics import CLOUD, COLLISION, DETECTIONS, HAND, MARKERS

from .intake import Intake
from .messages.types import MessageTypes, make_header

SOURCE_TOPICS = {'cloud': CLOUD, 'markers': MARKERS, COLLISION: COLLISION, DETECTIONS: DETECTIONS}
"""Topic of every source of obstacles in the scene."""
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


class Freshness:
    """Ages of the inputs by the node's clocks; the pipeline knows message stamps only, so that a replay needs no clock.

    The steady clock gives the time since a topic was received last, and ROS time the age of a hand pose, if it is stamped so.
    """

    def __init__(self) -> None:
        self._received_s: dict[str, float] = {}
        self._age_s = 0.0
        self._has_ros_time = False
        self._is_moving = False
        self._refused_s, self._refusal = -math.inf, ''

    def note_refused(self, now_s: float, reason: str) -> None:
        """Store why a hand pose was refused that arrived at a time."""
        self._refused_s, self._refusal = now_s, reason

    def note_received(self, role: str, now_s: float) -> None:
        """Store the time at which a message was accepted."""
        self._received_s[role] = now_s

    def received_s(self, role: str, now_s: float) -> float:
        """Return when a message of a topic was accepted last; now_s if none was."""
        return self._received_s.get(role, now_s)

    def note_pose(self, stamp_ns: int, clock_ns: int, timeout_s: float, *, is_restart: bool) -> None:
        """Store the age of a hand pose by ROS time.

        Ages count once a movement has begun with a pose that is not older or newer than the timeout. If a recording is played
        with its own stamps and without `use_sim_time`, the age of its poses means nothing, and it is not checked.
        """
        self._age_s = (clock_ns - stamp_ns) / NANOSECONDS
        if clock_ns and (is_restart or not self._is_moving):
            self._has_ros_time = self._has_ros_time or abs(self._age_s) <= timeout_s
            self._is_moving = True

    def forget_clock(self) -> None:
        """Forget whether the poses are stamped by ROS time."""
        self._has_ros_time = self._is_moving = False

    def find_not_ready_reason(self, now_s: float, config: Config, sources: Iterable[str]) -> tuple[str, str] | None:
        """Return why the clocks allow no prediction, as (kind, text); None if they allow it.

        sources: the sources of obstacles. If one of them is silent, nothing is predicted: its obstacles may still be there.
        """
        limit_s = config.estimator.hand_timeout_s
        silence_s = now_s - self.received_s(HAND, now_s)
        if 0.0 < limit_s < silence_s and now_s - self._refused_s <= limit_s:
            return 'hand_refused', f'no hand_pose could be used for {silence_s:.1f} s, the last: {self._refusal}'
        if 0.0 < limit_s < silence_s:
            return 'hand_silent', f'hand_pose silent for {silence_s:.1f} s (estimator.hand_timeout_s is {limit_s:g})'
        if self._has_ros_time and 0.0 < limit_s < abs(self._age_s):
            age = f'{abs(self._age_s):.3g} s {"older" if self._age_s > 0.0 else "newer"}'
            return 'hand_stale', f'the hand pose is {age} than the time of the node (estimator.hand_timeout_s is {limit_s:g})'
        for source in self.find_silent_sources(now_s, config, sources):
            role, limit_s = SOURCE_TOPICS[source], config.scene.timeout_s
            silence_s = now_s - self._received_s[role]
            return 'obstacles_silent', f'{role} silent for {silence_s:.1f} s (scene.timeout_s is {limit_s:g})'
        return None

    def find_silent_sources(self, now_s: float, config: Config, sources: Iterable[str]) -> list[str]:
        """Return the sources of obstacles that have been silent for more than `scene.timeout_s`."""
        limit_s = config.scene.timeout_s
        return [each for each in sources if 0.0 < limit_s < now_s - self.received_s(SOURCE_TOPICS[each], now_s)]

    def find_late_reason(self, stamp_ns: int, received_s: float, now_s: float, clock_ns: int, config: Config) -> str | None:
        """Return why a prediction is not published now that it is computed, None if it is.

        stamp_ns, received_s: stamp of its hand pose [ns], and when that arrived; clock_ns: ROS time.
        """
        age_s, limit_s = now_s - received_s, config.estimator.hand_timeout_s
        if self._has_ros_time:
            age_s = max(age_s, (clock_ns - stamp_ns) / NANOSECONDS)
        if not 0.0 < limit_s < age_s:
            return None
        return f'the last prediction took until its hand pose was {age_s:.3g} s old (estimator.hand_timeout_s is {limit_s:g})'


class Health(NamedTuple):
    """Level, summary and all values of the diagnostics."""

    level: int
    message: str
    values: dict[str, str]


@dataclass
class _Input:
    received: int = 0
    refused: int = 0
    received_before: int = 0
    last_s: float = 0.0


class Monitor:
    """Counts and times of what the node did; :meth:`report` judges what happened since its last call."""

    def __init__(self, now_s: float) -> None:
        self._inputs: dict[str, _Input] = {}
        self._prediction: Prediction | None = None
        self._predicted_s: float | None = None
        self._counts: Counter[str] = Counter()
        self._error, self._late = '', ''
        self._solve_ms: deque[float] = deque(maxlen=WINDOW)
        self._cycle_ms: deque[float] = deque(maxlen=WINDOW)
        self._counts_before: Counter[str] = Counter()
        self._reported_s = now_s

    def note_message(self, role: str, now_s: float, *, is_refused: bool) -> tuple[int, int]:
        """Count an input message; return how many of this input were refused, and how many were received."""
        entry = self._inputs.setdefault(role, _Input())
        entry.received, entry.refused, entry.last_s = entry.received + 1, entry.refused + is_refused, now_s
        return entry.refused, entry.received

    def note_computed(self, prediction: Prediction, budget_s: float) -> None:
        """Store how long a prediction was computed; budget_s: the time that it had, 0 for no limit."""
        self._solve_ms.append(1e3 * prediction.solve_s)
        self._counts['predict_over_budget'] += 0.0 < budget_s < prediction.solve_s - OVER_BUDGET_S

    def note_prediction(self, prediction: Prediction, start_s: float, now_s: float) -> None:
        """Count a prediction that was computed and published between two times."""
        self._prediction, self._predicted_s = prediction, now_s
        self._counts['predictions'] += 1
        self._counts.update(f'scene_{name}' for name in REPORTED_NOTES if prediction.notes.get(name))
        self._cycle_ms.append(1e3 * (now_s - start_s))

    def note_late(self, reason: str) -> None:
        """Count a prediction that was too old when it had been computed."""
        self._counts['predict_too_late'] += 1
        self._late = reason

    def note_withheld(self, kind: str) -> None:
        """Count a prediction that was due and not made."""
        self._counts[f'predict_{kind}'] += 1

    def note_error(self, error: BaseException) -> None:
        """Count an internal error."""
        self._counts['internal_errors'] += 1
        self._error = f'{type(error).__name__}: {error}'

    def report(
        self,
        now_s: float,
        intake: Intake,
        state: str,
        not_ready_reason: str | None,
        busy_s: float = 0.0,
        unheard: Iterable[str] = (),
    ) -> Health:
        """Return the health since the last call.

        state: of the managed node; not_ready_reason: text, None if ready; busy_s: for how long the present prediction has been
        computed, 0 if there is none [s]; unheard: a text for each publisher that cannot be heard.
        """
        pipeline, seconds = intake.pipeline, max(now_s - self._reported_s, 1e-3)
        totals = Counter(intake.counts) + self._counts
        recent = totals - self._counts_before
        hand = self._inputs.get(HAND, _Input())
        repeated, poses = recent['hand_duplicate'], hand.received - hand.received_before
        values = {
            'state': state,
            'engaged': str(pipeline.is_engaged),
            'working frame': pipeline.frame_id if pipeline.frame_id is not None else 'not known yet',
            **{f'obstacles of {source}': str(len(part.obstacles)) for source, part in pipeline.scene.sources.items()},
            'goals': 'none yet' if pipeline.scene.goals is None else str(len(pipeline.scene.goals)),
            'operator': _describe_learnt(pipeline),
            **self._describe_inputs(now_s, seconds),
            'prediction rate [Hz]': f'{recent["predictions"] / seconds:.1f}',
            'prediction age [s]': 'none yet' if self._predicted_s is None else f'{now_s - self._predicted_s:.3f}',
            'solve time p50, p99 [ms]': _describe_percentiles(self._solve_ms),
            'cycle time p50, p99 [ms]': _describe_percentiles(self._cycle_ms),
            'dropped cycles': str(totals[DROPPED]),
            **_describe_prediction(self._prediction),
            **{f'count {name}': str(count) for name, count in sorted(totals.items())},
            'last refusal': intake.last_refusal or 'none',
            'last internal error': self._error or 'none',
        }
        self._counts_before, self._reported_s = totals, now_s
        for entry in self._inputs.values():
            entry.received_before = entry.received
        reasons = [*unheard, *([] if not_ready_reason is None else [f'no prediction: {not_ready_reason}'])]
        if 2 * repeated >= poses > 0:
            reasons.append(f'hand_pose: stamps repeat: {repeated} of {poses} poses have that of the pose before')
        if busy_s > BUSY_S:
            reasons.append(f'busy: a prediction has been computed for {busy_s:.1f} s')
        if recent['predict_too_late']:
            reasons.append(f'busy: {self._late}')
        if self._is_punctual(recent, now_s):
            del recent[DROPPED]
        level, message = self._judge(pipeline, recent, state, reasons)
        return Health(level, '; '.join(filter(None, [message, intake.describe_still_hand()])), values)

    def _is_punctual(self, recent: Counter[str], now_s: float) -> bool:
        """Return whether predictions are fresh and within their budget, so that hand samples between them are not missed."""
        is_fresh = self._predicted_s is not None and now_s - self._predicted_s < BUSY_S
        return is_fresh and not recent['predict_over_budget'] and not recent['predict_too_late']

    def _judge(self, pipeline: Pipeline, recent: Counter[str], state: str, reasons: list[str]) -> tuple[int, str]:
        if recent['internal_errors']:
            return ERROR, f'{recent["internal_errors"]} internal errors, the last: {self._error}'
        if state != 'active':
            return OK, f'{state}: nothing is predicted'
        if not pipeline.is_engaged:
            return OK, 'disengaged'
        faults = {name: count for name, count in recent.items() if name in FAULTS or not name.startswith(HARMLESS)}
        parts = reasons + [f'{name} {count}' for name, count in sorted(faults.items())]
        return (WARN, '; '.join(parts)) if parts else (OK, 'predicting')

    def _describe_inputs(self, now_s: float, seconds: float) -> dict[str, str]:
        values = {}
        for role, entry in self._inputs.items():
            values[f'{role} age [s]'] = f'{now_s - entry.last_s:.3f}'
            values[f'{role} refused'] = f'{entry.refused} of {entry.received}'
            values[f'{role} rate [Hz]'] = f'{(entry.received - entry.received_before) / seconds:.1f}'
        return values


def _describe_learnt(pipeline: Pipeline) -> str:
    """Return what was learnt of the operator and of the scene, and from how many movements and errors."""
    pace, dispersion = pipeline.learnt.pace, pipeline.learnt.dispersion
    movements = pipeline.learnt.movements
    arrival, factor = pace.find_best(pipeline.config.duration)
    durations = f'{pace.movements} movements ended, durations x {factor:.2f}, arrival {arrival}'
    now, later = dispersion.factors
    errors = f'{dispersion.errors} errors, standard deviations x {now:.2f} now, x {later:.2f} at the end'
    recorded = f'{len(movements.learnt)} movements recorded, {movements.refused} refused'
    return f'{durations}; {errors}; {recorded}'


def _describe_prediction(prediction: Prediction | None) -> dict[str, str]:
    if prediction is None:
        return {}
    candidates = {f'candidate {outcome.candidate.label}': _describe_candidate(outcome) for outcome in prediction.candidates}
    notes = {f'note {name}': str(count) for name, count in sorted(prediction.notes.items())}
    known = {'most likely': prediction.most_likely or 'none', 'unknown': f'{prediction.unknown:.3f}'}
    known['other goal'] = f'{prediction.other:.3f}'
    return {**known, **candidates, **notes}


def _describe_candidate(outcome: PredictedCandidate) -> str:
    solution = outcome.solution
    if not outcome.has_likelihood:
        return f'{solution.status.value}: {solution.message}'
    age = f', answer of {outcome.age_s:.3g} s ago' if outcome.age_s else ''
    return (
        f'{solution.status.value}, likelihood {outcome.likelihood:.3f}, eta {solution.eta:.3f}, effort {solution.effort:.4g}{age}'
    )


def _describe_percentiles(milliseconds: Iterable[float]) -> str:
    values = list(milliseconds)
    return 'none yet' if not values else ', '.join(f'{value:.2f}' for value in np.percentile(values, [50, 99]))


def encode_diagnostics(health: Health, node_name: str, stamp_ns: int, types: MessageTypes) -> Any:
    """Encode a diagnostic_msgs/DiagnosticArray with one status, named after the node's full name, such as '/foc'."""
    status = types.make(
        'diagnostic_msgs/msg/DiagnosticStatus',
        level=health.level,
        name=f'{node_name[1:]}: prediction',
        message=health.message,
        hardware_id=node_name,
        values=[types.make('diagnostic_msgs/msg/KeyValue', key=key, value=value) for key, value in health.values.items()],
    )
    return types.make('diagnostic_msgs/msg/DiagnosticArray', header=make_header(types, stamp_ns, ''), status=[status])
