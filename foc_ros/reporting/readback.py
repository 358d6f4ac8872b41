"""The node's outputs read back: the inverse of `conversions.outputs`, as far as messages tell."""

from __future__ import annotations

from typing import Any

import numpy as np

from foc_ros.core.errors import MessageError
from foc_ros.core.types import Array, Obstacles
from foc_ros.ros.messages.inputs import stamp_of
from foc_ros.ros.messages.outputs import CLOUD_ROW, LIKELIHOOD_COLUMNS
from foc_ros.ros.messages.plane import project

from .snapshots import CandidateView, Snapshot


def belong_together(cloud: Any, likelihoods: Any) -> bool:
    """Whether a prediction and a table of likelihoods, which carries no stamp, tell of the same candidates."""
    table, rows = _table(cloud), _rows(likelihoods)
    _, first = np.unique(table['candidate'], return_index=True)
    return np.array_equal(table['likelihood'][first], rows[:, 0].astype(np.float32))


def snapshot_of_messages(cloud: Any, likelihoods: Any, plane: str, obstacles: Obstacles, goals: Array) -> Snapshot:
    """Return what `~/prediction` and `~/likelihoods` of one hand sample say; obstacles and goals are those at its stamp.

    Raises MessageError where the two do not belong together.
    """
    if not belong_together(cloud, likelihoods):
        raise MessageError('likelihoods', 'those of the prediction', 'others')
    table, rows = _table(cloud), _rows(likelihoods)
    labels = likelihoods.layout.dim[0].label.split(';') if len(rows) else []
    ways = tuple(
        _way(label, row, table[table['candidate'] == i], plane) for i, (label, row) in enumerate(zip(labels, rows, strict=True))
    )
    return Snapshot(stamp_of(cloud.header), obstacles, goals, ways, ways[0].label if ways else None)


def _way(label: str, row: Array, samples: Any, plane: str) -> CandidateView:
    likelihood, effort, cost_ratio, eta = (float(value) for value in row)
    path, _ = project(_columns(samples, 'x y z'), plane)
    velocity, _ = project(_columns(samples, 'vx vy vz'), plane)
    space = _columns(samples, 'xx xy xz xy yy yz xz yz zz').reshape(-1, 3, 3)
    half, _ = project(space, plane)
    covariance, _ = project(half.swapaxes(1, 2), plane)
    times = samples['t'].astype(float)
    return CandidateView(label, likelihood, effort, cost_ratio, eta, times, path, np.linalg.norm(velocity, axis=1), covariance)


def _columns(samples: Any, names: str) -> Array:
    return np.stack([samples[name].astype(float) for name in names.split()], axis=-1)


def _table(cloud: Any) -> Any:
    if cloud.point_step != CLOUD_ROW.itemsize:
        raise MessageError('point_step', str(CLOUD_ROW.itemsize), cloud.point_step)
    return np.frombuffer(cloud.data, dtype=CLOUD_ROW) if len(cloud.data) else np.zeros(0, dtype=CLOUD_ROW)


def _rows(likelihoods: Any) -> Array:
    return np.asarray(likelihoods.data, dtype=float).reshape(-1, len(LIKELIHOOD_COLUMNS))
