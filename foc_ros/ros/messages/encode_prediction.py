# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Encoding of a prediction: a cloud with the whole answer, a table of likelihoods, the most likely path, and markers.

The cloud, the table and the path hold the candidates with a likelihood only: solved and compromised ones. A candidate's index is
its rank, so the most likely one has index 0. All messages carry the stamp and the frame of the hand sample.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from foc_ros.core.prediction import PredictedCandidate, Prediction
from foc_ros.core.solution import Status
from foc_ros.core.types import NANOSECONDS

from .encode_inputs import encode_array, encode_hand_pose, encode_table
from .encode_markers import encode_markers
from .plane import lift
from .ranking import compute_cost_ratios, order_candidates
from .types import MessageTypes, make_header

_PAIRS = ('xx', 'xy', 'xz', 'yy', 'yz', 'zz')
_MOTOR = 'motor_'
CLOUD_ROW = np.dtype(
    [
        *((name, '<f4') for name in ('x', 'y', 'z', 't', 'vx', 'vy', 'vz', *_PAIRS)),
        ('candidate', '<u4'),
        ('likelihood', '<f4'),
        ('compromised', '<u4'),
        *((_MOTOR + pair, '<f4') for pair in _PAIRS),
        ('goal', '<u4'),
        ('way', '<u4'),
        ('status', '<u4'),
    ]
)
"""One time sample of one candidate [m, s, m/s, m^2]; compromised: 1 if eta is below the wanted one, or may be; goal: row; way:
number of the class; status: row of `STATUSES`."""
STATUSES = Status.SOLVED, Status.COMPROMISED, Status.ESTIMATED, Status.DEADLINE
"""Statuses with a likelihood."""
STAMP = 'stamp_ns:'
"""Beginning of the label with the stamp [ns] of a table of likelihoods, whose message has no header."""
UNKNOWN, OTHER = 'unknown', 'other'
"""Labels of the shares that no candidate has: of classes that are unknown, and of a goal that nobody announced."""
GOAL_LIKELIHOOD_TYPE = 'std_msgs/msg/Float64'
LIKELIHOOD_COLUMNS = ('likelihood', 'effort', 'cost_ratio', 'eta')


def encode_prediction_cloud(prediction: Prediction, plane: str, types: MessageTypes) -> Any:
    """Encode all candidates with a likelihood as a PointCloud2 of N + 1 rows each; no rows if there are none."""
    outcomes = order_candidates(prediction)
    rows = _tabulate(outcomes, prediction.height, plane) if outcomes else np.zeros(0, dtype=CLOUD_ROW)
    return encode_table(types, make_header(types, prediction.stamp_ns, prediction.frame_id), rows)


def _tabulate(outcomes: Sequence[PredictedCandidate], height: float, plane: str) -> NDArray[np.void]:
    """Return the rows of candidates, one after the other, filled column by column; height: where none is predicted [m]."""
    solutions = [outcome.solution for outcome in outcomes]
    lengths = [len(solution.mean) for solution in solutions]
    rows = np.zeros(sum(lengths), dtype=CLOUD_ROW)
    mean = np.concatenate([solution.mean for solution in solutions])
    for place, axis in enumerate(plane):
        rows[axis], rows['v' + axis] = mean[:, place], mean[:, 2 + place]
    normal = next(axis for axis in 'xyz' if axis not in plane)  # its covariances with the axes of the plane are zero
    rows[normal] = height
    heights = [outcome.height for outcome in outcomes if outcome.height is not None]
    if heights:
        rows[normal], rows['v' + normal] = np.concatenate([each.mean[:, :2] for each in heights]).T
        rows[2 * normal] = np.concatenate([each.covariance[:, 0, 0] for each in heights])
        rows[_MOTOR + 2 * normal] = np.concatenate([each.motor_covariance[:, 0, 0] for each in heights])
    for prefix, name in (('', 'covariance'), (_MOTOR, 'motor_covariance')):
        covariance = np.concatenate([getattr(outcome, name)[:, :2, :2] for outcome in outcomes])
        rows[prefix + 2 * plane[0]], rows[prefix + 2 * plane[1]] = covariance[:, 0, 0], covariance[:, 1, 1]
        rows[prefix + plane] = covariance[:, 0, 1]
    rows['t'] = np.concatenate([solution.times for solution in solutions])
    rows['candidate'] = np.repeat(range(len(outcomes)), lengths)
    rows['likelihood'] = np.repeat([each.likelihood for each in outcomes], lengths)
    rows['goal'] = np.repeat([each.candidate.goal for each in outcomes], lengths)
    rows['way'] = np.repeat([each.way for each in outcomes], lengths)
    rows['compromised'] = np.repeat([not each.is_solved for each in outcomes], lengths)
    rows['status'] = np.repeat([STATUSES.index(solution.status) for solution in solutions], lengths)
    return rows


