# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Readiness by the node's clocks: a silent source and an old pose are reported with numbers."""

from __future__ import annotations

import pytest

from foc_ros.core.config import Config, replace_values
from foc_ros.core.pipeline import SampleStatus
from foc_ros.core.types import NANOSECONDS
from foc_ros.io.topics import CLOUD, HAND, MARKERS
from foc_ros.ros.freshness import Freshness

CONFIG = replace_values(Config(), {'estimator.hand_timeout_s': 0.5, 'scene.timeout_s': 2.0})
NEVER = replace_values(Config(), {'estimator.hand_timeout_s': 0.0, 'scene.timeout_s': 0.0})
BOTH = ('cloud', 'markers')


def build_freshness(**times: float) -> Freshness:
    made = Freshness()
    for role, time_s in times.items():
        made.note(role, SampleStatus.ACCEPTED, time_s)
    return made


def test_an_input_that_was_never_received_is_not_silent() -> None:
    assert Freshness().find_not_ready_reason(1e6, CONFIG, ()) is None


@pytest.mark.parametrize(
    ('times', 'words'),
    [
        ({HAND: 9.4, CLOUD: 9.0}, 'hand_pose silent for 0.6 s (estimator.hand_timeout_s is 0.5)'),
        ({HAND: 10.0, CLOUD: 7.9, MARKERS: 10.0}, 'obstacles silent for 2.1 s (scene.timeout_s is 2)'),
        ({HAND: 10.0, CLOUD: 10.0, MARKERS: 7.0}, 'obstacle_markers silent for 3.0 s (scene.timeout_s is 2)'),
        ({HAND: 9.6, CLOUD: 8.1, MARKERS: 8.1}, None),
    ],
)
def test_one_silent_input_stops_predictions(times: dict[str, float], words: str | None) -> None:
    found = build_freshness(**times).find_not_ready_reason(10.0, CONFIG, BOTH)
    assert (found and found[1]) == words
    assert build_freshness(**times).find_not_ready_reason(10.0, NEVER, BOTH) is None


def test_a_hand_whose_poses_are_refused_is_not_silent() -> None:
    freshness = build_freshness(hand_pose=8.0)
    freshness.note(HAND, SampleStatus.DUPLICATE, 9.9, 'hand_pose: stamps repeat')
    found = freshness.find_not_ready_reason(10.0, CONFIG, ())
    assert found == ('hand_refused', 'no hand_pose could be used for 2.0 s, the last: hand_pose: stamps repeat')
    found = freshness.find_not_ready_reason(12.0, CONFIG, ())
    assert found is not None and 'silent for 4.0 s' in found[1]


def test_a_source_that_is_received_again_is_not_silent() -> None:
    freshness = build_freshness(hand_pose=10.0, obstacles=1.0)
    assert freshness.find_not_ready_reason(10.0, CONFIG, ['cloud']) is not None
    freshness.note(CLOUD, SampleStatus.ACCEPTED, 10.0)
    assert freshness.find_not_ready_reason(10.0, CONFIG, ['cloud']) is None


def pose(freshness: Freshness, stamp_s: float, clock_s: float, *, is_restart: bool = False) -> str | None:
    freshness.note_pose(round(stamp_s * NANOSECONDS), round(clock_s * NANOSECONDS), 0.5, is_restart=is_restart)
    found = freshness.find_not_ready_reason(0.0, CONFIG, ())
    return found and found[1]


def test_poses_stamped_by_ros_time_are_judged_by_it() -> None:
    freshness = Freshness()
    assert pose(freshness, 100.0, 100.1) is None
    words = 'the hand pose is 0.6 s older than the time of the node (estimator.hand_timeout_s is 0.5)'
    assert pose(freshness, 100.1, 100.7) == words
    assert 'newer' in (pose(freshness, 101.3, 100.7) or '')
    assert pose(freshness, 101.4, 101.4) is None
    assert freshness.find_not_ready_reason(0.0, NEVER, ()) is None


def test_the_stamps_of_a_recording_are_not_judged_until_a_movement_begins_at_ros_time() -> None:
    freshness = Freshness()
    assert pose(freshness, 10.0, 1e9) is None
    assert pose(freshness, 1e9, 1e9) is None
    assert pose(freshness, 10.0, 1e9) is None
    assert pose(freshness, 1e9, 1e9, is_restart=True) is None
    assert pose(freshness, 10.0, 1e9, is_restart=True) is not None
    freshness.forget_clock()
    assert pose(freshness, 10.0, 1e9) is None


def test_a_clock_at_zero_is_not_used() -> None:
    freshness = Freshness()
    assert pose(freshness, 10.0, 0.0) is None
    assert pose(freshness, 10.1, 10.1) is None
    assert pose(freshness, 10.2, 11.2) is not None


@pytest.mark.parametrize(
    ('stamp_s', 'received_s', 'words'),
    [
        (100.0, 9.9, None),
        (100.0, 9.4, '0.6 s old'),
        (99.3, 9.9, '0.8 s old'),
    ],
)
def test_a_prediction_is_late_by_the_age_of_its_own_pose(stamp_s: float, received_s: float, words: str | None) -> None:
    """The pose behind it may be fresh: what counts is when the pose was stamped and received from which it was computed."""
    freshness = Freshness()
    assert pose(freshness, 100.0, 100.1) is None
    stamp_ns, clock_ns = round(stamp_s * NANOSECONDS), round(100.1 * NANOSECONDS)
    found = freshness.find_late_reason(stamp_ns, received_s, 10.0, clock_ns, CONFIG)
    assert (found is None) == (words is None) and (words or '') in (found or '')
    assert freshness.find_late_reason(stamp_ns, received_s, 10.0, clock_ns, NEVER) is None


def test_the_stamps_of_a_recording_make_no_prediction_late() -> None:
    assert Freshness().find_late_reason(1, 9.9, 10.0, 10**18, CONFIG) is None


def test_silent_sources_are_named() -> None:
    freshness = build_freshness(**{CLOUD: 7.9, MARKERS: 9.0})
    assert freshness.find_silent_sources(10.0, CONFIG, BOTH) == ['cloud']
    assert freshness.find_silent_sources(12.0, CONFIG, BOTH) == ['cloud', 'markers']
    assert freshness.find_silent_sources(12.0, NEVER, BOTH) == []
