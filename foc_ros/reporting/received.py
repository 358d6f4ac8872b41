# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Predictions as the node has sent them: the inverse of `ros.messages.encode_prediction`."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from typing import Any

import numpy as np

from foc_ros.core.obstacle_table import Obstacles
from foc_ros.core.prediction import PredictedCandidate, Prediction
from foc_ros.core.solution import Candidate, Solution
from foc_ros.core.types import Array
from foc_ros.ros.messages.decode_poses import decode_frame, decode_stamp
from foc_ros.ros.messages.encode_prediction import CLOUD_ROW, LIKELIHOOD_COLUMNS, OTHER, STATUSES, UNKNOWN

from .views import parse_label


def read_snapshot(cloud: Any, likelihoods: Any, plane: str, obstacles: Obstacles, goals: Array) -> Prediction:
    """Return the snapshot in a pair of messages of `~/prediction` and `~/likelihoods`: inverse of `messages.encode_prediction`.

    obstacles and goals (g, 2) [m] are those at the stamp of the messages. Costs are relative to the least one.
    """
    rows = np.frombuffer(cloud.data, dtype=CLOUD_ROW) if len(cloud.data) else np.zeros(0, dtype=CLOUD_ROW)
    columns = np.asarray(likelihoods.data, dtype=float).reshape(-1, len(LIKELIHOOD_COLUMNS))
    labels = likelihoods.layout.dim[0].label.split(';') if len(columns) else []
    shares = {UNKNOWN: 0.0 if labels else 1.0, OTHER: 0.0}
    while labels and labels[-1] in shares:
        shares[labels[-1]], labels, columns = float(columns[-1, 0]), labels[:-1], columns[:-1]
    parts = (rows[rows['candidate'] == number] for number in range(len(labels)))
    read = zip(labels, columns, parts, strict=True)
    candidates = tuple(_read_candidate(label, obstacles.ids, values, part, plane) for label, values, part in read)
    cleared = np.zeros(len(obstacles), dtype=bool)
    if len(rows):
        height = rows[next(axis for axis in 'xyz' if axis not in plane)]
        cleared = (height.min() > obstacles.heights[:, 1]) | (height.max() < obstacles.heights[:, 0])
    return Prediction(
        decode_stamp(cloud.header),
        decode_frame(cloud.header),
        0.0,
        candidates,
        candidates[0].label if candidates else None,
        obstacles=obstacles,
        goal_positions=goals,
        cleared=tuple(cleared.tolist()),
        unknown=shares[UNKNOWN],
        other=shares[OTHER],
    )


def _read_candidate(label: str, ids: Collection[str], values: Array, rows: Any, plane: str) -> PredictedCandidate:
    x, y = plane[0], plane[1]
    mean = _stack(rows, (x, y, f'v{x}', f'v{y}'))
    pairs = x + x, plane, plane, y + y
    total, motor = (_stack(rows, [prefix + pair for pair in pairs]).reshape(-1, 2, 2) for prefix in ('', 'motor_'))
    likelihood, effort, cost_ratio, eta = values.tolist()
    status, dt = STATUSES[int(rows['status'][0])], float(rows['t'][-1]) / max(len(rows) - 1, 1)
    only_motor = None if np.array_equal(total, motor) else motor
    solution = Solution(status, '', dt, mean, total, np.zeros((0, 2)), effort, {}, 0.0, 0.0, eta, motor_covariance=only_motor)
    sides = parse_label(label, ids)[1]
    candidate = Candidate(label, int(rows['goal'][0]), tuple(sides.items()), mean[:, :2], 0.0)
    return PredictedCandidate(candidate, solution, sides, cost_ratio, likelihood, way=int(rows['way'][0]))


def _stack(rows: Any, names: Sequence[str]) -> Array:
    return np.stack([rows[name].astype(float) for name in names], axis=-1)
