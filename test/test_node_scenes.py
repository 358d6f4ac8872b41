# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Extreme scenes in a running node: its outputs and the level of its diagnostics."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pytest
import ros_helpers

ros_helpers.require_ros()

from message_helpers import SECOND, cloud, obstacle_table, pose_array  # noqa: E402
from node_helpers import CROWD, GOALS, ROWS, TYPES, Bench, figures, hand_path, list_labels  # noqa: E402
from ros_helpers import Graph  # noqa: E402

from foc_ros.core.types import Status  # noqa: E402

OK, WARN = b'\x00', b'\x01'
TAKING_PART = tuple(f'{status.value}, likelihood ' for status in Status if status.has_likelihood)
RING = [(0.1 * np.cos(angle), 0.1 * np.sin(angle), 0.0, 0.02) for angle in np.linspace(0.0, 2.0 * np.pi, 40, endpoint=False)]


@dataclass
class Case:
    """A scene; the least and largest number of candidates; level and text of the diagnostics."""

    rows: list[tuple[float, ...]]
    candidates: tuple[int, int]
    level: bytes
    words: str
    goals: list[tuple[float, ...]] = field(default_factory=lambda: list(GOALS))
    parameters: dict[str, Any] = field(default_factory=dict)


OUT_OF_REACH = {'foc.eta': 0.999, 'foc.noise_x': 1.0, 'foc.noise_y': 1.0}
CASES = {
    'empty scene': Case([], (1, 1), OK, 'predicting'),
    'hand deep inside an obstacle': Case([(0.01, 0.0, 0.0, 0.03)], (1, 2), WARN, 'scene_hand_inside 1'),
    'hand just inside an obstacle': Case([(0.0, 0.028, 0.0, 0.03)], (1, 2), WARN, 'scene_hand_inside 1'),
    'goal inside an obstacle': Case([(0.3, 0.01, 0.0, 0.03)], (1, 1), OK, 'predicting'),
    'one goal of two inside': Case([(0.3, 0.01, 0.0, 0.03)], (2, 4), OK, 'predicting', goals=[(0.3, 0.0, 0.0), (0.0, 0.3, 0.0)]),
    'no way through': Case(RING, (0, 0), WARN, 'predict_nothing_solved 1; scene_no_way 1'),
    'ten thousand obstacles': Case(CROWD, (1, 2), OK, 'predicting'),
    'eta out of reach': Case(ROWS, (1, 4), OK, 'predicting', parameters=OUT_OF_REACH),
    'eta out of reach, and a condition': Case(
        ROWS, (0, 0), WARN, 'predict_nothing_solved 1', parameters=OUT_OF_REACH | {'likelihood.shortfall': math.inf}
    ),
    'hand at its goal': Case([(0.15, 0.0, 0.0, 0.03)], (1, 1), OK, 'predicting', goals=[(0.0, 0.0, 0.0)]),
}


@pytest.mark.parametrize('name', CASES)
def test_the_outputs_and_the_level_of_an_extreme_scene(ros: Graph, name: str) -> None:
    case = CASES[name]
    bench = Bench(ros, parameters=case.parameters)
    bench.deliver('obstacles', cloud(TYPES, obstacle_table(case.rows), 10 * SECOND))
    bench.deliver('goals', pose_array(TYPES, case.goals))
    bench.health()
    (pose,) = hand_path(1)
    bench.move([pose])
    (table,), (path,), (cloud_out,) = (bench.wait_for(each, 1) for each in ('likelihoods', 'path', 'prediction'))
    count = len(list_labels(table))
    fewest, most = case.candidates
    assert fewest <= count <= most
    assert cloud_out.width == count * 21
    assert len(path.poses) == (21 if count else 0)
    assert {cloud_out.header.stamp.sec, path.header.stamp.sec} == {pose.header.stamp.sec}
    rows = np.array(table.data).reshape(-1, 4)
    assert len(rows) - count in (0, 1, 2), 'the last rows are the shares that no candidate has'
    assert np.isfinite(rows[:count]).all()
    assert (rows[:, 0] >= 0.0).all() and rows[:, 0].sum() == pytest.approx(1.0)
    assert count or rows[:, 0].tolist() == [1.0], 'where nothing is solved, all is unknown'
    status = bench.health()
    assert (status.level, status.message) == (case.level, case.words)
    told = [value for key, value in figures(status).items() if key.startswith('candidate ')]
    assert len([value for value in told if value.startswith(TAKING_PART)]) == count
    solved = [value for value in told if value.startswith('solved')]
    assert (rows[:, 3] >= bench.node.pipeline.config.foc.eta - 1e-5).sum() >= len(solved)


def test_a_fault_is_reported_as_long_as_it_lasts(ros: Graph) -> None:
    bench, poses = Bench(ros), hand_path(8)
    bench.publish_scene(rows=[(0.01, 0.0, 0.0, 0.03)])
    bench.move(poses[:4])
    assert bench.health().level == WARN
    bench.publish_scene()
    bench.move(poses[4:])
    bench.health()
    bench.move(hand_path(2, start_s=10.08))
    status = bench.health()
    assert (status.level, status.message) == (OK, 'predicting')
