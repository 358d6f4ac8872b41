# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Predictions as the node has sent them: the inverse of `ros.messages.encode_prediction`."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from typing import Any

import numpy as np

from foc_ros.core.errors import MessageError
from foc_ros.core.obstacle_table import Obstacles
from foc_ros.core.solution import describe_class
from foc_ros.core.types import Array
from foc_ros.ros.messages.decode_poses import decode_stamp
from foc_ros.ros.messages.encode_prediction import CLOUD_ROW, LIKELIHOOD_COLUMNS, OTHER, STAMP, STATUSES, UNKNOWN
from foc_ros.ros.messages.plane import project

from .views import CandidateView, Snapshot, parse_label


def is_same_prediction(cloud: Any, likelihoods: Any) -> bool:
    """Whether messages of `~/prediction` and `~/likelihoods` hold the same prediction."""
    return bool(likelihoods.layout.dim[2].label == f'{STAMP}{decode_stamp(cloud.header)}')


def read_snapshot(cloud: Any, likelihoods: Any, plane: str, obstacles: Obstacles, goals: Array) -> Snapshot:
    """Return the snapshot in a pair of messages of `~/prediction` and `~/likelihoods`: inverse of `messages.encode_prediction`.

    obstacles and goals (g, 2) [m] are those at the stamp of the messages. Raises MessageError if the two messages hold different
    predictions.
    """
    if not is_same_prediction(cloud, likelihoods):
        raise MessageError('likelihoods', 'those of the prediction', 'those of another prediction')
    rows, columns = _read_cloud(cloud), np.asarray(likelihoods.data, dtype=float).reshape(-1, len(LIKELIHOOD_COLUMNS))
    labels = likelihoods.layout.dim[0].label.split(';') if len(columns) else []
    shares = {UNKNOWN: 0.0 if labels else 1.0, OTHER: 0.0}
    while labels and labels[-1] in shares:
        shares[labels[-1]], labels, columns = float(columns[-1, 0]), labels[:-1], columns[:-1]
    candidates = []
    for number, (label, values) in enumerate(zip(labels, columns, strict=True)):
        name = label, _describe_label(label, obstacles.ids, len(goals))
        candidates.append(_read_candidate(name, values, rows[rows['candidate'] == number], plane))
    cleared = []
    if len(rows) and len(obstacles):
        height = project(np.stack([rows[axis].astype(float) for axis in 'xyz'], axis=-1), plane)[1]
        is_cleared = (height.min() > obstacles.heights[:, 1]) | (height.max() < obstacles.heights[:, 0])
        cleared = [name for name, is_out in zip(obstacles.ids, is_cleared, strict=True) if is_out]
    most_likely = candidates[0].label if candidates else None
    return Snapshot(
        decode_stamp(cloud.header),
        obstacles,
        goals,
        tuple(candidates),
        most_likely,
        cleared=cleared,
        unknown_share=shares[UNKNOWN],
        other_share=shares[OTHER],
    )


def _read_candidate(name: tuple[str, str], values: Array, rows: Any, plane: str) -> CandidateView:
    def stack(names: Sequence[str]) -> Array:
        return np.stack([rows[name].astype(float) for name in names], axis=-1)

    path, _ = project(stack('xyz'), plane)
    velocity, _ = project(stack(('vx', 'vy', 'vz')), plane)
    covariances = []
    for prefix in ('', 'motor_'):
        pairs = [prefix + pair for pair in ('xx', 'xy', 'xz', 'xy', 'yy', 'yz', 'xz', 'yz', 'zz')]
        half, _ = project(stack(pairs).reshape(-1, 3, 3), plane)
        covariances.append(project(half.swapaxes(1, 2), plane)[0])
    likelihood, effort, cost_ratio, eta = values.tolist()
    head = *name, STATUSES[int(rows['status'][0])], likelihood, effort, cost_ratio, eta
    return CandidateView(*head, rows['t'].astype(float), path, velocity, covariances[0], covariances[1], int(rows['way'][0]))


def _read_cloud(cloud: Any) -> Any:
    if cloud.point_step != CLOUD_ROW.itemsize:
        raise MessageError('point_step', str(CLOUD_ROW.itemsize), cloud.point_step)
    return np.frombuffer(cloud.data, dtype=CLOUD_ROW) if len(cloud.data) else np.zeros(0, dtype=CLOUD_ROW)


def _describe_label(label: str, ids: Collection[str], goals: int) -> str:
    """Return the class of a label in words, with its goal if there are several goals; empty if it names an unknown obstacle."""
    goal, sides = parse_label(label, ids)
    is_read = len(label) == len(goal) + 1 + sum(1 + len(name) for name in sides)
    return describe_class(sides.items(), goal if goals > 1 else '') if is_read else ''
