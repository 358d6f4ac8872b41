"""What the page of a report draws, as plain values: small, for it is read by a phone.

Lengths are whole tenths of a millimetre, speeds whole millimetres per second; of a list of them the first is given, then the
differences. What does not change from one prediction to the next (obstacles, goals, labels) is given once and named by its row.
"""

from __future__ import annotations

import json
from collections.abc import Hashable, Mapping, Sequence
from typing import Any, Generic, TypeVar

import numpy as np

from foc_ros.core.types import NANOSECONDS, Array

from .drawing import CLASS_COLOURS, CLASSES
from .snapshots import CandidateView, Snapshot, Track
from .track_association import associate_tracks, slots

LENGTH, SPEED = 1e-4, 1e-3
"""Units [m], [m/s]."""
MOST_SHOWN = 500
"""Predictions that the slider stops at; of more, these many evenly spread. Likelihoods are drawn of all."""
MOST_HAND = 4000
"""Hand samples that are drawn."""
PATH_POINTS, ELLIPSES = 26, 8
MARGIN = 0.06
RARE = (0.5, 99.5)
"""Percentiles of the paths' coordinates that the scene is drawn to: one wild prediction shall not make all others small."""
Kept = TypeVar('Kept', bound=Hashable)


class Rows(Generic[Kept]):
    """Values that are kept once and named by their row."""

    def __init__(self) -> None:
        self._rows: dict[Kept, int] = {}

    def row(self, value: Kept) -> int:
        """Return the row of a value, a new one where it is new."""
        return self._rows.setdefault(value, len(self._rows))

    @property
    def values(self) -> list[Kept]:
        """All values, by row."""
        return list(self._rows)


def page_data(track: Track, moments: Sequence[Snapshot], spans: Sequence[tuple[int, int]]) -> dict[str, Any]:
    """Return what the page draws; spans: start and end [ns] of the movements.

    times [s] from the first hand sample on, of every prediction, with its solve_ms and the likelihoods of every line: a way as
    it goes on from one prediction to the next, `first` and `share` of it, and the `slot` that gives letter and colour.
    """
    origin_ns = int(track.stamps_ns[0])
    lines = associate_tracks(moments)
    scenes, goals, labels = Rows[str](), Rows[str](), Rows[str]()
    shown = evenly(len(moments), MOST_SHOWN)
    frames = [_frame(row, moments[row], lines[row], scenes, goals, labels) for row in shown.tolist()]
    return {
        'unit': {'length': LENGTH, 'speed': SPEED},
        'colours': CLASS_COLOURS,
        'bounds': _bounds(track, moments),
        'times': [_seconds(moment.stamp_ns, origin_ns) for moment in moments],
        'solve_ms': [None if moment.solve_s is None else round(1e3 * moment.solve_s, 2) for moment in moments],
        'lines': _lines(moments, lines, slots(moments, lines, CLASSES, len(CLASS_COLOURS))),
        'movements': [[_seconds(stamp, origin_ns) for stamp in span] for span in spans],
        'hand': _hand(track, origin_ns),
        'scenes': [json.loads(scene) for scene in scenes.values],
        'goals': [json.loads(places) for places in goals.values],
        'labels': labels.values,
        'frames': frames,
    }


def rounded(value: float) -> float | None:
    """Return six significant digits; None for what JSON has no number for."""
    return float(f'{value:.6g}') if np.isfinite(value) else None


def evenly(count: int, most: int) -> np.ndarray[tuple[int], np.dtype[np.intp]]:
    """Return at most so many rows of `count`, evenly spread, the first and the last among them."""
    return np.unique(np.linspace(0, count - 1, min(count, most)).round().astype(np.intp))


