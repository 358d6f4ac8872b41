# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The report of a recording: a directory with one interactive page, and the numbers."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from foc_ros.analysis.replay import Step, keep_last_run
from foc_ros.core.config import Config
from foc_ros.core.errors import InputError
from foc_ros.core.prediction import Prediction
from foc_ros.core.solution import Status
from foc_ros.core.types import NANOSECONDS, HandSample
from foc_ros.io.outputs import MARK, REPORT_FILES, check_page, make_folder, write_whole
from foc_ros.ros.messages.ranking import compute_cost_ratios, describe_candidate

from .encode import encode_report, round_number
from .page import Table, describe_origin, render
from .views import NOTED, HandTrajectory, build_candidate_tracks, build_hand_trajectory, build_snapshot, is_late, list_unsolved

COUNTERS = ('rejected', 'candidates compromised', 'candidates estimated', 'candidates not solved', 'counters of the node')
"""Facts that the page folds: raw counts, of which the warnings name what matters."""


class PageWarning(NamedTuple):
    """What went wrong, and the first moment of it: seconds after the first hand sample, None if there is none."""

    text: str
    time_s: float | None = None


class ReportCollector:
    """Collects what a report shows: samples of the hand, snapshots, and runs, of which a replay that begins anew has several.

    config: the parameters that the footer of the report names.
    """

    def __init__(self, config: Config | None = None) -> None:
        self.config = config
        self.samples: list[HandSample] = []
        self.snapshots: list[Prediction] = []
        self.runs = 1

    @property
    def hand(self) -> HandTrajectory:
        """The measured movement."""
        return build_hand_trajectory(self.samples)

    def add(self, step: Step) -> None:
        """Keep the hand sample and the prediction of a step of a replay."""
        if step.sample is not None:
            self.runs += keep_last_run(self.samples, step.sample, self.snapshots)
        if step.prediction is not None:
            self.snapshots.append(build_snapshot(step.prediction))

    def write(self, directory: Path, title: str, summary: Mapping[str, str], tables: Sequence[Table] = ()) -> Path:
        """Write the report and return its page; see :func:`write_report`."""
        runs = {'runs': f'{self.runs}, of which the last one is shown'} if self.runs > 1 else {}
        return write_report(directory, title, self.hand, self.snapshots, {**summary, **runs}, tables, self.config)


def write_report(
    directory: Path,
    title: str,
    hand: HandTrajectory,
    snapshots: Sequence[Prediction],
    summary: Mapping[str, str],
    tables: Sequence[Table] = (),
    config: Config | None = None,
) -> Path:
    """Write `REPORT_FILES` into a directory, replacing an earlier report; return the page.

    summary: facts for a table of the page; tables: results that stand above the scene; config: the parameters that its footer
    names. Raises InputError if that is impossible, or the hand has no sample.
    """
    check_page('--report', directory, *REPORT_FILES)
    if not len(hand.stamps_ns):
        raise InputError('report', 'a recording with a hand pose', 'none')
    spans = hand.find_movements() or [(int(hand.stamps_ns[0]), int(hand.stamps_ns[-1]))]
    tracks = build_candidate_tracks(snapshots)
    facts, warnings = {**_collect_facts(snapshots), **summary}, _collect_warnings(snapshots, int(hand.stamps_ns[0]))
    data = encode_report(hand, tracks, spans)
    folded = {name: facts[name] for name in COUNTERS if name in facts}
    shown = {name: text for name, text in facts.items() if name not in folded}
    parts = {'warnings': warnings, 'facts': shown, 'tables': tables, 'counters': folded, 'data': data}
    html = render('report.html', title=title, **parts, **describe_origin(config))
    numbers = {
        'generator': MARK,
        'title': title,
        'summary': facts,
        'warnings': [each.text for each in warnings],
        'hand_samples': len(hand.stamps_ns),
        'predictions': [_encode_snapshot(each, int(hand.stamps_ns[0])) for each in snapshots],
    }
    with make_folder('--report', directory):
        for name, text in zip(REPORT_FILES, (html, json.dumps(numbers, indent=1, allow_nan=False)), strict=True):
            with write_whole(directory / name) as unfinished:
                unfinished.write_text(text, encoding='utf-8', errors='replace')
    return directory / REPORT_FILES[0]


