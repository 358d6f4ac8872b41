"""A directory that tells of a recording: one interactive page, pictures for print, and the numbers."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from foc_ros.core.errors import InputError
from foc_ros.core.types import NANOSECONDS

from . import plots
from .drawing import CLASS_COLOURS, CLASSES
from .report_data import page_data, rounded
from .report_page import report_page
from .snapshots import Snapshot, Track, movements
from .track_association import associate_tracks, slots

MOST_PICTURES = 8
FRACTIONS_OF_ONE = (0.1, 0.3, 0.5, 0.7)
"""Where in its time a movement is shown when it is the only one; of several, each is shown once, at FRACTION."""
FRACTION = 0.3
ONSET_SPEED = 0.05
"""Speed [m/s] above which the pictures take the hand to be moving."""


def write_report(
    directory: Path, title: str, track: Track, moments: Sequence[Snapshot], summary: Mapping[str, str]
) -> list[Path]:
    """Write index.html (which needs nothing else), predictions.json and pictures; return the files.

    track: the measured hand; moments: the predictions in order; summary: facts to put on top, in words. Files of those names are
    replaced. Raises InputError where the directory cannot be written or the hand has no sample.
    """
    if not len(track.stamps_ns):
        raise InputError('report', 'a recording with a hand pose', 'none')
    spans = movements(track, ONSET_SPEED) or [(int(track.stamps_ns[0]), int(track.stamps_ns[-1]))]
    html = report_page(title, page_data(track, moments, spans), {**_facts(moments), **summary}, _warnings(moments))
    try:
        directory.mkdir(parents=True, exist_ok=True)
        pictures = _write_pictures(directory, track, moments, spans)
        page, numbers = directory / 'index.html', directory / 'predictions.json'
        page.write_text(html, encoding='utf-8')
        numbers.write_text(json.dumps(_numbers(title, track, moments, summary), indent=1, allow_nan=False), encoding='utf-8')
    except OSError as error:
        raise InputError('report directory', 'a directory that can be written', f'{directory}: {error.strerror}') from error
    return [page, numbers, *pictures]


def _write_pictures(directory: Path, track: Track, moments: Sequence[Snapshot], spans: Sequence[tuple[int, int]]) -> list[Path]:
    """Return the files, the overview first."""
    shown = [moment for moment in moments if moment.ways]
    if not shown:
        return []
    lines = associate_tracks(moments)
    letters = slots(moments, lines, CLASSES, len(CLASS_COLOURS))
    chosen = _chosen(shown, spans)
    ways = [way for _, moment in chosen for way in moment.ways]
    goals = np.unique(np.concatenate([moment.goals for moment in shown]), axis=0)
    bounds = plots.bounds_of(shown[0].obstacles, goals, ways, track.positions)
    files = [directory / 'overview.png']
    plots.save(plots.track_figure(track, shown[0].obstacles, goals, spans, bounds), files[0])
    for count, (number, moment) in enumerate(chosen):
        start_ns, end_ns = spans[number]
        rows = [row for row, each in enumerate(moments) if start_ns <= each.stamp_ns <= end_ns]
        around = plots.Around(tuple(moments[row] for row in rows), tuple(lines[row] for row in rows), letters)
        files.append(directory / f'moment_{count + 1:02d}.png')
        plots.save(plots.moment_figure(track, moment, around, spans[number], bounds), files[-1])
    return files


def _chosen(shown: Sequence[Snapshot], spans: Sequence[tuple[int, int]]) -> list[tuple[int, Snapshot]]:
    """Return the moments that get a picture, each with the number of its movement."""
    numbers = np.unique(np.linspace(0, len(spans) - 1, min(len(spans), MOST_PICTURES)).round().astype(int))
    wanted = [
        (int(number), fraction) for number in numbers for fraction in (FRACTIONS_OF_ONE if len(spans) == 1 else (FRACTION,))
    ]
    stamps = np.array([moment.stamp_ns for moment in shown])
    chosen: dict[int, int] = {}
    for number, fraction in wanted:
        start_ns, end_ns = spans[number]
        inside = np.flatnonzero((stamps >= start_ns) & (stamps <= end_ns))
        if len(inside):
            chosen[int(inside[np.argmin(np.abs(stamps[inside] - (start_ns + fraction * (end_ns - start_ns))))])] = number
    return [(number, shown[row]) for row, number in chosen.items()]


def _facts(moments: Sequence[Snapshot]) -> dict[str, str]:
    solve_ms = [1e3 * moment.solve_s for moment in moments if moment.solve_s is not None]
    facts = {'predictions': str(len(moments)), 'candidates solved': str(sum(len(moment.ways) for moment in moments))}
    if solve_ms:
        median, late = np.percentile(solve_ms, [50, 99])
        facts['time per prediction'] = f'{median:.1f} ms (median), {late:.1f} ms (99 of 100)'
    return facts


def _warnings(moments: Sequence[Snapshot]) -> list[str]:
    empty = sum(not moment.ways for moment in moments)
    statuses = Counter(status for moment in moments for _, status in moment.unsolved)
    warnings = [] if moments else ['There is no prediction.']
    warnings += [f'In {empty} of {len(moments)} predictions no candidate could be solved.'] if empty else []
    warnings += [f'{count} candidate{"s" if count > 1 else ""} ended as {status}.' for status, count in sorted(statuses.items())]
    return warnings


def _numbers(title: str, track: Track, moments: Sequence[Snapshot], summary: Mapping[str, str]) -> dict[str, Any]:
    return {
        'title': title,
        'summary': {**_facts(moments), **summary},
        'warnings': _warnings(moments),
        'hand_samples': len(track.stamps_ns),
        'predictions': [
            {
                'stamp_ns': moment.stamp_ns,
                't_s': round((moment.stamp_ns - int(track.stamps_ns[0])) / NANOSECONDS, 6),
                'most_likely': moment.most_likely,
                'candidates': [
                    {
                        'label': way.label,
                        'likelihood': rounded(way.likelihood),
                        'effort': rounded(way.effort),
                        'cost_ratio': rounded(way.cost_ratio),
                        'eta': rounded(way.eta),
                        'end': [rounded(value) for value in way.path[-1]],
                    }
                    for way in moment.ways
                ],
                'unsolved': dict(moment.unsolved),
            }
            for moment in moments
        ],
    }
