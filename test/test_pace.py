# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Expected durations follow the operator's movements: causally, equally for equal input, and until a reset."""

from dataclasses import replace

import numpy as np
import pytest
from test_demonstrations import GOAL, OBSTACLES, bow

from foc_ros.core.classes.library import MOST_STATES
from foc_ros.core.config import Config, CovarianceConfig, replace_values
from foc_ros.core.hand.duration import compute_movement_time, scale_durations
from foc_ros.core.learning import movements as learning
from foc_ros.core.learning.dispersion import Dispersion
from foc_ros.core.learning.recordings import PRIOR_COUNT
from foc_ros.core.obstacle_table import make_obstacles
from foc_ros.core.pipeline import Pipeline
from foc_ros.core.prediction import PredictedCandidate
from foc_ros.core.solution import Candidate, Solution, Status
from foc_ros.core.types import NANOSECONDS, HandSample, HandState
from foc_ros.ros.health import Freshness, Monitor
from foc_ros.ros.intake import Intake

CONFIG = replace_values(Config(), {'estimator.position_stddev': 1e-4})
FAR_GOAL = np.array([[0.4, 0.0]])
STEP_S = 0.01
STRAIGHT = np.array([[0.0, 0.0], [0.4, 0.0]])
ABOVE, BELOW = bow(0.03), bow(-0.03)
TURNS = [0.1, 0.0] - 0.2 * np.column_stack([each(np.pi * np.linspace(0.0, 11.0, 400)) for each in (np.cos, np.sin)])
"""A circle through the goal, around which a path goes five and a half times."""


def move_along(path, seconds=1.5, rest_s=0.4, after_s=0.4):
    """Return positions at 100 Hz of a minimum-jerk movement along a path, at rest before and after."""
    s = np.clip((np.arange(0.0, seconds + rest_s + after_s, STEP_S) - rest_s) / seconds, 0.0, 1.0)
    along, at = 10 * s**3 - 15 * s**4 + 6 * s**5, np.linspace(0.0, 1.0, len(path))
    return np.column_stack([np.interp(along, at, axis) for axis in path.T])


def reach(duration_s):
    return move_along(STRAIGHT, duration_s, 0.6, 0.6)


def follow(pipeline, *movements, goals=FAR_GOAL, obstacles=None, is_predicting=False):
    """Pass movements to a pipeline, with a jump of time before each; return the predictions."""
    made = []
    for positions in movements:
        if obstacles is not None:
            pipeline.set_obstacles('cloud', obstacles, None, 'world')
        pipeline.set_goals(goals, 'world')
        start_ns = (0 if pipeline.hand_state is None else pipeline.hand_state.stamp_ns) + 2 * NANOSECONDS
        for row, position in enumerate(positions):
            pipeline.add_hand_sample(HandSample(start_ns + round(row * STEP_S * NANOSECONDS), position, 0.0, 'world'))
            if is_predicting and pipeline.is_due:
                made.append(pipeline.predict())
    return made


@pytest.mark.parametrize(('factor', 'spread'), [(0.6, 0.4), (1.0, 0.4), (2.0, 0.4), (3.0, 0.4), (0.6, 0.0), (2.0, 0.0)])
def test_the_factor_approaches_that_of_the_operator(factor, spread):
    config = replace_values(CONFIG, {'duration.spread': spread})
    pipeline, duration_s = Pipeline(config), factor * compute_movement_time(0.4, config.duration)
    follow(pipeline, *[reach(duration_s)] * 3)
    assert pipeline.learnt.pace.movements >= 2
    arrival, found = pipeline.learnt.pace.find_best(config.duration)
    assert arrival == 'rest' and found == pytest.approx(factor, rel=0.3)
    assert pipeline.adapted_config.duration == scale_durations(config.duration, found)


def test_an_operator_who_passes_the_goals_is_recognised():
    """The hand crosses the goal at the constant speed with which it came, and stops beyond it."""
    there = np.arange(0.0, 0.4, 0.2 * STEP_S)
    beyond = 0.4 + 0.2 * 0.05 * (1.0 - np.exp(-np.arange(0.0, 0.5, STEP_S) / 0.05))
    pipeline, movement = Pipeline(CONFIG), np.outer(np.concatenate([np.zeros(60), there, beyond]), [1.0, 0.0])
    follow(pipeline, *[movement] * 3)
    assert pipeline.learnt.pace.movements >= 2 and pipeline.learnt.pace.find_best(CONFIG.duration)[0] == 'passing'
    assert pipeline.adapted_config.duration.arrival == 'passing'


STDDEV = 0.02
FIXED = {'duration.adaptation': 'none'}
DISPERSION_CONFIG = replace_values(Config(), {'rate_hz': 10.0, 'foc.steps': 15, 'estimator.position_stddev': 1e-4} | FIXED)


def place_hand(stamp_ns, position=(0.0, 0.0)):
    mean = np.array([*position, 0.0, 0.0, 0.0, 0.0])
    return HandState(stamp_ns, mean, np.eye(6), onset_ns=0, onset_position=np.zeros(2))


