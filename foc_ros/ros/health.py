# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The inputs by the node's clocks, and its diagnostics: counts and times of what it did, and the checks that give the level.

The pipeline knows message stamps only, so that a replay needs no clock. Times named `_s` are of the steady clock [s], those named
`clock_ns` are ROS time [ns].
"""

from __future__ import annotations

import math
from collections import Counter, defaultdict, deque
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from foc_ros.core.pipeline import Pipeline, SampleStatus
from foc_ros.core.prediction import Prediction
from foc_ros.core.types import NANOSECONDS
from foc_ros.io.topics import HAND

from .intake import SOURCES, Intake
from .messages.types import MessageTypes, make_header

SOURCE_TOPICS = {source: role for role, source in SOURCES.items()}
WINDOW = 1000
"""Number of predictions over which the percentiles are computed."""
OK, WARN, ERROR = 0, 1, 2
HARMLESS = ('candidate_', 'hand_disengaged', 'hand_duplicate', 'hand_skipped', 'predict_', 'predictions', 'transform_newest_')
"""Prefixes of the counts that are no fault by themselves; the reason why no prediction is made is reported as text."""
FAULTS = ('predict_failed', 'predict_nothing_solved', 'predict_too_late')
"""Counts that are a fault all the same."""
DROPPED = 'hand_superseded'
"""Count of hand samples that were due and were replaced by a newer one before a prediction was made from them."""
BUSY_S = 0.5
"""Time that a prediction is computed after which the node is reported as busy [s]."""
THROTTLE_S = 5.0
"""Shortest time between two log lines of one kind [s]."""


@dataclass
class Input:
    """Messages of one input: numbers received, refused, and received before the last report; times, and the last refusal."""

    received: int = 0
    refused: int = 0
    reported: int = 0
    received_s: float = -math.inf
    used_s: float | None = None
    refused_s: float = -math.inf
    refusal: str = ''


class Freshness:
    """Ages of the inputs of a pipeline: the time since their last message, and the age of a hand pose, if it has ROS time."""

    def __init__(self, pipeline: Pipeline) -> None:
        self.inputs: defaultdict[str, Input] = defaultdict(Input)
        self._pipeline = pipeline
        self._age_s = 0.0
        self._has_ros_time = self._is_moving = False

    def note(self, role: str, status: SampleStatus | None, now_s: float, refusal: str | None = None) -> Input:
        """Count a message of an input, and return its counts; status: what became of it, None if it could not be decoded."""
        entry = self.inputs[role]
        entry.received, entry.received_s = entry.received + 1, now_s
        if status is None or status.is_refused:
            entry.refused, entry.refused_s, entry.refusal = entry.refused + 1, now_s, refusal or ''
        elif status.is_taken:
            entry.used_s = now_s
        return entry

    def note_pose(self, stamp_ns: int, clock_ns: int, *, is_restart: bool) -> None:
        """Store the age of a hand pose by ROS time.

        Ages count once a movement has begun with a pose that is not older or newer than the timeout. If a recording is played
        with its own stamps and without `use_sim_time`, the age of its poses means nothing.
        """
        self._age_s = (clock_ns - stamp_ns) / NANOSECONDS
        if clock_ns and (is_restart or not self._is_moving):
            self._has_ros_time = self._has_ros_time or abs(self._age_s) <= self._pipeline.config.estimator.hand_timeout_s
            self._is_moving = True

    def forget_clock(self) -> None:
        """Forget whether the poses are stamped by ROS time."""
        self._has_ros_time = self._is_moving = False

    def used_s(self, role: str, now_s: float) -> float:
        """Return when a message of an input was used last; now_s if none was."""
        used_s = self.inputs[role].used_s
        return now_s if used_s is None else used_s

    def find_not_ready_reason(self, now_s: float) -> tuple[str, str] | None:
        """Return why the clocks allow no prediction, as (kind, text); None if they allow it. The pipeline judges by stamps."""
        hand, limit_s, age_s = self.inputs[HAND], self._pipeline.config.estimator.hand_timeout_s, abs(self._age_s)
        limit, silence_s = f'(estimator.hand_timeout_s is {limit_s:g})', now_s - self.used_s(HAND, now_s)
        if 0.0 < limit_s < silence_s:
            if now_s - hand.refused_s <= limit_s:
                return 'hand_refused', f'no hand_pose could be used for {silence_s:.1f} s, the last: {hand.refusal}'
            return 'hand_silent', f'hand_pose silent for {silence_s:.1f} s {limit}'
        if self._has_ros_time and 0.0 < limit_s < age_s:
            relation = 'older' if self._age_s > 0.0 else 'newer'
            return 'hand_stale', f'the hand pose is {age_s:.3g} s {relation} than the time of the node {limit}'
        for source in self.find_silent_sources(now_s):
            role, limit_s = SOURCE_TOPICS[source], self._pipeline.config.scene.timeout_s
            silence_s = now_s - self.used_s(role, now_s)
            return 'obstacles_silent', f'{role} silent for {silence_s:.1f} s (scene.timeout_s is {limit_s:g})'
        return None

    def find_silent_sources(self, now_s: float) -> list[str]:
        """Return the sources of obstacles that have been silent for more than `scene.timeout_s`."""
        limit_s, sources = self._pipeline.config.scene.timeout_s, self._pipeline.scene.sources
        return [each for each in sources if 0.0 < limit_s < now_s - self.used_s(SOURCE_TOPICS[each], now_s)]

    def find_late_reason(self, stamp_ns: int, received_s: float, now_s: float, clock_ns: int) -> str | None:
        """Return why a prediction is not published now that it is computed, None if it is; received_s: when its pose arrived."""
        age_s, limit_s = now_s - received_s, self._pipeline.config.estimator.hand_timeout_s
        if self._has_ros_time:
            age_s = max(age_s, (clock_ns - stamp_ns) / NANOSECONDS)
        if not 0.0 < limit_s < age_s:
            return None
        return f'the last prediction took until its hand pose was {age_s:.3g} s old (estimator.hand_timeout_s is {limit_s:g})'


class Health(NamedTuple):
    """The diagnostics."""

    level: int
    message: str
    values: dict[str, str]

    def encode(self, node_name: str, stamp_ns: int, types: MessageTypes) -> Any:
        """Return a diagnostic_msgs/DiagnosticArray with one status; node_name: the full one, such as '/foc'."""
        status = self.level, f'{node_name[1:]}: prediction', self.message, node_name, list(self.values.items())
        return types.fill('diagnostic_msgs/msg/DiagnosticArray', (make_header(types, stamp_ns, ''), [status]))


class Monitor:
    """Counts and times of what the node did; :meth:`report` judges what happened since its last call. Attributes: counts."""

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

    def note_prediction(self, prediction: Prediction, start_s: float, now_s: float, budget_s: float, late: str | None) -> None:
        """Count a prediction; budget_s: of it, exceeded from 2 ms on; late: why it was not published, None if it was."""
        self._solve_ms.append(1e3 * prediction.solve_s)
        self.counts['predict_over_budget'] += 0.0 < budget_s < prediction.solve_s - 0.002
        if late is not None:
            self.counts['predict_too_late'] += 1
            self._late = late
            return
        self._prediction, self._predicted_s = prediction, now_s
        self.counts['predictions'] += 1
        self.counts.update(f'scene_{name}' for name in ('hand_inside', 'no_way') if prediction.notes.get(name))
        self._cycle_ms.append(1e3 * (now_s - start_s))

    def note_error(self, error: BaseException) -> None:
        """Count an internal error."""
        self.counts['internal_errors'] += 1
        self._error = f'{type(error).__name__}: {error}'

    def report(self, now_s: float, state: str, busy_s: float, unheard: Iterable[str]) -> Health:
        """Return the health since the last call; busy_s: for how long a prediction has been computed, 0 if there is none [s]."""
        pipeline, by_clock = self._intake.pipeline, self._freshness.find_not_ready_reason(now_s)
        not_ready_reason = pipeline.not_ready_reason() or (by_clock and by_clock[1])
        totals = Counter(self._intake.counts) + self.counts
        recent = totals - self._reported
        hand, repeated = self._freshness.inputs[HAND], recent['hand_duplicate']
        poses = hand.received - hand.reported
        checks = {
            f'no prediction: {not_ready_reason}': not_ready_reason is not None,
            f'hand_pose: stamps repeat: {repeated} of {poses} poses have that of the pose before': 2 * repeated >= poses > 0,
            f'busy: a prediction has been computed for {busy_s:.1f} s': busy_s > BUSY_S,
            f'busy: {self._late}': recent['predict_too_late'] > 0,
            f'{pipeline.config.homotopy.library}: {pipeline.library_doubt}': bool(pipeline.library_doubt),
        }
        reasons = [*unheard, *(text for text, is_found in checks.items() if is_found)]
        values = self._list_values(now_s, state, totals, recent)
        is_fresh = self._predicted_s is not None and now_s - self._predicted_s < BUSY_S
        if is_fresh and not recent['predict_over_budget'] and not recent['predict_too_late']:
            del recent[DROPPED]  # hand samples between predictions that are fresh are not missed
        if recent['internal_errors']:
            level, message = ERROR, f'{recent["internal_errors"]} internal errors, the last: {self._error}'
        elif state != 'active' or not pipeline.is_engaged:
            level, message = OK, 'disengaged' if state == 'active' else f'{state}: nothing is predicted'
        else:
            faults = {name: count for name, count in recent.items() if name in FAULTS or not name.startswith(HARMLESS)}
            found = [*reasons, *(f'{name} {count}' for name, count in sorted(faults.items()))]
            level, message = (WARN, '; '.join(found)) if found else (OK, 'predicting')
        self._reported, self._reported_s = totals, now_s
        for entry in self._freshness.inputs.values():
            entry.reported = entry.received
        return Health(level, '; '.join(filter(None, [message, self._intake.describe_still_hand()])), values)

    def _list_values(self, now_s: float, state: str, totals: Counter[str], recent: Counter[str]) -> dict[str, str]:
        pipeline, seconds = self._intake.pipeline, max(now_s - self._reported_s, 1e-3)
        pace, dispersion, movements = pipeline.learnt.pace, pipeline.learnt.dispersion, pipeline.learnt.movements
        (arrival, factor), (now, later) = pace.find_best(pipeline.config.duration), dispersion.factors
        durations = f'{pace.movements} movements ended, durations x {factor:.2f}, arrival {arrival}'
        errors = f'{dispersion.errors} errors, standard deviations x {now:.2f} now, x {later:.2f} at the end'
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
            'operator': f'{durations}; {errors}; {len(movements.learnt)} movements recorded, {movements.refused} refused',
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


def _describe_prediction(prediction: Prediction | None) -> dict[str, str]:
    if prediction is None:
        return {}
    candidates = {}
    for each in prediction.candidates:
        solution, text = each.solution, each.solution.message
        if each.has_likelihood:
            text = f'likelihood {each.likelihood:.3f}, eta {solution.eta:.3f}, effort {solution.effort:.4g}'
            text += f', answer of {each.age_s:.3g} s ago' if each.age_s else ''
        separator = ', ' if each.has_likelihood else ': '
        candidates[f'candidate {each.candidate.label}'] = f'{solution.status.value}{separator}{text}'
    return {
        'most likely': prediction.most_likely or 'none',
        'unknown': f'{prediction.unknown:.3f}',
        'other goal': f'{prediction.other:.3f}',
        **candidates,
        **{f'note {name}': str(count) for name, count in sorted(prediction.notes.items())},
    }


def _describe_percentiles(milliseconds: deque[float]) -> str:
    return ', '.join(f'{each:.2f}' for each in np.percentile(milliseconds, [50, 99])) if milliseconds else 'none yet'