def encode_likelihoods(prediction: Prediction, types: MessageTypes) -> Any:
    """Encode one row per candidate with a likelihood, with the columns LIKELIHOOD_COLUMNS, as a Float64MultiArray.

    Shares that no candidate has come last, without the other numbers: rows `UNKNOWN` and `OTHER`, if above 0.
    """
    outcomes, shares = order_candidates(prediction), _list_shares(prediction)
    ratios = compute_cost_ratios(outcomes)
    rows = [(each.likelihood, each.effort, ratio, each.eta) for each, ratio in zip(outcomes, ratios, strict=True)]
    rows += [(share, math.nan, math.nan, math.nan) for share in shares.values()]
    labels, width = ';'.join([*(outcome.label for outcome in outcomes), *shares]), len(LIKELIHOOD_COLUMNS)
    stamp = f'{STAMP}{prediction.stamp_ns}', 1, 1
    dimensions = (labels, len(rows), width * len(rows)), (','.join(LIKELIHOOD_COLUMNS), width, width), stamp
    return encode_array(types, np.array(rows, dtype=float), dimensions)


def _list_shares(prediction: Prediction) -> dict[str, float]:
    shares = {UNKNOWN: prediction.unknown, OTHER: prediction.other}
    return {name: share for name, share in shares.items() if share > 0.0}


def encode_likelihoods_by_name(prediction: Prediction, types: MessageTypes) -> Any:
    """Encode the likelihoods by the names of goals and the labels of classes as a DiagnosticArray, which tools plot by name."""
    classes = {outcome.label: outcome.likelihood for outcome in order_candidates(prediction)}
    goals = {goal.name: goal.likelihood for goal in prediction.goals if goal.likelihood is not None}
    statuses = []
    for name, rows in (('goals', goals), ('classes', classes)):
        items = (rows | _list_shares(prediction)).items()
        statuses.append({'name': name, 'values': [(key, f'{share:.6g}') for key, share in items]})
    header = make_header(types, prediction.stamp_ns, prediction.frame_id)
    return types.fill('diagnostic_msgs/msg/DiagnosticArray', (header, statuses))


def encode_goal_likelihoods(prediction: Prediction, types: MessageTypes) -> dict[int, Any]:
    """Encode the likelihood of each goal of which something is known as a std_msgs/Float64, by its row."""
    order_candidates(prediction)  # raises FocError for a number that is not finite
    goals = enumerate(prediction.goals)
    return {row: types.make(GOAL_LIKELIHOOD_TYPE, data=goal.likelihood) for row, goal in goals if goal.likelihood is not None}


def encode_path(prediction: Prediction, plane: str, types: MessageTypes) -> Any:
    """Encode the most likely candidate as a nav_msgs/Path with stamps in the future; no poses if nothing was solved."""
    stamp_ns, frame_id = prediction.stamp_ns, prediction.frame_id
    poses: list[Any] = []
    for outcome in order_candidates(prediction)[:1]:
        height = prediction.height if outcome.height is None else outcome.height.mean[:, 0]
        points = lift(outcome.solution.path, height, plane).tolist()
        for seconds, point in zip(outcome.solution.times.tolist(), points, strict=True):
            poses.append(encode_hand_pose(types, stamp_ns + round(seconds * NANOSECONDS), frame_id, point))
    return types.fill('nav_msgs/msg/Path', (make_header(types, stamp_ns, frame_id), poses))


OUTPUTS: dict[str, tuple[str, Callable[[Prediction, str, MessageTypes], Any]]] = {
    'prediction': ('sensor_msgs/msg/PointCloud2', encode_prediction_cloud),
    'likelihoods': ('std_msgs/msg/Float64MultiArray', lambda given, _, types: encode_likelihoods(given, types)),
    'likelihoods_by_name': (
        'diagnostic_msgs/msg/DiagnosticArray',
        lambda given, _, types: encode_likelihoods_by_name(given, types),
    ),
    'path': ('nav_msgs/msg/Path', encode_path),
    'markers': ('visualization_msgs/msg/MarkerArray', encode_markers),
}
"""Message type and encoder of every output, by the name of its topic below the node's name."""


def encode_outputs(prediction: Prediction, plane: str, types: MessageTypes, wanted: Iterable[str] = OUTPUTS) -> dict[str, Any]:
    """Encode the wanted outputs, by name. Raises FocError as `order_candidates` does."""
    return {name: OUTPUTS[name][1](prediction, plane, types) for name in wanted}
