"""Data of the report page as plain values, small enough for a phone.

Lengths are whole tenths of a millimetre, speeds whole millimetres per second. A list of them holds the first value and then the
differences. Obstacles, goals and labels are stored once and referred to by their row.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import Any

import numpy as np

from foc_ros.core.obstacles.geometry import find_limits
from foc_ros.core.types import NANOSECONDS, Array, Obstacles, make_obstacles

from .drawing import CLASS_COLOURS, ELLIPSES_PER_CANDIDATE, NAMED_OBSTACLES, STDDEVS, Bounds, compute_ellipse_axes
from .plots import compute_bounds
from .snapshots import CandidateView, HandTrajectory, Snapshot, UnsolvedView
from .track_association import CandidateTracks

LENGTH, SPEED, TIME = 1e-4, 1e-3, 1e-3
"""Units [m], [m/s], [s]."""
MOST_FRAMES = 500
"""The slider stops at no more than this many predictions, evenly spread; likelihoods are drawn for all."""
MOST_HAND_SAMPLES = 4000
PATH_POINTS, UNSOLVED_POINTS = 26, 13
DRAWN_PERCENTILES = (0.5, 99.5)
"""Percentiles of the paths' coordinates that fit into the scene: a single outlying prediction does not change its scale."""
Rows = dict[str, int]
"""Rows of values that are stored once."""


class PageData:
    """Builder of the data of a report page from the hand's trajectory and the associated candidates."""

    def __init__(self, hand: HandTrajectory, tracks: CandidateTracks) -> None:
        self._hand, self._tracks = hand, tracks
        self._origin_ns = int(hand.stamps_ns[0])
        self._scenes, self._goals, self._labels = Rows(), Rows(), Rows()

    def build(self, spans: list[tuple[int, int]], bounds: Bounds) -> dict[str, Any]:
        """Return everything that the page draws; spans: start and end [ns] of the movements.

        times [s] after the first hand sample, solve_ms and unknown share of every prediction; tracks: for each its slot, the row
        of its first prediction and its likelihoods from there on; frames: the predictions at which the slider stops.
        """
        snapshots = self._tracks.snapshots
        frames = [self._encode_frame(row) for row in select_evenly(len(snapshots), MOST_FRAMES).tolist()]
        return {
            'unit': {'length': LENGTH, 'speed': SPEED, 'time': TIME},
            'colours': CLASS_COLOURS,
            'named_obstacles': NAMED_OBSTACLES,
            'bounds': [round(each, 4) for each in bounds],
            'times': [self._seconds(each.stamp_ns) for each in snapshots],
            'solve_ms': [None if each.solve_s is None else round(1e3 * each.solve_s, 2) for each in snapshots],
            'tracks': [
                {'slot': self._tracks.slots.get(track), 'first': first, 'share': [round_number(value) for value in values]}
                for track, (first, values) in self._tracks.likelihoods().items()
            ],
            'unknown': [round(each.unknown_share, 3) for each in snapshots],
            'movements': [[self._seconds(stamp) for stamp in span] for span in spans],
            'hand': self._encode_hand(),
            'scenes': [json.loads(scene) for scene in self._scenes],
            'goals': [json.loads(goals) for goals in self._goals],
            'labels': list(self._labels),
            'frames': frames,
        }

    def _encode_frame(self, row: int) -> dict[str, Any]:
        snapshot, tracks = self._tracks.snapshots[row], self._tracks.tracks[row]
        scene = _encode_obstacles(snapshot.obstacles)
        return {
            'at': row,
            'scene': _row_of(json.dumps(scene), self._scenes),
            'goals': _row_of(json.dumps([_quantise(goal, LENGTH) for goal in snapshot.goals]), self._goals),
            'candidates': [
                {
                    'track': tracks[each.label],
                    'label': _row_of(each.label, self._labels),
                    'description': _row_of(each.description, self._labels),
                    **_encode_candidate(each),
                }
                for each in snapshot.candidates
            ],
            'unsolved': [self._encode_unsolved(each) for each in snapshot.unsolved],
        }

    def _encode_unsolved(self, view: UnsolvedView) -> dict[str, Any]:
        texts = {name: _row_of(getattr(view, name), self._labels) for name in ('label', 'description', 'reason')}
        return {**texts, **_encode_points(view.path, UNSOLVED_POINTS)}

    def _encode_hand(self) -> dict[str, Any]:
        rows = select_evenly(len(self._hand.stamps_ns), MOST_HAND_SAMPLES)
        return {
            't': _quantise_differences(self._hand.seconds_after(self._origin_ns)[rows], TIME),
            'x': _quantise_differences(self._hand.positions[rows, 0], LENGTH),
            'y': _quantise_differences(self._hand.positions[rows, 1], LENGTH),
            'v': _quantise_differences(self._hand.speed[rows], SPEED),
        }

    def _seconds(self, stamp_ns: int) -> float:
        return round((stamp_ns - self._origin_ns) / NANOSECONDS, 4)


