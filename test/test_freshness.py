# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Readiness by the node's clocks: a silent source and an old pose are reported with numbers."""

from __future__ import annotations

import pytest

from foc_ros.core.config import Config, replace_values
from foc_ros.core.types import NANOSECONDS
from foc_ros.ros.freshness import Freshness

CONFIG = replace_values(Config(), {'estimator.hand_timeout_s': 0.5, 'scene.timeout_s': 2.0})
NEVER = replace_values(Config(), {'estimator.hand_timeout_s': 0.0, 'scene.timeout_s': 0.0})


@pytest.mark.parametrize(
    'poses',
    [
        [(100.0, 100.1, False, ''), (100.1, 100.7, False, 'the hand pose is 0.6 s older than the time of the node')],
        [(100.0, 100.1, False, ''), (101.3, 100.7, False, 'newer'), (101.4, 101.4, False, '')],
        # a recording with its own stamps, until a movement begins at ROS time
        [(10.0, 1e9, False, ''), (1e9, 1e9, False, ''), (10.0, 1e9, False, '')],
        [(10.0, 1e9, False, ''), (1e9, 1e9, True, ''), (10.0, 1e9, True, 'older')],
        # a clock at zero is not used
        [(10.0, 0.0, False, ''), (10.1, 10.1, False, ''), (10.2, 11.2, False, 'older')],
    ],
)
def test_poses_stamped_by_ros_time_are_judged_by_it(poses: list[tuple[float, float, bool, str]]) -> None:
    freshness = Freshness()
    for stamp_s, clock_s, is_restart, words in poses:
        freshness.note_pose(round(stamp_s * NANOSECONDS), round(clock_s * NANOSECONDS), 0.5, is_restart=is_restart)
        found = freshness.find_not_ready_reason(0.0, CONFIG, ())
        assert (found is not None) == bool(words) and words in (found or ('', ''))[1]
        assert freshness.find_not_ready_reason(0.0, NEVER, ()) is None
    freshness.forget_clock()
    assert freshness.find_not_ready_reason(0.0, CONFIG, ()) is None


@pytest.mark.parametrize(
    ('stamp_s', 'received_s', 'words'),
    [(100.0, 9.9, None), (100.0, 9.4, '0.6 s old'), (99.3, 9.9, '0.8 s old')],
)
def test_a_prediction_is_late_by_the_age_of_its_own_pose(stamp_s: float, received_s: float, words: str | None) -> None:
    """The pose behind it may be fresh: what counts is when the pose was stamped and received from which it was computed."""
    freshness, clock_ns = Freshness(), round(100.1 * NANOSECONDS)
    freshness.note_pose(100 * NANOSECONDS, clock_ns, 0.5, is_restart=False)
    stamp_ns = round(stamp_s * NANOSECONDS)
    found = freshness.find_late_reason(stamp_ns, received_s, 10.0, clock_ns, CONFIG)
    assert (found is None) == (words is None) and (words or '') in (found or '')
    assert freshness.find_late_reason(stamp_ns, received_s, 10.0, clock_ns, NEVER) is None
    assert Freshness().find_late_reason(1, 9.9, 10.0, 10**18, CONFIG) is None, 'the stamps of a recording'