def describe_late(snapshots: Sequence[Prediction]) -> str:
    """Return for how many predictions the computer was too busy and what to change, '' where these are 5 % or less."""
    late = sum(map(is_late, snapshots))
    if late <= 0.05 * len(snapshots):
        return ''
    return (
        f'This computer was too busy for {late} of {len(snapshots)} predictions, which show paths that are not finished. '
        'End other programs, or let the node do less: a smaller rate_hz or homotopy.max_candidates, or a longer budget_s.'
    )


def _collect_facts(snapshots: Sequence[Prediction]) -> dict[str, str]:
    solve_ms = [1e3 * each.solve_s for each in snapshots if each.solve_s]
    views = [view for each in snapshots for view in each if view.likelihood >= NOTED]
    counts = [sum(view.status is status for view in views) for status in (Status.SOLVED, Status.COMPROMISED)]
    facts = {
        'predictions': str(len(snapshots)),
        f'paths with at least {100 * NOTED:.0f} %': f'{len(views)}: {counts[0]} avoid the obstacles as surely as wanted, '
        f'{counts[1]} less surely; {len(views) - sum(counts)} are estimates',
    }
    if solve_ms:
        median, late = np.percentile(solve_ms, [50, 99])
        facts['time per prediction'] = f'{median:.1f} ms (median), {late:.1f} ms (99th percentile)'
    return facts


def _collect_warnings(snapshots: Sequence[Prediction], origin_ns: int) -> list[PageWarning]:
    if not snapshots:
        return [PageWarning('There is no prediction.')]
    count, late = len(snapshots), describe_late(snapshots)
    unsolved = [each for each in snapshots if not each.candidates_with_likelihood]
    unsure = [each for each in snapshots if any(one.status is Status.COMPROMISED for one in each.candidates[:1])]
    words = f'In {len(unsure)} of {count} predictions the most likely path avoids the obstacles less surely than wanted'
    found = [
        (f'In {len(unsolved)} of {count} predictions no candidate could be solved.', unsolved),
        (late, [each for each in snapshots if late and is_late(each)]),
        (f'{words}. Remedy: {Status.COMPROMISED.remedy}.', unsure),
    ]
    for status in sorted(Status, key=lambda each: each.value):
        lost = [each for each in snapshots for one in list_unsolved(each) if one.status is status]
        words = f'{len(lost)} candidate{"s" if len(lost) > 1 else ""} ended with status {status.value}. Remedy: {status.remedy}.'
        found.append((words, lost))
    return [PageWarning(words, round((each[0].stamp_ns - origin_ns) / NANOSECONDS, 4)) for words, each in found if each]


def _encode_snapshot(snapshot: Prediction, origin_ns: int) -> dict[str, Any]:
    shown = snapshot.candidates_with_likelihood
    return {
        'stamp_ns': snapshot.stamp_ns,
        't_s': round((snapshot.stamp_ns - origin_ns) / NANOSECONDS, 6),
        'most_likely': snapshot.most_likely,
        'candidates': [
            {
                'label': each.label,
                'description': describe_candidate(each, len(snapshot.goal_positions)),
                'status': each.status.value,
                'compromised': not each.is_solved,
                **{name: round_number(getattr(each, name)) for name in ('likelihood', 'effort', 'eta')},
                'cost_ratio': round_number(ratio),
                'end': [round_number(value) for value in each.solution.path[-1]],
            }
            for each, ratio in zip(shown, compute_cost_ratios(shown), strict=True)
        ],
        'unsolved': {each.label: each.status.value for each in list_unsolved(snapshot)},
    }