def judge(ahead_s, factor, duration_s):
    """Return what is learnt if the hand is beside a candidate by `factor` standard deviations in 2D some time later.

    The candidate stays at the origin, with a standard deviation of `STDDEV` along each axis.
    """
    mean, covariance = np.zeros((9, 6)), np.tile(STDDEV**2 * np.eye(6), (9, 1, 1))
    solution = Solution(Status.SOLVED, '', duration_s / 8.0, mean, covariance, np.zeros((8, 2)), 1.0, {}, 0.0, 0.0, 1.0)
    candidate = PredictedCandidate(Candidate('goal0', 0, (), mean[:, :2], 0.0), solution, {}, 1.0, 1.0)
    due_ns, dispersion = round(ahead_s * NANOSECONDS), Dispersion()
    for position in factor * STDDEV * np.random.default_rng(3).standard_normal((60, 2)):
        dispersion = dispersion.interrupt().follow(place_hand(0)).add(0, [candidate], CovarianceConfig())
        due = tuple(replace(each, count=1.0) for each in dispersion.forecasts if each.due_ns == due_ns)
        dispersion = replace(dispersion, forecasts=due).follow(place_hand(due_ns, position))
    return dispersion


@pytest.mark.parametrize('factor', [0.25, 3.0])
@pytest.mark.parametrize(('ahead_s', 'duration_s', 'share'), [(0.25, 10.0, 0.000625), (1.0, 2.0, 0.25), (1.0, 0.8, 1.0)])
def test_the_factor_of_gaussian_errors_is_recovered(factor, ahead_s, duration_s, share):
    dispersion = judge(ahead_s, factor, duration_s)
    assert dispersion.errors == 60
    near, far = dispersion.factors
    assert near ** (1.0 - share) * far**share == pytest.approx(factor, rel=0.15)
    if share == 1.0:
        assert near == pytest.approx(1.0, abs=0.1)


AROUND = move_along(np.column_stack([x := np.linspace(0.0, 0.3, 101), 0.06 * np.sin(np.pi * x / 0.3)]), 0.8, 0.3, 0.5)


def reach_around(pipeline):
    return follow(pipeline, AROUND, goals=GOAL, obstacles=make_obstacles([[0.15, 0.0]], 0.03, 0.001), is_predicting=True)


def test_without_a_movement_or_switched_off_nothing_is_learnt():
    still = Pipeline(CONFIG)
    follow(still, np.zeros((200, 2)))
    assert still.learnt.pace.movements == 0 and still.learnt.pace.find_best(CONFIG.duration) == ('rest', 1.0)
    assert still.adapted_config is CONFIG
    off = Pipeline(replace_values(CONFIG, {'duration.adaptation': 'none', 'covariance.adaptation': 'none'}))
    follow(off, reach(4.0), reach(4.0))
    reach_around(off)
    assert off.learnt.pace.movements == off.learnt.dispersion.errors == 0 and off.adapted_config is off.config


def test_factors_scale_the_covariance_and_nothing_else():
    off = {'covariance.adaptation': 'none'}
    plain = reach_around(Pipeline(replace_values(DISPERSION_CONFIG, off)))
    scaled = reach_around(Pipeline(replace_values(DISPERSION_CONFIG, off | {'covariance.near': 2.0, 'covariance.far': 3.0})))
    assert len(plain) == len(scaled) > 10
    for one, other in zip(plain, scaled, strict=True):
        for before, after in zip(one.candidates, other.candidates, strict=True):
            np.testing.assert_allclose(after.covariance_at(after.times), after.covariance[:, :2, :2], rtol=1e-12)
            for count, exact in ((len(after.mean), 1e-12), (333, 1e-4)):  # at the steps, and between them
                shares = np.linspace(0.0, 1.0, count)
                expected = (2.0 * 1.5**shares**2)[:, None, None] ** 2 * before.covariance_at(shares * before.times[-1])
                found = after.covariance_at(shares * after.times[-1])
                np.testing.assert_allclose(found, expected, atol=exact * expected.max())
            np.testing.assert_array_equal(after.mean, before.mean)
            np.testing.assert_array_equal(after.motor_covariance, before.motor_covariance)
            assert after.likelihood == before.likelihood


MOVEMENT_CONFIG = Config().with_values(
    {'experience.learning': 'online', 'rate_hz': 4.0, 'foc.steps': 20, 'estimator.position_stddev': 1e-4}
)


def learn(*movements, goals=GOAL, library=(), is_predicting=False, **values):
    """Return a pipeline that has followed movements past obstacles, and what it predicted."""
    pipeline = Pipeline(MOVEMENT_CONFIG.with_values(values), library)
    return pipeline, follow(pipeline, *movements, goals=goals, obstacles=OBSTACLES, is_predicting=is_predicting)


def list_learnt(*movements, **options):
    return learn(*movements, **options)[0].learnt.movements.learnt


def likelihood_above(prediction):
    return sum(each.likelihood for each in prediction.candidates if dict(each.candidate.sides).get(OBSTACLES.ids[0]) == 1)


