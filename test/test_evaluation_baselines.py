"""Baselines, against closed forms and plain geometry."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from evaluation_samples import TWO_WAYS, observation, recorded, ways

from foc_ros.analysis.evaluation.families import baseline_grids
from foc_ros.analysis.evaluation.forecasts import (
    boltzmann,
    constant_velocity,
    nearest_gap,
    power_rule,
    shortest_path,
    straight_minimum_jerk,
)
from foc_ros.analysis.evaluation.heldout import asked, log_likelihoods
from foc_ros.analysis.evaluation.minimum_jerk import straight_cost, straight_positions
from foc_ros.analysis.evaluation.observations import TIMES_S
from foc_ros.analysis.evaluation.questions import GOAL, WAY, question
from foc_ros.core.config import LikelihoodConfig
from foc_ros.core.types import LEFT, RIGHT

L, R = LEFT, RIGHT


def ask(seen, name=WAY):
    return question(name, seen, frozenset('012'))


@pytest.mark.parametrize(('vy', 'side'), [(0.6, L), (-0.6, R), (0.1, R)])
def test_constant_velocity_goes_on_past_the_obstacle(vy, side) -> None:
    seen = observation(TWO_WAYS, centre=[(1.0, 0.3)], hand=(0.0, 0.0, 1.0, vy, 0.0, 0.0))
    assert constant_velocity(seen, ask(seen)) == (side,)


def test_constant_velocity_of_a_hand_that_goes_aside_or_back_passes_on_that_side() -> None:
    for vx in (0.0, -0.5):
        seen = observation(TWO_WAYS, centre=[(1.0, 0.3)], hand=(0.0, 0.0, vx, 0.2, 0.0, 0.0))
        assert constant_velocity(seen, ask(seen)) == (L,)


def test_a_hand_at_rest_goes_straight_ahead_and_so_does_the_nearest_gap() -> None:
    seen = observation(TWO_WAYS, centre=[(1.0, 0.3)], hand=(0.0, 0.0, 0.0, 9.0, 0.0, 0.0), since_s=0.0)
    assert constant_velocity(seen, ask(seen)) == nearest_gap(seen, ask(seen)) == (R,)
    assert nearest_gap(replace(seen, hand=np.array([0.0, 0.4, 1.0, -1.0, 0.0, 0.0])), ask(seen)) == (L,)


GOALS = [(1.0, 0.0), (0.0, 1.0), (1.0, 1.0)]


def test_towards_goals_constant_velocity_takes_the_direction_and_the_nearest_is_the_nearest() -> None:
    candidates = ways(np.zeros((3, 0)), goal=[0, 1, 2])
    none = {'centre': (), 'row': (), 'true_sides': ()}
    seen = observation(candidates, **none, goals=GOALS, hand=(0.0, 0.0, 0.9, 1.0, 0.0, 0.0))
    assert constant_velocity(seen, ask(seen, GOAL)) == (2,)
    assert nearest_gap(replace(seen, hand=np.array([0.1, 0.4, 1.0, 0.0, 0.0, 0.0])), ask(seen, GOAL)) == (1,)
    assert shortest_path(seen, ask(seen, GOAL)) == (0,)


def test_boltzmann_weighs_differences_and_the_power_rule_ratios_of_effort() -> None:
    seen = observation(ways([[L], [R]], to_go=[1.0, 3.0]))
    np.testing.assert_allclose(boltzmann(seen, np.log(2.0)), [0.8, 0.2])
    np.testing.assert_allclose(power_rule(seen, LikelihoodConfig(beta=2.0)), [0.9, 0.1])


def reaching(hand=(0.0,) * 6, time_s=2.0, **more):
    candidates = replace(ways(np.zeros((2, 0)), goal=[0, 1]), time_s=np.array([time_s, time_s]))
    none = {'centre': (), 'row': (), 'true_sides': ()}
    return observation(candidates, **none, goals=[(1.0, 0.0), (0.0, 2.0)], hand=hand, **more)


def test_straight_minimum_jerk_from_rest_has_the_known_effort_and_path() -> None:
    np.testing.assert_allclose(straight_cost(reaching()), [720.0 / 2.0**5, 720.0 * 4.0 / 2.0**5])
    s = np.array([0.5, 1.0])
    expected = s**3 * (10.0 - 15.0 * s + 6.0 * s**2)
    np.testing.assert_allclose(straight_positions(reaching(), 0, 2.0 * s)[:, 0], expected)
    np.testing.assert_allclose(straight_positions(reaching(), 0, np.array([5.0])), [[1.0, 0.0]])


def test_straight_minimum_jerk_from_any_state_has_the_effort_of_its_own_jerk() -> None:
    seen = reaching((0.2, -0.1, 0.5, 0.3, -1.0, 2.0))
    t = np.linspace(0.0, 2.0, 4001)
    for goal in (0, 1):
        path = straight_positions(seen, goal, t)
        jerk = np.gradient(np.gradient(np.gradient(path, t, axis=0), t, axis=0), t, axis=0)[5:-5]
        assert (jerk**2).sum() * t[1] == pytest.approx(straight_cost(seen)[goal], rel=0.02)
        np.testing.assert_allclose(path[-1], seen.goals[goal], atol=1e-9)
        np.testing.assert_allclose((path[1] - path[0]) / t[1], [0.5, 0.3], atol=1e-2)


def test_where_time_has_a_price_it_is_part_of_the_cost_of_a_straight_movement() -> None:
    priced = replace(reaching(), ways=replace(reaching().ways, price=7.0))
    np.testing.assert_allclose(straight_cost(priced), straight_cost(reaching()) + 7.0 * 2.0)


def test_the_speed_of_a_hand_at_rest_is_noise_to_minimum_jerk_too() -> None:
    np.testing.assert_allclose(straight_cost(reaching((0.0, 0.0, 1.0, 1.0, 9.0, 9.0), since_s=0.0)), straight_cost(reaching()))


def test_straight_minimum_jerk_weighs_goals_by_the_ratio_of_efforts() -> None:
    forecast = straight_minimum_jerk(reaching(), ask(reaching(), GOAL), 1.0, 0.99)
    np.testing.assert_allclose(forecast.probability, 0.99 * np.array([0.8, 0.2]) + 0.005)


def test_every_family_forecasts_every_setting() -> None:
    recording = recorded(observation(ways([[L], [R]], to_go=[1.0, 3.0])))
    pairs = asked(recording)
    compared = baseline_grids([recording], LikelihoodConfig())
    assert len({family.name for family in compared}) == len(compared) == 9
    for family in compared:
        logs = log_likelihoods(pairs, family)
        assert logs.shape == (len(family.settings),) and np.isfinite(logs).all() and (logs <= 0.0).all()
        # least sure of all, a predictor is no worse than an even guess by more than its doubt
        assert logs.max() >= np.log(0.5) - 0.02 or family.name == 'foc'


def test_the_horizons_are_among_the_times() -> None:
    assert {0.25, 0.5, 1.0} <= set(TIMES_S)
