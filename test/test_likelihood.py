# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Likelihoods: from ratios of costs, over the time until a choice, by the next row of obstacles, and of classes that miss eta."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import norm

import foc_ros
from foc_ros.core.classes.rows import Decisions, find_decisions
from foc_ros.core.classes.sides import BranchTimes
from foc_ros.core.config import LikelihoodConfig
from foc_ros.core.likelihood import compute_likelihoods
from foc_ros.core.obstacle_table import make_obstacles
from foc_ros.core.solution import LEFT, RIGHT, Status
from foc_ros.core.types import HandState


def test_ratio_of_likelihoods_is_the_power_of_the_ratio_of_costs():
    p = compute_likelihoods(np.array([1.0, 4.0, 9.0]), LikelihoodConfig(beta=0.5))
    np.testing.assert_allclose(p, np.array([6.0, 3.0, 2.0]) / 11.0, rtol=1e-14)


@given(st.lists(st.floats(0.0, 1.7e308), min_size=1, max_size=12), st.floats(0.0, 100.0))
def test_any_costs_give_a_distribution_in_the_order_of_the_costs(costs, beta):
    p = compute_likelihoods(np.array(costs), LikelihoodConfig(beta=beta))
    assert np.all((p >= 0.0) & (p <= 1.0))
    assert p.sum() == pytest.approx(1.0)
    assert np.all(np.diff(p[np.argsort(costs, kind='stable')]) <= 0.0)


THREE_COSTS = np.array([1.0, 2.0, 5.0])


LOOKING_AHEAD = LikelihoodConfig(beta=2.0, planning_horizon_s=0.0, lookahead_s=0.7)


def make_branch_times(after_s):
    return BranchTimes(np.where(np.eye(3, dtype=bool), np.inf, after_s), np.arange(3))


@pytest.mark.parametrize('after_s', [0.0, 0.3, 2.0])
def test_the_exponent_of_a_choice_fades_with_the_time_until_the_choice(after_s):
    fading = LikelihoodConfig(beta=2.0 * np.exp(-after_s / 0.7))
    found = compute_likelihoods(THREE_COSTS, LOOKING_AHEAD, make_branch_times(after_s))
    np.testing.assert_allclose(found, compute_likelihoods(THREE_COSTS, fading), rtol=1e-12)


@pytest.mark.parametrize(('horizon_s', 'share'), [(1000.0, 0.0), (4.0, norm.cdf(-math.log(2.0) / 0.5)), (2.0, 0.5), (0.0, 1.0)])
def test_who_needs_longer_than_the_planning_horizon_looks_ahead(horizon_s, share):
    planned = compute_likelihoods(THREE_COSTS, LOOKING_AHEAD)
    ahead = compute_likelihoods(THREE_COSTS, LOOKING_AHEAD, make_branch_times(1.0))
    config = replace(LOOKING_AHEAD, planning_horizon_s=horizon_s)
    found = compute_likelihoods(THREE_COSTS, config, make_branch_times(1.0), time_s=2.0, planning_spread=0.5)
    np.testing.assert_allclose(found, (1.0 - share) * planned + share * ahead, rtol=1e-12)
    at_goal = compute_likelihoods(THREE_COSTS, config, make_branch_times(1.0), time_s=0.0)
    np.testing.assert_array_equal(at_goal, ahead if horizon_s == 0.0 else planned)


OBSTACLES = make_obstacles([[0.1, 0.05], [0.1, -0.05], [0.3, 0.0]], 0.01)
GOALS = np.array([[0.5, 0.02], [0.5, -0.02]])
SIDES = np.array(
    [[LEFT, LEFT, LEFT], [RIGHT, LEFT, LEFT], [RIGHT, LEFT, RIGHT], [LEFT, RIGHT, LEFT], [RIGHT, RIGHT, RIGHT]], dtype=np.int8
)
GOAL = np.array([0, 1, 0, 1, 0])
FIVE_COSTS = np.array([1.0, 2.0, 3.0, 2.5, 4.0])
CONFIG = replace(LikelihoodConfig(), beta=2.0, planning_horizon_s=0.0, weaving=1.5)


def make_hand(x):
    return HandState(0, np.array([x, 0.0, 0.3, 0.0, 0.0, 0.0]), np.eye(6), onset_ns=0, onset_position=np.zeros(2))