def test_a_repeated_way_becomes_more_likely():
    ways = [move_along(ABOVE)] * 4
    first, last = [], []
    for learning_ in ('none', 'online'):
        values = {'experience.learning': learning_, 'likelihood.other_goal': 0.0, 'rate_hz': 1.0}
        _, predicted = learn(*ways, is_predicting=True, **values)
        first.append(likelihood_above(predicted[0]))
        last.append(likelihood_above(predicted[3 * (len(predicted) // len(ways))]))
    assert first[0] == first[1], 'nothing is known before the first movement'
    assert last[1] == pytest.approx((PRIOR_COUNT * last[0] + 3.0) / (PRIOR_COUNT + 3.0), abs=0.02)


REST = np.zeros((2, 2))


def test_a_movement_is_learnt_when_it_has_ended():
    path = move_along(ABOVE, after_s=2.0)
    assert not list_learnt(path[: round((0.4 + 1.5) / STEP_S)])
    (found,) = list_learnt(path)
    assert found.states is not None
    around = np.hypot(*(found.states[-1, :2] - GOAL[0])), np.hypot(*found.states[0, :2])
    assert max(around) < 0.005
    assert len(found.states) == pytest.approx((0.4 + 1.5 + learning.AROUND_S) / learning.STEP_S, abs=8)


def test_a_rest_on_the_way_is_part_of_a_movement_and_one_at_a_goal_ends_it():
    halfway = ABOVE[: len(ABOVE) // 2 + 1]
    paused = np.concatenate([move_along(halfway, after_s=0.1), move_along(ABOVE[len(ABOVE) // 2 :], rest_s=0.1)[1:]])
    (found,) = list_learnt(paused, REST)
    assert np.hypot(*found.path[0]) < 0.01
    there_and_back = np.concatenate([move_along(ABOVE), move_along(ABOVE[::-1])[1:]])
    there, back = list_learnt(there_and_back, REST, goals=np.array([[0.3, 0.0], [0.0, 0.0]]))
    assert np.hypot(*(there.path[-1] - [0.3, 0.0])) == 0.0 and np.hypot(*back.path[-1]) == 0.0
    assert there.sides == tuple(-side for side in back.sides)


@pytest.mark.parametrize(
    ('path', 'goals', 'reason'),
    [
        (move_along(0.7 * ABOVE), GOAL, 'm from the nearest'),
        (move_along(0.1 * ABOVE, seconds=0.4), np.array([[0.03, 0.0]]), 'at least 0.05 m'),
        (move_along(TURNS, seconds=25.0), GOAL, 'at most 19 s'),
        (move_along(ABOVE), np.zeros((0, 2)), 'without goals'),
    ],
    ids=['no goal reached', 'short', 'long', 'no goals'],
)
def test_what_is_no_demonstration_is_refused(path, goals, reason):
    movements = learn(path, goals=goals)[0].learnt.movements.finish()
    assert not movements.learnt and movements.refused == 1 and reason in movements.refusal
    assert len(movements.states) <= MOST_STATES


SLOW = reach(4.0), reach(3.5), reach(4.2)
LEARNING = {
    'pace': (CONFIG, lambda each: follow(each, *SLOW), {}, {'duration.fitts_b_s': 0.4}),
    'dispersion': (DISPERSION_CONFIG, reach_around, {}, {'foc.endpoint_stddev': 0.1}),
    'movements': (
        MOVEMENT_CONFIG,
        lambda each: follow(each, move_along(ABOVE), REST, goals=GOAL, obstacles=OBSTACLES),
        {'likelihood.beta': 3.0},
        {'estimator.jerk_density': 3.0},
    ),
}
"""Parameters, a movement, other values of parameters that change nothing of what is learnt, and of one on which it depends."""


def count_learnt(pipeline, name):
    learnt = pipeline.learnt
    return {'pace': learnt.pace.movements, 'dispersion': learnt.dispersion.errors, 'movements': len(learnt.movements.learnt)}[
        name
    ]


@pytest.mark.parametrize('name', LEARNING)
def test_a_reset_and_new_parameters_forget_what_was_learnt_with_the_old_ones_and_keep_the_library(name):
    (given,), (config, move, others, changed) = list_learnt(move_along(BELOW), REST), LEARNING[name]
    for forget in (Pipeline.reset, lambda each: each.reconfigure(config.with_values(changed))):
        pipeline = Pipeline(config, [given])
        move(pipeline)
        known = count_learnt(pipeline, name)
        pipeline.reconfigure(config.with_values({'rate_hz': 20.0} | others))
        assert count_learnt(pipeline, name) == known > 0
        forget(pipeline)
        assert count_learnt(pipeline, name) == 0 and pipeline._library.recordings == (given,)
    pipeline.reset()
    assert pipeline.adapted_config is pipeline.config


def test_the_diagnostics_count_movements():
    pipeline, _ = learn(move_along(ABOVE), move_along(0.7 * BELOW), REST)
    health = Monitor(Intake(pipeline), Freshness(pipeline), 0.0).report(1.0, 'active', 0.0, [])
    assert any('1 movements recorded, 1 refused' in value for value in health.values.values())
