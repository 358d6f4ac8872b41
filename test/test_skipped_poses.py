# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""A hand that is faster than needed is thinned out by its stamps, in node and replay alike; bad poses are still found."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from bag_helpers import CONFIG, messages, write_bag
from message_helpers import SECOND, message_types, pose_stamped

from foc_ros.analysis.replay import Replay
from foc_ros.core.config import Config, replace_values
from foc_ros.core.pipeline import Pipeline, SampleStatus
from foc_ros.core.prediction import Prediction
from foc_ros.io.bags import BagReader
from foc_ros.ros.intake import Intake

TYPES = message_types('rosbags')
MS = SECOND // 1000
A, S, R = SampleStatus.ACCEPTED, SampleStatus.SKIPPED, SampleStatus.RESTARTED_BACKWARD


def pose(ms: float, x: float = 0.0, frame_id: str = 'world') -> Any:
    return pose_stamped(TYPES, (x, 0.0, 0.1), 10 * SECOND + round(ms * MS), frame_id)


@pytest.mark.parametrize(
    ('interval_s', 'stamps_ms', 'expected'),
    [
        pytest.param(0.0035, (0, 1, 2, 3, 4, 5, 6, 7, 8), (A, S, S, S, A, S, S, S, A), id='1 kHz'),
        pytest.param(0.0035, (0, 4, 8.2, 11.7, 16), (A, A, A, A, A), id='250 Hz with jitter'),
        pytest.param(0.003, (0, 0, 1, 1, -1, 3), (A, SampleStatus.DUPLICATE, S, S, SampleStatus.LATE, A), id='out of order'),
        pytest.param(0.003, (0, 1, -2000, -1999, -1997), (A, S, R, S, A), id='a jump back'),
        pytest.param(0.003, (0, 1000, 1001), (A, SampleStatus.RESTARTED_GAP, S), id='a gap'),
        pytest.param(0.0, (0, 1, 1.001), (A, A, A), id='switched off'),
    ],
)
def test_poses_are_skipped_by_their_stamps(
    interval_s: float, stamps_ms: tuple[float, ...], expected: tuple[SampleStatus, ...]
) -> None:
    intake = Intake(Pipeline(replace_values(Config(), {'estimator.min_interval_s': interval_s})))
    assert tuple(intake.take('hand_pose', pose(ms)) for ms in stamps_ms) == expected
    assert intake.counts.get('hand_skipped', 0) == expected.count(S)


def test_only_the_stamp_of_a_skipped_pose_is_looked_at() -> None:
    """Bad poses between good ones count as skipped; where no good one is near, they are refused with their reason."""
    intake = Intake(Pipeline(Config()))
    intake.take('hand_pose', pose(0))
    state, sample = intake.pipeline.hand_state, intake.sample
    for skipped in (pose(1, math.nan), pose(2, 0.0, 'camera'), pose(2, x=0.5)):
        assert intake.take('hand_pose', skipped) is S
    assert (intake.pipeline.hand_state, intake.sample, intake.last_refusal, intake.pipeline.refused) == (state, sample, None, 0)
    assert intake.take('hand_pose', pose(3.6, math.nan)) is None
    assert intake.last_refusal == 'hand_pose: pose.position.x: expected a finite number [m], got nan'
    assert intake.take('hand_pose', pose(4, 0.0, 'camera')) is SampleStatus.WRONG_FRAME
    assert intake.take('hand_pose', pose(4.5)) is A, 'a refused pose keeps no good one away'
    wrong = pose(5)
    wrong.header.stamp.nanosec = SECOND
    assert intake.take('hand_pose', wrong) is None


def test_a_publisher_in_a_wrong_frame_does_not_keep_the_right_one_away() -> None:
    intake = Intake(Pipeline(replace_values(Config(), {'frame_id': 'world'})))
    found = [intake.take('hand_pose', pose(2 * i, 0.0, 'camera' if i % 2 else 'world')) for i in range(100)]
    assert found.count(A) == 50


def predict(bag: Path, config: Config) -> tuple[list[Prediction], dict[str, int]]:
    replayed = Replay(config)
    with BagReader(bag) as reader:
        return [each.prediction for each in replayed.steps(reader) if each.prediction is not None], replayed.intake.counts


def are_equal(one: list[Prediction], other: list[Prediction]) -> bool:
    """Whether predictions are the same to the last bit."""
    return len(one) == len(other) and all(
        a.stamp_ns == b.stamp_ns
        and [c.likelihood for c in a.candidates] == [c.likelihood for c in b.candidates]
        and all(np.array_equal(c.mean, d.mean) for c, d in zip(a.candidates, b.candidates, strict=True))
        for a, b in zip(one, other, strict=True)
    )


def test_a_replay_of_a_fast_hand_is_that_of_the_poses_that_are_not_skipped(tmp_path: Path) -> None:
    items = messages(0.2, rate_hz=1000.0)
    hands = [item for item in items if item[0] == '/hand_pose']
    dropped = {id(item) for i, item in enumerate(hands) if i % 4}
    whole, counts = predict(write_bag(tmp_path / 'whole', items), CONFIG)
    thinned, none = predict(write_bag(tmp_path / 'thinned', [item for item in items if id(item) not in dropped]), CONFIG)
    assert (counts.get('hand_skipped'), none.get('hand_skipped')) == (len(dropped), None)
    assert whole and are_equal(whole, thinned)
    assert not are_equal(whole, predict(tmp_path / 'whole', replace_values(CONFIG, {'estimator.min_interval_s': 0.0}))[0])
