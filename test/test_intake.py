# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Messages on their way into the pipeline: markers expire by the hand's stamps, and refused messages are counted."""

from __future__ import annotations

from typing import Any

import pytest
from message_helpers import SECOND, cloud, marker, marker_array, message_types, obstacle_table, pose_array, pose_stamped

from foc_ros.core.config import Config, replace_values
from foc_ros.core.pipeline import Pipeline, SampleStatus
from foc_ros.ros.intake import Intake

TYPES = message_types('rosbags')


@pytest.fixture
def intake() -> Intake:
    return Intake(Pipeline(replace_values(Config(), {'scene.marker_radius_stddev': 0.004})))


def move(intake: Intake, seconds: float, frame_id: str = 'world') -> SampleStatus | None:
    return intake.take('hand_pose', pose_stamped(TYPES, (0.0, 0.0, 0.2), round(seconds * SECOND), frame_id))


def show(intake: Intake, *markers: Any) -> SampleStatus | None:
    return intake.take('obstacle_markers', marker_array(TYPES, *markers))


def seen(intake: Intake) -> tuple[str, ...]:
    state = intake.pipeline.hand_state
    assert state is not None
    return intake.pipeline.scene.obstacles(state.stamp_ns).ids


def test_every_input_reaches_the_pipeline(intake: Intake) -> None:
    assert move(intake, 1.0) is SampleStatus.ACCEPTED
    assert intake.sample is not None and intake.sample.height == 0.2
    assert intake.take('obstacles', cloud(TYPES, obstacle_table([(0.1, 0.2, 0.0, 0.03)]))) is SampleStatus.ACCEPTED
    assert show(intake, marker(TYPES, (0.3, 0.1, 0.0), id=5)) is SampleStatus.ACCEPTED
    assert seen(intake) == ('0', 'a/5')
    assert intake.pipeline.scene.obstacles(SECOND).radius_stddev.tolist() == [0.0, 0.004]
    assert intake.take('goals', pose_array(TYPES, [(0.3, 0.0, 0.0), (0.3, 0.1, 0.0)])) is SampleStatus.ACCEPTED
    assert intake.pipeline.scene.goals.tolist() == [[0.3, 0.0], [0.3, 0.1]]
    assert intake.take('goal_pose', pose_stamped(TYPES, (0.4, 0.0, 0.0))) is SampleStatus.ACCEPTED
    assert intake.pipeline.scene.goals.tolist() == [[0.4, 0.0]]
    assert intake.counts == {} and intake.last_refusal is None


def test_a_marker_expires_by_the_stamp_of_the_hand(intake: Intake) -> None:
    move(intake, 1.0)
    show(intake, marker(TYPES, id=1, lifetime=0.5), marker(TYPES, id=2))
    for seconds, expected in ((1.1, ('a/1', 'a/2')), (1.4, ('a/1', 'a/2')), (1.6, ('a/2',))):
        move(intake, seconds)
        assert seen(intake) == expected


def test_markers_of_publishers_with_different_delays_are_all_used(intake: Intake) -> None:
    move(intake, 1.0)
    for name, seconds in (('a', 1.0), ('b', 0.9), ('c', 0.8)):
        assert show(intake, marker(TYPES, ns=name, stamp_ns=round(seconds * SECOND))) is SampleStatus.ACCEPTED
    assert seen(intake) == ('a/0', 'b/0', 'c/0')
    assert intake.pipeline.scene.sources['markers'].stamp_ns == SECOND


def test_a_table_that_never_held_a_marker_is_no_source(intake: Intake) -> None:
    """One that did, and holds none any more, is an empty scene."""
    move(intake, 1.0)
    nothing = marker(TYPES, action=3, ns='', frame_id='')
    for message in ((), (nothing,)):
        assert show(intake, *message) is SampleStatus.ACCEPTED
        assert intake.pipeline.scene.sources == {}
    show(intake, marker(TYPES))
    assert seen(intake) == ('a/0',)
    assert show(intake, nothing) is SampleStatus.ACCEPTED
    assert seen(intake) == () and 'markers' in intake.pipeline.scene.sources


def test_a_source_that_is_removed_is_as_if_it_had_never_been_received(intake: Intake) -> None:
    move(intake, 1.0)
    show(intake, marker(TYPES, id=1, lifetime=5.0))
    intake.take('obstacles', cloud(TYPES, obstacle_table([(0.1, 0.2, 0.0, 0.03)])))
    intake.remove_source('markers')
    assert seen(intake) == ('0',)
    move(intake, 1.1)
    assert seen(intake) == ('0',), 'the markers do not come back with the next pose'
    show(intake, marker(TYPES, id=2))
    assert seen(intake) == ('0', 'a/2')
    intake.remove_source('cloud')
    assert seen(intake) == ('a/2',)


def test_markers_in_another_frame_are_discarded(intake: Intake) -> None:
    """They are received before the hand pose that fixes another working frame."""
    show(intake, marker(TYPES, id=1, frame_id='camera'))
    move(intake, 1.0)
    assert intake.counts == {'obstacles_wrong_frame': 1}
    assert show(intake, marker(TYPES, id=2)) is SampleStatus.ACCEPTED
    assert seen(intake) == ('a/2',)
    assert show(intake, marker(TYPES, id=3, frame_id='camera')) is None
    assert seen(intake) == ('a/2',) and "expected 'world'" in intake.last_refusal
