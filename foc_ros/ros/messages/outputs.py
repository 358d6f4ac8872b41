"""A prediction as messages: a cloud with the whole answer, a table of likelihoods, the most likely path, and markers.

Only candidates that were solved are in the cloud, the table and the path; their index is their place in the ranking, so index 0
is the most likely one. All messages carry the stamp and the frame of the hand sample.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from foc_ros.core.types import NANOSECONDS, Obstacles, PredictedCandidate, Prediction

from .markers import marker_array
from .plane import lift
from .ranking import cost_ratios, ranked
from .types import MessageTypes, header

_FLOATS = ('x', 'y', 'z', 't', 'vx', 'vy', 'vz', 'xx', 'xy', 'xz', 'yy', 'yz', 'zz')
CLOUD_ROW = np.dtype([*((name, '<f4') for name in _FLOATS), ('candidate', '<u4'), ('likelihood', '<f4')])
"""One time sample of one candidate [m, s, m/s, m^2]."""

_DATATYPES = {'<f4': 7, '<u4': 6}
LIKELIHOOD_COLUMNS = ('likelihood', 'effort', 'cost_ratio', 'eta')


def prediction_cloud(prediction: Prediction, plane: str, types: MessageTypes) -> Any:
    """Return the PointCloud2 of all solved candidates, N + 1 rows each; no rows where nothing was solved."""
    table = _rows(ranked(prediction), prediction.height, plane)
    return types.make(
        'sensor_msgs/msg/PointCloud2',
        header=header(types, prediction.stamp_ns, prediction.frame_id),
        height=1,
        width=len(table),
        fields=_fields(types),
        point_step=CLOUD_ROW.itemsize,
        row_step=table.nbytes,
        data=table.tobytes(),
        is_dense=True,
    )


@lru_cache(maxsize=4)
def _fields(types: MessageTypes) -> list[Any]:
    """Return the description of a row, the same in every cloud."""
    return [
        types.make('sensor_msgs/msg/PointField', name=name, offset=offset, datatype=_DATATYPES[kind.str], count=1)
        for name, (kind, offset, *_) in (CLOUD_ROW.fields or {}).items()
    ]


def _rows(outcomes: Sequence[PredictedCandidate], height: float, plane: str) -> NDArray[np.void]:
    """Return the rows of all outcomes, one after the other, filled column by column."""
    solutions = [outcome.solution for outcome in outcomes]
    lengths = [len(solution.mean) for solution in solutions]
    rows = np.zeros(sum(lengths), dtype=CLOUD_ROW)
    if not len(rows):
        return rows
    mean = np.concatenate([solution.mean for solution in solutions])
    covariance = np.concatenate([solution.covariance[:, :2, :2] for solution in solutions])
    for place, axis in enumerate(plane):
        rows[axis], rows['v' + axis], rows[axis + axis] = mean[:, place], mean[:, 2 + place], covariance[:, place, place]
    rows[plane], rows[next(axis for axis in 'xyz' if axis not in plane)] = covariance[:, 0, 1], height
    rows['t'] = np.concatenate([solution.times for solution in solutions])
    rows['candidate'] = np.repeat(np.arange(len(outcomes)), lengths)
    rows['likelihood'] = np.repeat([outcome.likelihood for outcome in outcomes], lengths)
    return rows


def likelihood_array(prediction: Prediction, types: MessageTypes) -> Any:
    """Return the Float64MultiArray, one row per solved candidate, columns LIKELIHOOD_COLUMNS; labels are in the layout.

    The first dimension's label joins the candidates' labels by ';'. effort: to go [m^2/s^6]; cost_ratio: to the least cost.
    """
    outcomes = ranked(prediction)
    rows = [
        (outcome.likelihood, outcome.solution.effort, ratio, outcome.solution.eta)
        for outcome, ratio in zip(outcomes, cost_ratios(outcomes), strict=True)
    ]
    labels, width = ';'.join(outcome.candidate.label for outcome in outcomes), len(LIKELIHOOD_COLUMNS)
    dimensions = [(labels, len(rows), width * len(rows)), (','.join(LIKELIHOOD_COLUMNS), width, width)]
    return types.make(
        'std_msgs/msg/Float64MultiArray',
        layout=types.make(
            'std_msgs/msg/MultiArrayLayout',
            dim=[
                types.make('std_msgs/msg/MultiArrayDimension', label=label, size=size, stride=stride)
                for label, size, stride in dimensions
            ],
        ),
        data=np.array(rows, dtype=float).ravel(),
    )


def path(prediction: Prediction, plane: str, types: MessageTypes) -> Any:
    """Return the nav_msgs/Path of the most likely candidate, stamps of the poses in the future; empty where there is none."""
    poses: list[Any] = []
    for outcome in ranked(prediction)[:1]:
        points = lift(outcome.solution.path, prediction.height, plane).tolist()
        orientation = types.make('geometry_msgs/msg/Quaternion', w=1.0)
        for seconds, (x, y, z) in zip(outcome.solution.times.tolist(), points, strict=True):
            stamp_ns = prediction.stamp_ns + round(seconds * NANOSECONDS)
            position = types.make('geometry_msgs/msg/Point', x=x, y=y, z=z)
            pose = types.make('geometry_msgs/msg/Pose', position=position, orientation=orientation)
            head = header(types, stamp_ns, prediction.frame_id)
            poses.append(types.make('geometry_msgs/msg/PoseStamped', header=head, pose=pose))
    return types.make('nav_msgs/msg/Path', header=header(types, prediction.stamp_ns, prediction.frame_id), poses=poses)


Builder = Callable[[Prediction, Obstacles, str, MessageTypes], Any]
OUTPUTS: dict[str, tuple[str, Builder]] = {
    'prediction': ('sensor_msgs/msg/PointCloud2', lambda prediction, _, plane, types: prediction_cloud(prediction, plane, types)),
    'likelihoods': ('std_msgs/msg/Float64MultiArray', lambda prediction, _, __, types: likelihood_array(prediction, types)),
    'path': ('nav_msgs/msg/Path', lambda prediction, _, plane, types: path(prediction, plane, types)),
    'markers': ('visualization_msgs/msg/MarkerArray', marker_array),
}
"""Type and maker of every output, by the name of its topic below the node's name."""


def output_messages(
    prediction: Prediction, obstacles: Obstacles, plane: str, types: MessageTypes, wanted: Iterable[str] = OUTPUTS
) -> dict[str, Any]:
    """Return the wanted outputs by name. obstacles: at the prediction's stamp, to be drawn. Raises FocError as `ranked` does."""
    return {name: OUTPUTS[name][1](prediction, obstacles, plane, types) for name in wanted}
