# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Predictions as plain values for pages, small enough for a phone; `page/scene.js` draws them.

Lengths are whole tenths of a millimetre, speeds whole millimetres per second. A list of them holds the first value and then the
differences.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from functools import lru_cache
from typing import Any

import numpy as np

from foc_ros.core.obstacle_table import make_obstacles
from foc_ros.core.obstacles.geometry import find_limits
from foc_ros.core.prediction import PredictedCandidate, Prediction
from foc_ros.core.types import NANOSECONDS, Array
from foc_ros.ros.messages.ranking import compute_cost_ratios, describe_candidate, find_drawn_curve, find_drawn_curves

from .draw import ELLIPSES_PER_CANDIDATE, NAMED_OBSTACLES, Span, compute_bounds, compute_ellipse_axes, find_apart
from .views import (
    LIKELY,
    NOTED,
    CandidateTracks,
    HandTrajectory,
    choose_moment,
    count_likely_paths,
    describe_ghosts,
    list_unsolved,
)

LENGTH, SPEED, TIME = 1e-4, 1e-3, 1e-3
"""Units [m], [m/s], [s]."""
MOST_FRAMES, MOST_TIMES, MOST_HAND_SAMPLES = 500, 4000, 4000
"""Numbers of predictions, evenly spread, at which the slider of a report stops, and of which likelihoods are drawn."""
MOST_BYTES = 1_250_000
"""Size of the data of a report, beyond which the slider stops at fewer predictions."""
PATH_POINTS = 26


def encode_report(hand: HandTrajectory, tracks: CandidateTracks, spans: Sequence[Span]) -> dict[str, Any]:
    """Return everything that the page of a report draws, of at most MOST_BYTES; spans: of the movements.

    count: of the predictions; unknown: the share that no candidate has; tracks: for each its slot, the row of its first
    prediction and its likelihoods from there on; frames: the predictions at which the slider stops; openings: the frame at which
    each movement opens, and opened: the movement that the page shows first. Obstacles, goals and labels are stored once and
    referred to by their row.
    """
    count, most = len(tracks.snapshots), MOST_FRAMES
    known = {'count': count, 'bounds': [round(each, 4) for each in compute_recording_bounds(hand, tracks.snapshots)]}
    kept = select_evenly(count, MOST_TIMES).tolist() if count else []
    tracks = CandidateTracks([tracks.snapshots[row] for row in kept], [tracks.tracks[row] for row in kept], tracks.slots)
    while True:
        data = _ReportData(hand, tracks).build(spans, most) | known
        size = len(json.dumps(data, separators=(',', ':')))
        if size <= MOST_BYTES or most <= 1:
            return data
        most = max(1, int(0.95 * most * MOST_BYTES / size))


class _ReportData:
    def __init__(self, hand: HandTrajectory, tracks: CandidateTracks) -> None:
        self._hand, self._tracks = hand, tracks
        self._origin_ns = int(hand.stamps_ns[0])
        self._scenes: dict[str, int] = {}
        self._goals: dict[str, int] = {}
        self._labels: dict[str, int] = {'': 0}

    def build(self, spans: Sequence[Span], most: int) -> dict[str, Any]:
        """Return the data with at most so many frames."""
        snapshots, hand = self._tracks.snapshots, self._hand
        rows = select_evenly(len(snapshots), most).tolist() if snapshots else []
        stops, frames = [snapshots[row] for row in rows], [self._encode_frame(row) for row in rows]
        openings = [choose_moment(stops, *span) for span in spans]
        counts = [
            0.0 if row is None or not hand.approaches_goal(*span, snapshots) else count_likely_paths(stops[row])
            for row, span in zip(openings, spans, strict=True)
        ]
        samples = select_evenly(len(hand.stamps_ns), MOST_HAND_SAMPLES)
        return {
            'unit': {'speed': SPEED, 'time': TIME},
            'named_obstacles': NAMED_OBSTACLES,
            'times': [self._seconds(each.stamp_ns) for each in snapshots],
            'solve_ms': [round(1e3 * each.solve_s, 2) if each.solve_s else None for each in snapshots],
            'tracks': [
                {'slot': self._tracks.slots.get(track), 'first': first, 'share': [round_number(value) for value in values]}
                for track, (first, values) in self._tracks.likelihoods().items()
            ],
            'unknown': [round(each.unknown + each.other, 3) for each in snapshots],
            'movements': [[self._seconds(stamp) for stamp in span] for span in spans],
            'openings': openings,
            'opened': int(np.argmax(counts)),
            'hand': {
                't': _quantise_differences(hand.seconds_after(self._origin_ns)[samples], TIME),
                'v': _quantise_differences(hand.speed[samples], SPEED),
                **_encode_points(hand.positions[samples], MOST_HAND_SAMPLES),
            },
            'scenes': [json.loads(scene) for scene in self._scenes],
            'goals': [json.loads(goals) for goals in self._goals],
            'labels': list(self._labels),
            'frames': frames,
        }

    def _encode_frame(self, row: int) -> dict[str, Any]:
        snapshot, tracks = self._tracks.snapshots[row], self._tracks.tracks[row]
        obstacles, shapes = snapshot.obstacles, []
        # name, centre, radius and its standard deviation, then two vertices or more, relative to the centre
        for number, corners in enumerate(obstacles.corners):
            own = [*obstacles.centre[number], obstacles.radius[number], obstacles.radius_stddev[number]]
            polygon = obstacles.vertices[number, : corners if corners > 1 else 0].ravel()
            shapes.append([obstacles.ids[number], *_quantise(np.array([*own, *polygon]), LENGTH)])
        scene = json.dumps(shapes)
        goals = json.dumps([_quantise(goal, LENGTH) for goal in snapshot.goal_positions])
        found = zip(snapshot.candidates_with_likelihood, encode_candidates(snapshot), strict=True)
        candidates = [self._store_texts({'track': tracks[each.label], **encoded}) for each, encoded in found]
        return {
            'at': row,
            'scene': self._scenes.setdefault(scene, len(self._scenes)),
            'goals': self._goals.setdefault(goals, len(self._goals)),
            'candidates': candidates,
            'unsolved': [self._store_texts(encode_unsolved(snapshot, each)) for each in list_unsolved(snapshot)],
        }

    def _store_texts(self, encoded: dict[str, Any]) -> dict[str, Any]:
        return {
            name: self._labels.setdefault(value, len(self._labels)) if isinstance(value, str) else value
            for name, value in encoded.items()
        }

    def _seconds(self, stamp_ns: int) -> float:
        return round((stamp_ns - self._origin_ns) / NANOSECONDS, 4)