def test_the_next_row_is_the_first_open_one_ahead():
    found = find_decisions(SIDES, GOAL, OBSTACLES, make_hand(0.0), GOALS)
    gap = found.next_gap
    assert gap[1] == gap[2] and len(set(gap.tolist())) == 4
    assert found.woven.tolist() == [0, 0, 0, 1, 0]
    beyond = find_decisions(SIDES, GOAL, OBSTACLES, make_hand(0.2), GOALS)
    assert len(set(beyond.next_gap[[0, 1, 3]].tolist())) == 1
    assert beyond.next_gap[0] != beyond.next_gap[4] and not beyond.woven.any()


def test_gaps_keep_their_weight_and_share_it_evenly_goals_share_that_of_their_way_and_weaving_costs_a_factor():
    decisions = Decisions(np.array([0, 1, 1, 2, 3]), np.arange(5), np.zeros(5, dtype=np.intp))
    near, p = compute_likelihoods(FIVE_COSTS, CONFIG), compute_likelihoods(FIVE_COSTS, CONFIG, decisions=decisions)
    np.testing.assert_allclose(np.bincount(decisions.next_gap, p), np.bincount(decisions.next_gap, near))
    assert p[1] == pytest.approx(p[2])
    goals = Decisions(np.zeros(5, dtype=np.intp), np.array([0, 0, 1, 1, 2]), np.zeros(5, dtype=np.intp))
    p = compute_likelihoods(FIVE_COSTS, CONFIG, decisions=goals)
    assert p[0] / p[1] == pytest.approx((FIVE_COSTS[1] / FIVE_COSTS[0]) ** CONFIG.beta), 'goals of one way are compared in full'
    np.testing.assert_allclose(np.bincount(goals.way, p), np.full(3, 1.0 / 3.0))
    straight = Decisions(np.arange(5), np.arange(5), np.zeros(5, dtype=np.intp))
    both = straight, straight._replace(woven=np.eye(5)[3])
    p, woven = (compute_likelihoods(FIVE_COSTS, CONFIG, decisions=each) for each in both)
    assert woven[3] / woven[0] == pytest.approx(p[3] / p[0] * np.exp(-1.5))


def test_a_class_that_misses_eta_takes_part_with_less_weight():
    cup = foc_ros.Circle((0.15, 0.01), radius=0.03, radius_stddev=0.003)
    values = {'foc.noise_x': 0.3, 'foc.noise_y': 0.3, 'foc.eta': 0.99, 'likelihood.lookahead_s': 0.0}
    found = foc_ros.solve_classes((0, 0), [(0.3, 0)], [cup], config=foc_ros.Config().with_values(values))
    assert {each.status for each in found} == {Status.COMPROMISED}
    assert all(each.has_likelihood and not each.is_solved and 0 < each.eta < 0.99 for each in found)
    assert sum(each.likelihood for each in found) == pytest.approx(1.0)
    likelihood = foc_ros.Config().likelihood
    weights = [each.cost**-likelihood.beta * math.exp(-likelihood.shortfall * each.solution.safety_shortfall) for each in found]
    np.testing.assert_allclose([each.likelihood for each in found], np.array(weights) / sum(weights))


def test_a_path_counts_once_where_the_obstacle_between_two_classes_moves_out_of_the_way():
    """The trolley is behind the goal before the hand arrives: its two sides are no choice, and those of the post are one."""
    post, trolley = foc_ros.Circle((0.12, 0.005), 0.03, name='post'), foc_ros.Circle((0.25, 0.0), 0.02, velocity=(0.1, 0.0))
    alone, beside = (foc_ros.solve_classes((0.0, 0.0), (0.3, 0.0), each) for each in ([post], [post, trolley]))
    assert [each.sides['post'] for each in beside] == [each.sides['post'] for each in alone]
    assert [each.likelihood for each in beside] == pytest.approx([each.likelihood for each in alone], abs=0.06)
    predictor = foc_ros.Predictor(foc_ros.Config(budget_s=0.0))
    predictor.set_goals((0.3, 0.0))
    predictor.set_obstacles([post, trolley])
    for tick in range(10):
        prediction = predictor.update(0.01 * tick, (0.0, 0.0))
        assert [each.sides['post'] for each in prediction.candidates] == [RIGHT, LEFT]
        assert sum(each.likelihood for each in prediction.candidates) == pytest.approx(0.98, abs=1e-3)
