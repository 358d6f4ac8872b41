# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Baselines and the Singer model, against closed forms and plain geometry."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from evaluation_samples import TWO_CLASSES, make_candidates, observation, recorded

from foc_ros.analysis.evaluation.baselines import (
    BASELINES,
    boltzmann_shares,
    compute_straight_costs,
    compute_straight_positions,
    guess_constant_velocity,
    guess_nearest_gap,
    guess_shortest_path,
    make_baselines,
    power_rule_shares,
)
from foc_ros.analysis.evaluation.positions import SINGER_SETTINGS, forecast_singer
from foc_ros.analysis.evaluation.questions import GOAL, PATH_CLASS, ask, ask_main
from foc_ros.analysis.evaluation.scores import compute_log_likelihoods
from foc_ros.analysis.evaluation.truth import HORIZONS_S
from foc_ros.core.config import LikelihoodConfig
from foc_ros.core.solution import LEFT, RIGHT

L, R = LEFT, RIGHT


def ask_of(observed, name=PATH_CLASS):
    return ask(name, observed, frozenset('012'))


@pytest.mark.parametrize(
    ('velocity', 'side'),
    [((1.0, 0.6), L), ((1.0, -0.6), R), ((1.0, 0.1), R), ((0.0, 0.2), L), ((-0.5, 0.2), L)],
)
def test_constant_velocity_passes_the_obstacle_on_its_line_or_on_the_side_to_which_it_turns(velocity, side) -> None:
    observed = observation(TWO_CLASSES, centre=[(1.0, 0.3)], hand=(0.0, 0.0, *velocity, 0.0, 0.0))
    assert guess_constant_velocity(observed, ask_of(observed)) == (side,)


GOALS = [(1.0, 0.0), (0.0, 1.0), (1.0, 1.0)]


def test_towards_goals_constant_velocity_takes_the_direction_and_the_nearest_is_the_nearest() -> None:
    candidates = make_candidates(np.zeros((3, 0)), goal=[0, 1, 2])
    none = {'centre': (), 'row': (), 'true_sides': ()}
    observed = observation(candidates, **none, goals=GOALS, hand=(0.0, 0.0, 0.9, 1.0, 0.0, 0.0))
    assert guess_constant_velocity(observed, ask_of(observed, GOAL)) == (2,)
    assert guess_nearest_gap(replace(observed, hand=np.array([0.1, 0.4, 1.0, 0.0, 0.0, 0.0])), ask_of(observed, GOAL)) == (1,)
    assert guess_shortest_path(observed, ask_of(observed, GOAL)) == (0,)


def test_boltzmann_weighs_differences_and_the_power_rule_ratios_of_effort() -> None:
    observed = observation(make_candidates([[L], [R]], cost_to_go=[1.0, 3.0]))
    np.testing.assert_allclose(boltzmann_shares(observed, np.log(2.0)), [0.8, 0.2])
    np.testing.assert_allclose(power_rule_shares(observed, LikelihoodConfig(beta=2.0)), [0.9, 0.1])


def reaching(hand=(0.0,) * 6, time_s=2.0, **more):
    candidates = replace(make_candidates(np.zeros((2, 0)), goal=[0, 1]), time_s=np.array([time_s, time_s]))
    none = {'centre': (), 'row': (), 'true_sides': ()}
    return observation(candidates, **none, goals=[(1.0, 0.0), (0.0, 2.0)], hand=hand, **more)


def test_straight_minimum_jerk_from_rest_has_the_known_effort_and_path() -> None:
    np.testing.assert_allclose(compute_straight_costs(reaching()), [720.0 / 2.0**5, 720.0 * 4.0 / 2.0**5])
    s = np.array([0.5, 1.0])
    expected = s**3 * (10.0 - 15.0 * s + 6.0 * s**2)
    np.testing.assert_allclose(compute_straight_positions(reaching(), 0, 2.0 * s)[:, 0], expected)
    np.testing.assert_allclose(compute_straight_positions(reaching(), 0, np.array([5.0])), [[1.0, 0.0]])


def test_straight_minimum_jerk_from_any_state_has_the_effort_of_its_own_jerk() -> None:
    observed = reaching((0.2, -0.1, 0.5, 0.3, -1.0, 2.0))
    t = np.linspace(0.0, 2.0, 4001)
    for goal in (0, 1):
        path = compute_straight_positions(observed, goal, t)
        jerk = np.gradient(np.gradient(np.gradient(path, t, axis=0), t, axis=0), t, axis=0)[5:-5]
        assert (jerk**2).sum() * t[1] == pytest.approx(compute_straight_costs(observed)[goal], rel=0.02)
        np.testing.assert_allclose(path[-1], observed.goals[goal], atol=1e-9)
        np.testing.assert_allclose((path[1] - path[0]) / t[1], [0.5, 0.3], atol=1e-2)


def test_every_baseline_forecasts_every_setting() -> None:
    recording = recorded(observation(make_candidates([[L], [R]], cost_to_go=[1.0, 3.0])))
    pairs = ask_main(recording)
    compared = make_baselines([recording], LikelihoodConfig())
    assert [baseline.name for baseline in compared] == list(BASELINES) and len(compared) >= 9
    for baseline in compared:
        logs = compute_log_likelihoods(pairs, baseline)
        assert logs.shape == (len(baseline.settings),) and np.isfinite(logs).all() and (logs <= 0.0).all()
        # with its least certain setting, a predictor is hardly worse than a uniform guess
        assert logs.max() >= np.log(0.5) - 0.02 or baseline.name == 'foc'


AHEAD = np.array(HORIZONS_S)


def test_a_steady_motion_is_continued_and_an_uncertain_one_has_its_error() -> None:
    stamps_ns = np.arange(0, 2_000_000_000, 20_000_000)
    positions = np.outer(stamps_ns / 1e9, [0.3, -0.1])
    mean, variance = forecast_singer(stamps_ns, positions, stamps_ns[[20, 99]], AHEAD)
    expected = positions[99] + AHEAD[:, None] * [0.3, -0.1]
    np.testing.assert_allclose(mean[1], np.tile(expected, (len(SINGER_SETTINGS), 1, 1)), atol=2e-3)
    assert mean.shape == (2, len(SINGER_SETTINGS), 3, 2) and (np.diff(variance, axis=2) > 0.0).all()


def test_a_forecast_knows_nothing_of_later_samples() -> None:
    draws = np.random.default_rng(0)
    stamps_ns, positions = np.arange(0, 10**9, 5 * 10**7), np.cumsum(draws.normal(0.0, 0.01, (20, 2)), axis=0)
    other = np.where(np.arange(20)[:, None] > 10, 1.0, positions)
    for one, two in zip(*(forecast_singer(stamps_ns, each, stamps_ns[:11], AHEAD) for each in (positions, other)), strict=True):
        np.testing.assert_array_equal(one, two)
