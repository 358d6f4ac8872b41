# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""The pipeline: when a prediction is due, what is rejected and why, and that no outdated input is used as a new one."""

import numpy as np
import pytest

from foc_ros.core import pipeline as module
from foc_ros.core.config import Config, replace_values
from foc_ros.core.deadline import NEVER, Deadline
from foc_ros.core.errors import SceneError
from foc_ros.core.learning.learnt import Knowledge
from foc_ros.core.obstacle_table import Obstacles, make_obstacles
from foc_ros.core.pipeline import Pipeline, SampleStatus
from foc_ros.core.prediction import Prediction
from foc_ros.core.tracks import Tracks
from foc_ros.core.types import NANOSECONDS, Array, HandSample, HandState

START = 1000 * NANOSECONDS
MS = NANOSECONDS // 1000
CONFIG = replace_values(Config(), {'rate_hz': 50.0, 'scene.timeout_s': 2.0, 'foc.steps': 20})


class Recorder:
    """Replaces the predictor and records its arguments."""

    def __init__(self) -> None:
        self.calls: list[tuple[Config, HandState, Obstacles, Array, Tracks]] = []

    def __call__(
        self,
        config: Config,
        hand: HandState,
        obstacles: Obstacles,
        goals: Array,
        memory: Tracks,
        knowledge: Knowledge,
        deadline: Deadline,
        goal_heights: Array | None,
    ) -> tuple[Prediction, Tracks]:
        assert not knowledge.library.demonstrations and goal_heights is None
        assert deadline is NEVER
        self.calls.append((config, hand, obstacles, goals, memory))
        label = f'call{len(self.calls)}'
        return Prediction(hand.stamp_ns, hand.frame_id, hand.height, (), label), Tracks(stamp_ns=len(self.calls))


@pytest.fixture
def recorder(monkeypatch: pytest.MonkeyPatch) -> Recorder:
    stand_in = Recorder()
    monkeypatch.setattr(module, 'predict', stand_in)
    return stand_in


def hand(ms: float, x: float = 0.0, frame: str = 'world') -> HandSample:
    return HandSample(START + round(ms * MS), np.array([x, 0.0]), 0.3, frame)


def ready(config: Config = CONFIG) -> Pipeline:
    """Return a pipeline with a scene and a goal, but without a hand sample."""
    pipeline = Pipeline(config)
    pipeline.set_obstacles('cloud', make_obstacles([[0.15, 0.0]], 0.03), START, 'world')
    pipeline.set_goals(np.array([[0.3, 0.0]]), 'world')
    return pipeline


def observe(pipeline: Pipeline) -> tuple[object, ...]:
    is_due, reason = pipeline.is_due, pipeline.not_ready_reason()
    return pipeline.hand_state, pipeline.scene, is_due, reason, pipeline.is_engaged, pipeline.frame_id


@pytest.mark.parametrize(('period_ms', 'expected'), [(1.0, 50), (14.0, 48), (19.9, 50), (30.0, 34)])
def test_the_rate_is_reached_whatever_the_period_of_the_samples(recorder: Recorder, period_ms: float, expected: int) -> None:
    pipeline, stamps = ready(), []
    for ms in np.arange(0.0, 1000.0, period_ms):
        pipeline.add_hand_sample(hand(ms))
        assert pipeline.is_due == (pipeline.until_due_s <= 0.0)
        if pipeline.is_due:
            prediction = pipeline.predict()
            assert prediction is not None
            stamps.append(prediction.stamp_ns)
    assert abs(len(stamps) - expected) <= 1
    assert np.diff(stamps).min() >= 10 * MS


def test_every_reason_for_no_prediction_is_explained(recorder: Recorder) -> None:
    pipeline = Pipeline(CONFIG)
    assert pipeline.not_ready_reason() == 'no hand pose yet'
    pipeline.add_hand_sample(hand(0.0))
    assert pipeline.not_ready_reason() == 'no obstacles received yet: publish an empty cloud for an empty scene'
    assert pipeline.predict() is None
    assert pipeline.last_refusal == pipeline.not_ready_reason()
    pipeline.set_obstacles('cloud', make_obstacles(), START - 3100 * MS, 'world')
    assert pipeline.not_ready_reason() == 'no goal received'
    pipeline.set_goals(np.zeros((1, 2)), 'world')
    assert pipeline.not_ready_reason() == 'obstacles are 3.1 s older than the hand pose (scene.timeout_s is 2)'
    assert pipeline.predict() is None
    pipeline.set_obstacles('cloud', make_obstacles(), START, 'world')
    assert pipeline.not_ready_reason() is None
    assert pipeline.is_due
    pipeline.set_engaged(False)
    assert pipeline.not_ready_reason() == 'disengaged'
    assert pipeline.predict() is None
    assert pipeline.counts == {'predict_no_obstacles': 1, 'predict_stale': 1, 'predict_disengaged': 1}
    assert recorder.calls == []


