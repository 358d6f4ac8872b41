# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Parameters that a fit finds without a prediction, and what a table of settings determines."""

import numpy as np
import pytest
from evaluation_samples import reach as resting_reach
from fit_recordings import GOALS, reach, recorded_hand

from foc_ros.analysis.fitting import SettingTable
from foc_ros.analysis.fitting.direct import FADING, fit_duration, fit_estimator, fit_fading, fit_wait
from foc_ros.core.config import Config, replace_values
from foc_ros.core.hand.kalman import compute_gramian, compute_transition
from foc_ros.core.obstacle_table import make_obstacles

CONFIG = replace_values(Config(), {'estimator.acceleration_time_s': 0.0})
GOAL = np.array([[0.3, 0.0]])
BETA, WEAVING = 'likelihood.beta', 'likelihood.weaving'
VALUES = np.array([1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 8.0])


def _make_table(log_likelihood, values=VALUES):
    """Return a table of one recording by exponent and weaving."""
    grid = [(beta, weaving) for beta in values for weaving in values]
    settings = tuple({BETA: beta, WEAVING: weaving} for beta, weaving in grid)
    return SettingTable(log_likelihood(*np.array(grid).T)[None], settings)


GIVEN = {BETA: 2.0, WEAVING: 4.0}


FLAT = 'all values tried, 1 to 8, explain the recordings within 2 nat'
END = '8, the end of the values tried, explains the recordings best'


@pytest.mark.parametrize(
    ('log_likelihood', 'values', 'expected', 'undetermined'),
    [
        pytest.param(lambda b, w: -10 * ((b - 6) ** 2 + (w - 2) ** 2), VALUES, (6.0, 2.0), {}, id='a sharp peak'),
        pytest.param(
            lambda b, w: -0.01 * ((b - 6) ** 2 + (w - 2) ** 2), VALUES, (None, None), {BETA: FLAT, WEAVING: FLAT}, id='flat'
        ),
        pytest.param(lambda b, w: 10 * b - 10 * (w - 2) ** 2, VALUES, (None, 2.0), {BETA: END}, id='best at the end'),
        pytest.param(lambda b, w: -10 * b - 10 * (w - 2) ** 2, np.append(0.0, VALUES), (0.0, 2.0), {}, id='best at a bound'),
    ],
)
def test_what_a_table_of_log_likelihoods_determines(log_likelihood, values, expected, undetermined):
    found = _make_table(log_likelihood, values).estimate(GIVEN, 'how')[0]
    assert found.values == {name: each for name, each in zip(GIVEN, expected, strict=True) if each is not None}
    assert found.undetermined == undetermined


def test_where_only_a_sum_is_determined_one_part_is_kept_and_the_other_follows():
    found = _make_table(lambda beta, weaving: -10.0 * (beta + weaving - 7.0) ** 2).estimate(GIVEN, 'how')[0]
    (name,), (kept,) = found.estimates, found.undetermined
    assert found.estimates[name].value == 7.0 - GIVEN[kept]


def _drifting(seed, stddev, density, count=6):
    """Return hands that are driven by white jerk, as the filter expects."""
    rng = np.random.default_rng(seed)
    times = np.cumsum(rng.uniform(0.01, 0.03, 200))
    found = []
    for number in range(count):
        state, path = np.zeros((3, 2)), []
        for dt in np.diff(times, prepend=times[0] - 0.02):
            state = compute_transition(dt) @ state + density * np.linalg.cholesky(compute_gramian(dt)) @ rng.standard_normal(
                (3, 2)
            )
            path.append(state[0] + rng.normal(0.0, stddev, 2))
        found.append(recorded_hand(f'{number}', times, np.array(path), make_obstacles(), GOALS))
    return found


@pytest.mark.parametrize(('stddev', 'density'), [(1e-3, 3.0), (3e-4, 20.0)])
def test_the_deviations_that_made_the_data_are_found(stddev, density):
    found = fit_estimator(_drifting(2, stddev, density), Config())
    assert found.undetermined == {}
    estimates = found.estimates
    for name, true in (('estimator.position_stddev', stddev), ('estimator.jerk_density', density)):
        each = estimates[name]
        assert each.low <= each.value <= each.high
        assert each.value == pytest.approx(true, rel=0.1)
        assert 0.8 * each.low < true < 1.2 * each.high


