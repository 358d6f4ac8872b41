"""Expected durations follow the operator's movements: causally, equally for equal input, and until a reset."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from foc_ros.core.config import Config, DurationConfig, replace_values
from foc_ros.core.hand.duration import compute_movement_time, estimate_times_to_go, scale_durations
from foc_ros.core.height import reach_along_axis
from foc_ros.core.learning.pace import MOST_GOALS, Pace, find_free_positions
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


@pytest.mark.parametrize('model', ['fixed', 'fitts'])
def test_scaled_durations_are_longer_by_the_factor(model: str) -> None:
    pipeline, config = follow(Pipeline(CONFIG), np.zeros((5, 2))), DurationConfig(model=model)
    assert pipeline.hand_state is not None
    once, twice = (estimate_times_to_go(pipeline.hand_state, GOAL, each)[0] for each in (config, scale_durations(config, 2.0)))
    assert twice == pytest.approx(2.0 * once, rel=1e-3)


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


def test_a_movement_that_ends_on_the_way_does_not_count() -> None:
    assert follow(Pipeline(CONFIG), reach(2.0, distance=0.2), np.zeros((50, 2))).learnt.pace.movements == 0


def test_a_movement_is_judged_by_the_goals_that_it_had() -> None:
    """The next recording has other goals, and its first sample ends a movement that was not at rest yet."""
    unended = reach(2.0)[:-35]
    pipeline = follow(Pipeline(CONFIG), unended)
    follow(pipeline, np.zeros((2, 2)), goal=np.array([[-5.0, 0.0]]))
    assert pipeline.learnt.pace.movements == 1 and pipeline.learnt.pace.present is None
    same = follow(follow(Pipeline(CONFIG), unended), np.zeros((2, 2)))
    np.testing.assert_array_equal(pipeline.learnt.pace.losses, same.learnt.pace.losses)


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


def test_a_present_movement_is_judged_by_the_goal_to_which_it_fits_best() -> None:
    goals = np.vstack([[[-0.1, 0.3]], GOAL, [[0.0, -0.4]]])
    several, one = (follow(Pipeline(CONFIG), reach(3.0)[:150], goal=each).learnt.pace for each in (goals, GOAL))
    found, expected = (each.find_best(CONFIG.duration)[1] for each in (several, one))
    assert found == pytest.approx(expected, rel=0.05) and expected > 1.5


def test_durations_that_are_better_known_are_changed_less() -> None:
    pace = follow(Pipeline(CONFIG), reach(3.0)[:150]).learnt.pace
    factors = [pace.find_best(replace(CONFIG.duration, spread=each))[1] for each in (0.4, 0.2, 0.1, 0.0)]
    assert factors[0] > factors[1] > factors[2] > factors[3] == pytest.approx(1.0, abs=0.01)


def test_a_state_is_judged_with_the_goals_that_the_hand_has_come_nearer_to() -> None:
    angles = np.linspace(-np.pi, np.pi, 64, endpoint=False)
    places = 0.4 * np.column_stack([np.cos(angles), np.sin(angles)])
    present = follow(Pipeline(CONFIG), reach(3.0)[:120], goal=places).learnt.pace.present
    assert present is not None
    judged = np.flatnonzero(present.moved)
    assert MOST_GOALS <= len(judged) < 16 and np.abs(angles[judged]).max() < 1.0
    alone = follow(Pipeline(CONFIG), reach(3.0)[:120], goal=GOAL).learnt.pace
    assert present.moved[32] == alone.present.moved[0]
    np.testing.assert_allclose(present.errors[32], alone.present.errors[0])


def test_goals_keep_their_errors_by_their_places_and_new_ones_have_none() -> None:
    goals = np.vstack([GOAL, GOAL + 0.2, GOAL - 0.2])
    present = follow(Pipeline(CONFIG), reach(3.0)[:150], goal=goals).learnt.pace.present
    assert present is not None and present.moved.all()
    matched = present.match(np.vstack([GOAL + 0.5, GOAL - 0.21, GOAL + 0.01]))
    np.testing.assert_array_equal(matched.errors, [0.0 * present.errors[0], present.errors[2], present.errors[0]])
    np.testing.assert_array_equal(matched.moved, [0.0, present.moved[2], present.moved[0]])


def test_goals_that_change_during_movements_do_not_keep_the_pace_from_being_learnt() -> None:
    pipeline, steady = Pipeline(CONFIG), follow(Pipeline(CONFIG), *[reach(4.0)] * 3)
    for number in range(3):
        for row, position in enumerate(reach(4.0)):
            both = np.vstack([GOAL, [[0.0, -0.3]]])
            pipeline.set_goals(both[:: 1 if row % 2 else -1] if row // 15 % 2 else GOAL.copy(), 'world')
            stamp_ns = NANOSECONDS * (1 + 10 * number) + row * STEP_NS
            pipeline.add_hand_sample(HandSample(stamp_ns, position, 0.0, 'world'))
    assert pipeline.learnt.pace.movements == steady.learnt.pace.movements
    assert pipeline.learnt.pace.find_best(CONFIG.duration)[1] == pytest.approx(
        steady.learnt.pace.find_best(CONFIG.duration)[1], rel=0.1
    )


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


def test_factors_stay_within_the_bounds_of_the_parameters() -> None:
    assert scale_durations(DurationConfig(model='fixed', fixed_s=50.0), 3.0).fixed_s == 60.0
    assert replace(Pace(), movements=1).find_best(DurationConfig()) == ('rest', pytest.approx(1.0))


@pytest.mark.parametrize('passing', [False, True])
def test_free_movements_end_at_the_goal_and_may_pass_it_at_their_speed(passing: bool) -> None:
    goal, start = np.array([0.3, 0.4]), np.array([0.0, 0.0, 0.15, 0.2])
    halfway, there = (find_free_positions(start, goal, np.array([2.0]), seconds, passing)[0] for seconds in (1.0, 3.0))
    np.testing.assert_allclose(there, goal, atol=1e-12)
    if passing:
        np.testing.assert_allclose(halfway, goal / 2.0, atol=1e-12)


@pytest.mark.parametrize('arrival', ['rest', 'passing'])
def test_free_movements_are_those_that_predictions_without_obstacles_plan(arrival: str) -> None:
    config = replace_values(Config(), {'duration.arrival': arrival, 'foc.steps': 100, 'foc.noise_x': 0.0})
    plan = reach_along_axis(config, np.array([0.05, 0.2, 0.0]), 0.4, 0.02).mean[:, 0]
    start, goal = np.array([0.05, 0.0, 0.2, 0.0]), np.array([0.4, 0.0])
    for step in (25, 50, 75):
        expected = find_free_positions(start, goal, np.array([2.0]), 0.02 * step, arrival == 'passing')
        assert expected[0, 0] == pytest.approx(plan[step], abs=1e-3)