def encode_candidates(snapshot: Prediction) -> list[dict[str, Any]]:
    """Return the candidates with a likelihood, the most likely first.

    ghost, ghost_at: as of `describe_ghosts`; t and v: at some of the steps; motor: ellipses of the motor noise, none of a
    candidate that is estimated or less than LIKELY; total: of the uncertainty of the most likely candidate, none if that is the
    same. An ellipse has x, y, greater and smaller standard deviation, and the angle of the greater one [degrees].
    """
    shown, goals = snapshot.candidates_with_likelihood, len(snapshot.goal_positions)
    if not shown:
        return []
    mean, times = np.stack([each.mean for each in shown]), np.stack([each.times for each in shown])
    points = select_evenly(mean.shape[1], PATH_POINTS)
    is_widened = shown[0].solution.motor_covariance is not None
    columns = {
        **_encode_points(find_drawn_curves(shown).swapaxes(0, 1), PATH_POINTS),
        't': _quantise_differences(times[:, points], TIME),
        'v': _quantise_differences(np.linalg.norm(mean[:, points, 2:4], axis=-1), SPEED),
    }
    described = zip(shown, compute_cost_ratios(shown), describe_ghosts(snapshot), strict=False)  # the first of all candidates
    return [
        {
            'label': each.label,
            'description': describe_candidate(each, goals),
            'ghost': ghost,
            'ghost_at': None if ghost_at is None else round(ghost_at, 2),
            'ratio': round_number(ratio),
            'eta': round_number(each.eta),
            'compromised': not each.is_solved,
            **{name: values[row] for name, values in columns.items()},
            'motor': _encode_ellipses(each, each.motor_covariance)
            if (row == 0 or each.likelihood >= LIKELY) and not each.is_estimated
            else [],
            'total': _encode_ellipses(each, each.covariance) if row == 0 and is_widened else [],
        }
        for row, (each, ratio, (ghost, ghost_at)) in enumerate(described)
    ]


def encode_unsolved(snapshot: Prediction, candidate: PredictedCandidate) -> dict[str, Any]:
    """Return one candidate without a likelihood."""
    texts = {
        'label': candidate.label,
        'description': describe_candidate(candidate, len(snapshot.goal_positions)),
        'reason': candidate.reason,
        'ghost': candidate.status.value.replace('_', ' '),
    }
    return texts | _encode_points(find_drawn_curve(candidate), PATH_POINTS // 2)


def compute_recording_bounds(hand: HandTrajectory, snapshots: Sequence[Prediction]) -> tuple[float, float, float, float]:
    """Return limits of x and y [m] around the hand, all obstacles and goals, and all but outlying and unlikely paths."""
    points = [hand.positions]
    for each in snapshots:
        points += [each.goal_positions, *find_limits(each.obstacles, each.obstacles.radius_stddev)]
    paths = [find_drawn_curve(candidate) for each in snapshots for candidate in each if candidate.likelihood >= NOTED]
    points += [np.percentile(np.concatenate(paths), (0.5, 99.5), axis=0)] if paths else []
    return compute_bounds(make_obstacles(), np.zeros((0, 2)), (), *points, margin=0.06)


def round_number(value: float) -> float | None:
    """Return a number with six significant digits, None if it is not finite: JSON has no such numbers."""
    return float(f'{value:.6g}') if np.isfinite(value) else None


@lru_cache(maxsize=64)
def select_evenly(count: int, most: int) -> np.ndarray[tuple[int], np.dtype[np.intp]]:
    """Return at most so many rows of `count`, evenly spread, the first and the last among them."""
    rows = np.unique(np.linspace(0, count - 1, min(count, most)).round().astype(np.intp))
    rows.setflags(write=False)
    return rows


def _encode_ellipses(candidate: PredictedCandidate, covariance: Array) -> list[Any]:
    marks = select_evenly(len(candidate.mean), ELLIPSES_PER_CANDIDATE + 1)[1:]
    centres, axes = candidate.mean[marks, :2], compute_ellipse_axes(covariance[marks, :2, :2])
    values = np.column_stack((centres, *axes))[find_apart(centres, axes[0])]
    return _quantise(values, np.array([LENGTH, LENGTH, LENGTH, LENGTH, 1.0]))


def _encode_points(path: Array, most: int) -> dict[str, list[Any]]:
    points = path[..., select_evenly(path.shape[-2], most), :]
    return {'x': _quantise_differences(points[..., 0], LENGTH), 'y': _quantise_differences(points[..., 1], LENGTH)}


def _quantise(values: Array, unit: Array | float) -> list[Any]:
    whole: list[Any] = np.rint(values / unit).astype(np.int64).tolist()
    return whole


def _quantise_differences(values: Array, unit: float) -> list[Any]:
    """Return the first values and then the differences along the last axis, in whole units."""
    differences: list[Any] = np.diff(np.rint(values / unit).astype(np.int64), prepend=0).tolist()
    return differences
