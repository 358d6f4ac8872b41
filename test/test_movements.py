# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Movements are learnt while running: only those that end at a goal, causally, equally for equal input, and until a reset."""

from __future__ import annotations

import numpy as np
import pytest
from test_demonstrations import GOAL, OBSTACLES, bow

from foc_ros.core.classes.library import MOST_STATES
from foc_ros.core.config import Config
from foc_ros.core.learning import movements as learning
from foc_ros.core.learning.recordings import PRIOR_COUNT
from foc_ros.core.pipeline import Pipeline
from foc_ros.core.types import NANOSECONDS, HandSample
from foc_ros.ros.freshness import Freshness
from foc_ros.ros.health import Monitor
from foc_ros.ros.intake import Intake

CONFIG = Config().with_values(
    {'experience.learning': 'online', 'rate_hz': 4.0, 'foc.steps': 20, 'estimator.position_stddev': 1e-4}
)
STEP_S = 0.01
ABOVE, BELOW = bow(0.03), bow(-0.03)
TURNS = [0.1, 0.0] - 0.2 * np.column_stack([each(np.pi * np.linspace(0.0, 11.0, 400)) for each in (np.cos, np.sin)])
"""A circle through the goal, around which a path goes five and a half times."""


def reach(path: np.ndarray, seconds: float = 1.5, rest_s: float = 0.4, after_s: float = 0.4) -> np.ndarray:
    """Return positions at 100 Hz of a minimum-jerk movement along a path, at rest before and after."""
    s = np.clip((np.arange(0.0, seconds + rest_s + after_s, STEP_S) - rest_s) / seconds, 0.0, 1.0)
    along, at = 10 * s**3 - 15 * s**4 + 6 * s**5, np.linspace(0.0, 1.0, len(path))
    return np.column_stack([np.interp(along, at, axis) for axis in path.T])


def follow(pipeline: Pipeline, *paths: np.ndarray, goals: np.ndarray = GOAL, is_predicting: bool = False) -> list:
    """Pass movements to a pipeline, with a gap in time before each; return the predictions."""
    predictions = []
    for positions in paths:
        pipeline.set_obstacles('cloud', OBSTACLES, None, 'world')
        pipeline.set_goals(goals, 'world')
        start_ns = (0 if pipeline.hand_state is None else pipeline.hand_state.stamp_ns) + 2 * NANOSECONDS
        for row, position in enumerate(positions):
            pipeline.add_hand_sample(HandSample(start_ns + round(row * STEP_S * NANOSECONDS), position, 0.0, 'world'))
            if is_predicting and pipeline.is_due:
                predictions.append(pipeline.predict())
    return predictions


def likelihood_above(prediction) -> float:
    return sum(each.likelihood for each in prediction.candidates if dict(each.candidate.sides).get(OBSTACLES.ids[0]) == 1)


def test_a_repeated_way_becomes_more_likely() -> None:
    ways = [reach(ABOVE)] * 4
    first, last = [], []
    for learning_ in ('none', 'online'):
        pipeline = Pipeline(CONFIG.with_values({'experience.learning': learning_, 'likelihood.other_goal': 0.0}))
        predicted = follow(pipeline, *ways, is_predicting=True)
        of_each = len(predicted) // len(ways)
        first.append(likelihood_above(predicted[0]))
        last.append(likelihood_above(predicted[3 * of_each]))
    assert first[0] == first[1], 'nothing is known before the first movement'
    prior = PRIOR_COUNT
    assert last[1] == pytest.approx((prior * last[0] + 3.0) / (prior + 3.0), abs=0.02)