def test_a_rejected_message_changes_nothing_and_is_counted_with_its_reason(recorder: Recorder) -> None:
    pipeline = ready()
    pipeline.add_hand_sample(hand(100.0))
    frame, nothing, S = "header.frame_id: expected the working frame 'world', got 'camera'", make_obstacles(), SampleStatus
    hands, scenes = pipeline.add_hand_sample, pipeline.set_obstacles
    rejections = [
        (lambda: hands(hand(100.0)), S.DUPLICATE, 'hand_duplicate', 'stamps repeat: 1000100000000 ns'),
        (lambda: hands(hand(90.0)), S.LATE, 'hand_late', '0.01 s behind the newest one'),
        (lambda: hands(hand(110.0, frame='camera')), S.WRONG_FRAME, 'hand_wrong_frame', f'hand_pose.{frame}'),
        (lambda: scenes('cloud', nothing, START, 'camera'), S.WRONG_FRAME, 'obstacles_wrong_frame', f'cloud.{frame}'),
        (lambda: scenes('cloud', nothing, START - MS, 'world'), S.LATE, 'obstacles_late', '0.001 s behind the newest one'),
        (lambda: pipeline.set_goals(np.zeros((1, 2)), 'camera'), S.WRONG_FRAME, 'goals_wrong_frame', f'goals.{frame}'),
    ]
    before = observe(pipeline)
    for reject, status, kind, words in rejections:
        assert reject() is status
        assert not status.is_taken
        assert observe(pipeline) == before
        assert pipeline.counts[kind] == 1
        assert pipeline.last_refusal is not None
        assert words in pipeline.last_refusal
    assert sum(pipeline.counts.values()) == len(rejections)


@pytest.mark.parametrize(
    ('jump', 'status'),
    [(-600.0, SampleStatus.RESTARTED_BACKWARD), (600.0, SampleStatus.RESTARTED_GAP), (-1e5, SampleStatus.RESTARTED_BACKWARD)],
)
def test_a_jump_of_the_hand_stamp_restarts_the_movement(recorder: Recorder, jump: float, status: SampleStatus) -> None:
    pipeline = ready(replace_values(CONFIG, {'scene.timeout_s': 0.0}))
    pipeline.add_hand_sample(hand(0.0))
    pipeline.predict()
    assert pipeline.add_hand_sample(hand(jump)) is status
    assert status.is_restart
    assert pipeline.is_due
    assert pipeline.predict() is not None
    assert recorder.calls[1][4].stamp_ns is None
    assert pipeline.counts[f'hand_{status}'] == 1


def test_while_disengaged_the_hand_is_followed_without_predictions(recorder: Recorder) -> None:
    pipeline = ready()
    pipeline.add_hand_sample(hand(0.0))
    pipeline.predict()
    pipeline.set_engaged(False)
    assert pipeline.add_hand_sample(hand(50.0, 0.02)) is SampleStatus.DISENGAGED
    assert not pipeline.is_due and pipeline.counts['hand_disengaged'] == 1
    assert pipeline.hand_state is not None and pipeline.hand_state.stamp_ns == START + 50 * MS
    pipeline.set_engaged(True)
    assert not pipeline.is_due and pipeline.predict() is None
    assert pipeline.add_hand_sample(hand(51.0, 0.02)) is SampleStatus.ACCEPTED
    assert pipeline.is_due and pipeline.predict() is not None
    assert recorder.calls[1][4].stamp_ns is None, 'a new movement'


def test_a_scene_that_the_predictor_refuses_is_counted(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*arguments: object) -> tuple[Prediction, Tracks]:
        raise SceneError('goals[0]', 'a goal outside of every obstacle', '(0.15, 0)')

    monkeypatch.setattr(module, 'predict', refuse)
    pipeline = ready()
    pipeline.add_hand_sample(hand(0.0))
    assert pipeline.predict() is None
    assert not pipeline.is_due
    assert pipeline.counts == {'predict_failed': 1}
    assert pipeline.last_refusal == 'goals[0]: expected a goal outside of every obstacle, got (0.15, 0)'


EVENTS = {
    'reset': lambda pipeline: pipeline.reset(),
    'clutch': lambda pipeline: pipeline.set_engaged(False),
    'parameters': lambda pipeline: pipeline.reconfigure(replace_values(CONFIG, {'foc.eta': 0.5})),
    'restart': lambda pipeline: pipeline.add_hand_sample(hand(-10_000.0)),
}


@pytest.mark.parametrize('event', EVENTS)
def test_a_prediction_that_was_begun_before_an_event_is_neither_returned_nor_remembered(recorder: Recorder, event: str) -> None:
    pipeline, deadline = ready(), Deadline()
    pipeline.add_hand_sample(hand(0.0))
    task = pipeline.begin(deadline)
    assert task is not None and not deadline.has_passed
    EVENTS[event](pipeline)
    assert deadline.has_passed
    assert pipeline.finish(task, task.run) is None
    assert pipeline.counts['predict_abandoned'] == 1
    assert recorder.calls == []
    pipeline.set_engaged(True)
    pipeline.add_hand_sample(hand(100.0))
    assert pipeline.is_due and pipeline.predict() is not None
    assert recorder.calls[0][4].stamp_ns is None