def _frame(
    row: int, moment: Snapshot, numbers: Mapping[str, int], scenes: Rows[str], goals: Rows[str], labels: Rows[str]
) -> dict[str, Any]:
    obstacles = moment.obstacles
    discs = np.column_stack([obstacles.centre, obstacles.radius, obstacles.radius_stddev])
    scene = [[name, *_whole(disc, LENGTH)] for name, disc in zip(obstacles.ids, discs, strict=True)]
    return {
        'at': row,
        'scene': scenes.row(json.dumps(scene)),
        'goals': goals.row(json.dumps([_whole(goal, LENGTH) for goal in moment.goals])),
        'ways': [{'line': numbers[way.label], 'label': labels.row(way.label), **_way(way)} for way in moment.ways],
        'lost': [[labels.row(label), labels.row(status)] for label, status in moment.unsolved],
    }


def _way(way: CandidateView) -> dict[str, Any]:
    """Return one way; ellipses: x, y, greater and smaller standard deviation, angle of the greater [degrees] of each."""
    points, marks = evenly(len(way.path), PATH_POINTS), evenly(len(way.path), ELLIPSES + 1)[1:]
    variances, vectors = np.linalg.eigh(way.covariance[marks])
    axes = np.sqrt(np.maximum(variances, 0.0))[:, ::-1]
    angles = np.degrees(np.arctan2(vectors[:, 1, 1], vectors[:, 0, 1]))
    return {
        'ratio': rounded(way.cost_ratio),
        'eta': rounded(way.eta),
        'x': _steps(way.path[points, 0], LENGTH),
        'y': _steps(way.path[points, 1], LENGTH),
        't': _steps(way.times[points], 1e-3),
        'v': _steps(way.speed[points], SPEED),
        'ellipses': [
            [*_whole(way.path[mark], LENGTH), *_whole(pair, LENGTH), round(angle)]
            for mark, pair, angle in zip(marks, axes, angles, strict=True)
        ],
    }


def _lines(moments: Sequence[Snapshot], lines: Sequence[Mapping[str, int]], slot: Mapping[int, int]) -> list[dict[str, Any]]:
    """Return every line with its likelihoods from its first prediction to its last, None where it was no candidate."""
    found: dict[int, dict[int, float | None]] = {}
    for row, (moment, numbers) in enumerate(zip(moments, lines, strict=True)):
        for way in moment.ways:
            found.setdefault(numbers[way.label], {})[row] = rounded(way.likelihood)
    return [
        {'slot': slot.get(line), 'first': min(known), 'share': [known.get(row) for row in range(min(known), max(known) + 1)]}
        for line, known in sorted(found.items())
    ]


def _hand(track: Track, origin_ns: int) -> dict[str, Any]:
    rows = evenly(len(track.stamps_ns), MOST_HAND)
    return {
        't': _steps((track.stamps_ns[rows] - origin_ns) / NANOSECONDS, 1e-3),
        'x': _steps(track.positions[rows, 0], LENGTH),
        'y': _steps(track.positions[rows, 1], LENGTH),
        'v': _steps(np.linalg.norm(track.velocity[rows], axis=1), SPEED),
    }


def _bounds(track: Track, moments: Sequence[Snapshot]) -> list[float]:
    """Return limits of x, then of y [m], that hold hand, goals, obstacles and nearly all of the paths."""
    points = [track.positions]
    for moment in moments:
        reach = (moment.obstacles.radius + moment.obstacles.radius_stddev)[:, None]
        points += [moment.goals, moment.obstacles.centre - reach, moment.obstacles.centre + reach]
    paths = [way.path for moment in moments for way in moment.ways]
    if paths:
        points.append(np.percentile(np.concatenate(paths), RARE, axis=0))
    everything = np.concatenate(points)
    low, high = everything.min(axis=0), everything.max(axis=0)
    margin = MARGIN * max(*(high - low), 0.05)
    return [round(float(each), 4) for pair in zip(low - margin, high + margin, strict=True) for each in pair]


def _seconds(stamp_ns: int, origin_ns: int) -> float:
    return round((stamp_ns - origin_ns) / NANOSECONDS, 4)


def _whole(values: Array, unit: float) -> list[int]:
    return [int(value) for value in np.rint(np.asarray(values) / unit)]


def _steps(values: Array, unit: float) -> list[int]:
    """Return the first value and then the differences, in whole units."""
    whole = np.rint(np.asarray(values) / unit).astype(np.int64)
    return [int(value) for value in np.diff(whole, prepend=0)]