def test_a_movement_is_learnt_when_it_has_ended() -> None:
    pipeline, path = Pipeline(CONFIG), reach(ABOVE, after_s=2.0)
    ended = round((0.4 + 1.5) / STEP_S)
    follow(pipeline, path[:ended])
    assert not pipeline.learnt.movements.learnt
    pipeline = Pipeline(CONFIG)
    follow(pipeline, path)
    (found,) = pipeline.learnt.movements.learnt
    assert found.states is not None
    around = np.hypot(*(found.states[-1, :2] - GOAL[0])), np.hypot(*found.states[0, :2])
    assert max(around) < 0.005
    assert len(found.states) == pytest.approx((0.4 + 1.5 + learning.AROUND_S) / learning.STEP_S, abs=8)


def test_a_rest_on_the_way_is_part_of_a_movement_and_one_at_a_goal_ends_it() -> None:
    halfway = ABOVE[: len(ABOVE) // 2 + 1]
    paused = np.concatenate([reach(halfway, after_s=0.1), reach(ABOVE[len(ABOVE) // 2 :], rest_s=0.1)[1:]])
    pipeline = Pipeline(CONFIG)
    follow(pipeline, paused, paused[:2])
    (found,) = pipeline.learnt.movements.learnt
    assert np.hypot(*found.path[0]) < 0.01
    there_and_back = np.concatenate([reach(ABOVE), reach(ABOVE[::-1])[1:]])
    pipeline = Pipeline(CONFIG)
    follow(pipeline, there_and_back, paused[:2], goals=np.array([[0.3, 0.0], [0.0, 0.0]]))
    there, back = pipeline.learnt.movements.learnt
    assert np.hypot(*(there.path[-1] - [0.3, 0.0])) == 0.0 and np.hypot(*back.path[-1]) == 0.0
    assert there.sides == tuple(-side for side in back.sides)


@pytest.mark.parametrize(
    ('path', 'goals', 'reason'),
    [
        (reach(0.7 * ABOVE), GOAL, 'm from the nearest'),
        (reach(0.1 * ABOVE, seconds=0.4), np.array([[0.03, 0.0]]), 'at least 0.05 m'),
        (reach(TURNS, seconds=25.0), GOAL, 'at most 19 s'),
        (reach(ABOVE), np.zeros((0, 2)), 'without goals'),
    ],
    ids=['no goal reached', 'short', 'long', 'no goals'],
)
def test_what_is_no_demonstration_is_refused(path: np.ndarray, goals: np.ndarray, reason: str) -> None:
    pipeline = Pipeline(CONFIG)
    follow(pipeline, path, goals=goals)
    movements = pipeline.learnt.movements.finish()
    assert not movements.learnt and movements.refused == 1 and reason in movements.refusal
    assert len(movements.states) <= MOST_STATES


def test_a_reset_and_new_parameters_forget_what_was_learnt_and_keep_the_library() -> None:
    given = follow_one(ABOVE)
    for forget in (Pipeline.reset, lambda each: each.reconfigure(CONFIG.with_values({'estimator.jerk_density': 3.0}))):
        pipeline = Pipeline(CONFIG, [given])
        follow(pipeline, reach(BELOW), np.zeros((2, 2)))
        assert len(pipeline.learnt.movements.learnt) == 1 and len(pipeline._library.recordings) == 2
        pipeline.reconfigure(CONFIG.with_values({'rate_hz': 5.0, 'likelihood.beta': 3.0}))
        assert len(pipeline.learnt.movements.learnt) == 1
        forget(pipeline)
        assert not pipeline.learnt.movements.learnt and pipeline._library.recordings == (given,)


def follow_one(path: np.ndarray):
    pipeline = Pipeline(CONFIG)
    follow(pipeline, reach(path), np.zeros((2, 2)))
    return pipeline.learnt.movements.learnt[0]


def test_the_diagnostics_count_movements() -> None:
    intake = Intake(Pipeline(CONFIG))
    follow(intake.pipeline, reach(ABOVE), reach(0.7 * BELOW), np.zeros((2, 2)))
    health = Monitor(intake, Freshness(), 0.0).report(1.0, 'active', None, 0.0, [])
    assert any('1 movements recorded, 1 refused' in value for value in health.values.values())