def compute_recording_bounds(hand: HandTrajectory, snapshots: Sequence[Snapshot]) -> Bounds:
    """Return limits of x and y [m] around the hand, all obstacles and goals, and all but outlying paths."""
    points = [hand.positions]
    for each in snapshots:
        points += [each.goals, *find_limits(each.obstacles, STDDEVS * each.obstacles.radius_stddev)]
    paths = [candidate.path for each in snapshots for candidate in each.candidates]
    points += [np.percentile(np.concatenate(paths), DRAWN_PERCENTILES, axis=0)] if paths else []
    return compute_bounds(make_obstacles(), np.zeros((0, 2)), (), *points, margin=0.06)


def round_number(value: float) -> float | None:
    """Return a number with six significant digits, None if it is not finite: JSON has no such numbers."""
    return float(f'{value:.6g}') if np.isfinite(value) else None


def select_evenly(count: int, most: int) -> np.ndarray[tuple[int], np.dtype[np.intp]]:
    """Return at most so many rows of `count`, evenly spread, the first and the last among them."""
    return np.unique(np.linspace(0, count - 1, min(count, most)).round().astype(np.intp))


def _encode_obstacles(obstacles: Obstacles) -> list[list[str | int]]:
    """Return obstacles: name, centre, radius and its standard deviation, then two vertices or more, relative to the centre."""
    rows = np.column_stack([obstacles.centre, obstacles.radius, STDDEVS * obstacles.radius_stddev])
    polygons = [obstacles.vertices[row, : corners if corners > 1 else 0] for row, corners in enumerate(obstacles.corners)]
    return [
        [name, *_quantise(row, LENGTH), *_quantise(polygon.ravel(), LENGTH)]
        for name, row, polygon in zip(obstacles.ids, rows, polygons, strict=True)
    ]


def _encode_candidate(candidate: CandidateView) -> dict[str, Any]:
    """Return one candidate.

    t and v: at some of the steps; motor: ellipses of the motor noise; total: of the total uncertainty, none if that is the same.
    """
    points = select_evenly(len(candidate.path), PATH_POINTS)
    marks = select_evenly(len(candidate.path), ELLIPSES_PER_CANDIDATE + 1)[1:]
    return {
        'ratio': round_number(candidate.cost_ratio),
        'eta': round_number(candidate.eta),
        'compromised': candidate.is_compromised,
        **_encode_points(candidate.curve, PATH_POINTS),
        't': _quantise_differences(candidate.times[points], TIME),
        'v': _quantise_differences(candidate.speed[points], SPEED),
        'motor': _encode_ellipses(candidate.path[marks], candidate.motor_covariance[marks]),
        'total': _encode_ellipses(candidate.path[marks], candidate.covariance[marks]) if candidate.is_widened else [],
    }


def _encode_ellipses(centres: Array, covariance: Array) -> list[list[int]]:
    """Return ellipses: x, y, greater and smaller standard deviation, angle of the greater [degrees]."""
    greater, smaller, angle = compute_ellipse_axes(covariance)
    lengths = np.column_stack([centres, STDDEVS * greater, STDDEVS * smaller])
    return [[*_quantise(each, LENGTH), round(degrees)] for each, degrees in zip(lengths, angle.tolist(), strict=True)]


def _encode_points(path: Array, most: int) -> dict[str, list[int]]:
    points = path[select_evenly(len(path), most)]
    return {'x': _quantise_differences(points[:, 0], LENGTH), 'y': _quantise_differences(points[:, 1], LENGTH)}


def _row_of(text: str, rows: Rows) -> int:
    """Return the row of a text, a new row if the text is new."""
    return rows.setdefault(text, len(rows))


def _quantise(values: Array, unit: float) -> list[int]:
    return [int(value) for value in np.rint(values / unit)]


def _quantise_differences(values: Array, unit: float) -> list[int]:
    """Return the first value and then the differences, in whole units."""
    return [int(value) for value in np.diff(np.rint(values / unit).astype(np.int64), prepend=0)]