def _reaches(durations, goals):
    rng = np.random.default_rng(4)
    rows = [reach(goal, 0.0, seconds, 100.0, rng, 2e-4) for seconds, goal in zip(durations, goals, strict=True)]
    return [
        recorded_hand(f'{k}', each[:, 0], each[:, 1:], make_obstacles(), goal[None])
        for k, (each, goal) in enumerate(zip(rows, goals, strict=True))
    ]


def test_one_factor_is_fitted_where_distances_are_alike():
    config = replace_values(Config(), {'estimator.position_stddev': 2e-4})
    given = config.duration.fitts_a_s + config.duration.fitts_b_s * np.log2(0.3 / config.duration.target_width + 1)
    goals = np.tile([0.3, 0.0], (5, 1))
    found = fit_duration(_reaches([2.0 * given] * 5, goals), config)
    estimates = found.estimates
    a, b = estimates['duration.fitts_a_s'], estimates['duration.fitts_b_s']
    assert a.value / config.duration.fitts_a_s == pytest.approx(b.value / config.duration.fitts_b_s, rel=1e-4)
    assert a.value / config.duration.fitts_a_s == pytest.approx(2.0, rel=0.2)
    assert a.low <= a.value <= a.high
    assert any('too alike to tell intercept and slope apart' in words for words in found.warnings)


def test_distances_that_differ_determine_intercept_and_slope():
    config = replace_values(Config(), {'estimator.position_stddev': 2e-4})
    distances = np.array([0.05, 0.1, 0.2, 0.4, 0.8])
    durations = 0.5 + 0.3 * np.log2(distances / config.duration.target_width + 1)
    found = fit_duration(_reaches(durations.tolist(), np.column_stack([distances, np.zeros(5)])), config)
    assert found.warnings == [] and found.undetermined == {}
    estimates = found.estimates
    fitted = estimates['duration.fitts_a_s'].value + estimates['duration.fitts_b_s'].value * np.log2(
        distances / config.duration.target_width + 1
    )
    # the filter detects each onset equally late
    assert (fitted - durations).min() > -0.25 and (fitted - durations).max() < 0.0
    assert np.ptp(fitted - durations) < 0.05


@pytest.mark.parametrize('fading_s', [0.06, 0.2])
def test_the_time_in_which_accelerations_fade_is_found(fading_s):
    rng, dt = np.random.default_rng(5), 0.005
    hands = []
    for number in range(6):
        state, path = np.array([[0.0, 0.0], [0.2, 0.0], [0.0, 0.0]]), []
        for _ in range(2000):
            state = compute_transition(dt) @ state
            # white jerk drives a fading acceleration
            state[2] = state[2] * np.exp(-dt / fading_s) + 3.0 * np.sqrt(dt) * rng.standard_normal(2)
            path.append(state[0])
        hands.append(recorded_hand(str(number), dt * np.arange(2000.0), np.array(path), make_obstacles(), GOAL))
    # this filter follows accelerations at once, so that its lag does not affect the estimate
    config = replace_values(CONFIG, {'estimator.position_stddev': 1e-6, 'estimator.jerk_density': 30.0})
    found = fit_fading(hands, config).estimates[FADING]
    assert found.low <= found.value <= found.high
    assert found.value == pytest.approx(fading_s, rel=0.25)


def _make_resting(rest):
    return recorded_hand('one', *resting_reach(0.0, (0.3, 0.0), rest=rest), make_obstacles([], []), GOAL)


def test_half_of_the_wait_is_left_on_average_and_the_stay_at_the_goal_does_not_count():
    found = fit_wait([_make_resting(0.6), _make_resting(1.0)], Config()).estimates
    # the wait includes the first 0.15 s of a movement, until its onset is detected
    assert found['duration.wait_s'].value == pytest.approx(0.4, abs=0.1)
    assert found['duration.wait_s'].low < found['duration.wait_s'].value < found['duration.wait_s'].high
