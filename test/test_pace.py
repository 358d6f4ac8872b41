# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Expected durations follow the operator's movements: causally, equally for equal input, and until a reset."""

from __future__ import annotations

import numpy as np
import pytest

from foc_ros.core.config import Config, replace_values
from foc_ros.core.hand.duration import compute_movement_time, scale_durations
from foc_ros.core.learning.pace import Pace
from foc_ros.core.pipeline import Pipeline
from foc_ros.core.types import NANOSECONDS, HandSample

CONFIG = replace_values(Config(), {'estimator.position_stddev': 1e-4})
GOAL = np.array([[0.4, 0.0]])
STEP_NS = NANOSECONDS // 50


def reach(duration_s: float, distance: float = 0.4) -> np.ndarray:
    """Return positions at 50 Hz of a minimum-jerk reach along x, at rest for 0.6 s before and after."""
    s = np.clip((np.arange(0.0, duration_s + 1.2, 0.02) - 0.6) / duration_s, 0.0, 1.0)
    return np.outer(distance * (10 * s**3 - 15 * s**4 + 6 * s**5), [1.0, 0.0])


def follow(pipeline: Pipeline, *movements: np.ndarray, goal: np.ndarray = GOAL) -> Pipeline:
    """Pass movements, and back to the start in between by a jump of time, to a pipeline."""
    for positions in movements:
        pipeline.set_goals(goal, 'world')
        start_ns = (0 if pipeline.hand_state is None else pipeline.hand_state.stamp_ns) + 2 * NANOSECONDS
        for row, position in enumerate(positions):
            pipeline.add_hand_sample(HandSample(start_ns + row * STEP_NS, position, 0.0, 'world'))
    return pipeline


@pytest.mark.parametrize('factor', [0.6, 1.0, 2.0, 3.0])
def test_the_factor_approaches_that_of_the_operator(factor: float) -> None:
    duration_s = factor * compute_movement_time(0.4, CONFIG.duration)
    pipeline = follow(Pipeline(CONFIG), *[reach(duration_s)] * 3)
    assert pipeline.learnt.pace.movements >= 2
    arrival, found = pipeline.learnt.pace.find_best(CONFIG.duration)
    assert arrival == 'rest' and found == pytest.approx(factor, rel=0.3)
    assert pipeline.adapted_config.duration == scale_durations(CONFIG.duration, found)


def test_an_operator_who_passes_the_goals_is_recognised() -> None:
    """The hand crosses the goal at the constant speed with which it came, and stops beyond it."""
    there = np.arange(0.0, 0.4, 0.02 * 0.2)
    beyond = 0.4 + 0.2 * 0.05 * (1.0 - np.exp(-np.arange(0.0, 0.5, 0.02) / 0.05))
    movement = np.outer(np.concatenate([np.zeros(30), there, beyond]), [1.0, 0.0])
    pipeline = follow(Pipeline(CONFIG), *[movement] * 3)
    assert pipeline.learnt.pace.movements >= 2 and pipeline.learnt.pace.find_best(CONFIG.duration)[0] == 'passing'
    assert pipeline.adapted_config.duration.arrival == 'passing'


def test_without_a_movement_nothing_changes() -> None:
    pipeline = follow(Pipeline(CONFIG), np.zeros((100, 2)))
    assert pipeline.learnt.pace.movements == 0 and pipeline.learnt.pace.find_best(CONFIG.duration) == ('rest', 1.0)
    assert pipeline.adapted_config is CONFIG


def test_the_present_movement_counts_by_the_distance_that_it_has_covered() -> None:
    slow, pipeline, found = reach(4.0), Pipeline(CONFIG), [1.0]
    for row, position in enumerate(slow[:130]):
        pipeline.set_goals(GOAL, 'world')
        pipeline.add_hand_sample(HandSample(NANOSECONDS + row * STEP_NS, position, 0.0, 'world'))
        found.append(pipeline.learnt.pace.find_best(CONFIG.duration)[1])
    assert pipeline.learnt.pace.movements == 0 and found[40] == 1.0 and found[-1] > 1.5
    first = int(np.flatnonzero(np.array(found) != 1.0)[0])
    assert np.abs(np.diff(np.log(found[first:]))).max() < 0.1, 'after the first state that is judged, the factor does not jump'
    assert pipeline.learnt.pace.interrupt().find_best(CONFIG.duration) == ('rest', 1.0)


def test_equal_samples_give_equal_factors_and_a_reset_forgets_them() -> None:
    one, other = (follow(Pipeline(CONFIG), reach(4.0), reach(3.5), reach(4.2)) for _ in range(2))
    np.testing.assert_array_equal(one.learnt.pace.losses, other.learnt.pace.losses)
    assert one.learnt.pace.movements > 0
    one.reset()
    assert one.learnt.pace.movements == 0 and one.adapted_config is CONFIG
    np.testing.assert_array_equal(one.learnt.pace.losses, Pace().losses)


def test_it_can_be_switched_off_and_new_durations_begin_anew() -> None:
    off = replace_values(CONFIG, {'duration.adaptation': 'none'})
    assert follow(Pipeline(off), reach(4.0), reach(4.0)).learnt.pace.movements == 0
    pipeline = follow(Pipeline(CONFIG), reach(4.0), reach(4.0))
    pipeline.reconfigure(replace_values(CONFIG, {'rate_hz': 20.0}))
    assert pipeline.learnt.pace.movements > 0
    pipeline.reconfigure(pipeline.adapted_config)
    assert pipeline.learnt.pace.movements == 0 and pipeline.config.duration.fitts_b_s > CONFIG.duration.fitts_b_s
