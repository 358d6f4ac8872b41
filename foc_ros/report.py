"""A directory that tells of a recording: pictures, one page that holds them all, and the numbers."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from . import plots
from .foc.errors import InputError
from .foc.records import NANOSECONDS
from .moments import Moment, Track, movements
from .report_page import page_of

MOST_PICTURES = 8
FRACTIONS_OF_ONE = (0.1, 0.3, 0.5, 0.7)
"""Where in its time a movement is shown when it is the only one; of several, each is shown once, at FRACTION."""
FRACTION = 0.3
OVERVIEW = (
    'All movements, numbered. Discs are obstacles, in a ring as wide as the standard deviation of their radius; stars are goals.'
)
ONSET_SPEED = 0.05
"""Speed [m/s] above which the pictures take the hand to be moving."""


def write_report(directory: Path, title: str, track: Track, moments: Sequence[Moment], summary: Mapping[str, str]) -> list[Path]:
    """Write pictures, index.html (which holds them, and needs nothing else) and predictions.json; return the files.

    track: the measured hand; moments: the predictions in order; summary: facts to put on top, in words. Files of those names are
    replaced. Raises InputError where the directory cannot be written or the hand has no sample.
    """
    if not len(track.stamps_ns):
        raise InputError('report', 'a recording with a hand pose', 'none')
    try:
        directory.mkdir(parents=True, exist_ok=True)
        pictures = _write_pictures(directory, track, moments)
        page, numbers = directory / 'index.html', directory / 'predictions.json'
        page.write_text(page_of(title, pictures, {**_facts(moments), **summary}, _warnings(moments)), encoding='utf-8')
        numbers.write_text(json.dumps(_numbers(title, track, moments, summary), indent=1, allow_nan=False), encoding='utf-8')
    except OSError as error:
        raise InputError('report directory', 'a directory that can be written', f'{directory}: {error.strerror}') from error
    return [page, numbers, *pictures]


def _write_pictures(directory: Path, track: Track, moments: Sequence[Moment]) -> dict[Path, str]:
    """Return the caption of every picture by its file; the overview comes first."""
    shown = [moment for moment in moments if moment.ways]
    if not shown:
        return {}
    spans = movements(track, ONSET_SPEED) or [(int(track.stamps_ns[0]), int(track.stamps_ns[-1]))]
    chosen = _chosen(shown, spans)
    ways = [way for _, moment in chosen for way in moment.ways]
    goals = np.unique(np.concatenate([moment.goals for moment in shown]), axis=0)
    bounds = plots.bounds_of(shown[0].obstacles, goals, ways, track.positions)
    pictures = {directory / 'overview.png': OVERVIEW}
    plots.save(plots.track_figure(track, shown[0].obstacles, goals, spans, bounds), directory / 'overview.png')
    for count, (number, moment) in enumerate(chosen):
        start_ns, end_ns = spans[number]
        around = [each for each in moments if start_ns <= each.stamp_ns <= end_ns]
        file = directory / f'moment_{count + 1:02d}.png'
        plots.save(plots.moment_figure(track, moment, around, spans[number], bounds), file)
        pictures[file] = f'Movement {number + 1}, {(moment.stamp_ns - start_ns) / NANOSECONDS:.2f} s after its beginning'
    return pictures


def _chosen(shown: Sequence[Moment], spans: Sequence[tuple[int, int]]) -> list[tuple[int, Moment]]:
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


def _facts(moments: Sequence[Moment]) -> dict[str, str]:
    solve_ms = [1e3 * moment.solve_s for moment in moments if moment.solve_s is not None]
    facts = {'predictions': str(len(moments)), 'candidates solved': str(sum(len(moment.ways) for moment in moments))}
    if solve_ms:
        median, late = np.percentile(solve_ms, [50, 99])
        facts['time per prediction'] = f'{median:.1f} ms (median), {late:.1f} ms (99 of 100)'
    return facts


def _warnings(moments: Sequence[Moment]) -> list[str]:
    empty = sum(not moment.ways for moment in moments)
    statuses = Counter(status for moment in moments for _, status in moment.unsolved)
    warnings = [] if moments else ['There is no prediction.']
    warnings += [f'In {empty} of {len(moments)} predictions no candidate could be solved.'] if empty else []
    warnings += [f'{count} candidates ended as {status}.' for status, count in sorted(statuses.items())]
    return warnings


def _numbers(title: str, track: Track, moments: Sequence[Moment], summary: Mapping[str, str]) -> dict[str, Any]:
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
                        'likelihood': _rounded(way.likelihood),
                        'effort': _rounded(way.effort),
                        'cost_ratio': _rounded(way.cost_ratio),
                        'eta': _rounded(way.eta),
                        'end': [_rounded(value) for value in way.path[-1]],
                    }
                    for way in moment.ways
                ],
                'unsolved': dict(moment.unsolved),
            }
            for moment in moments
        ],
    }


def _rounded(value: float) -> float | None:
    """Return six significant digits; None for what JSON has no number for."""
    return float(f'{value:.6g}') if np.isfinite(value) else None
