# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Likelihoods: from ratios of costs, over the time until a choice, by the next row of obstacles, and of classes that miss eta."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import norm

import foc_ros
from foc_ros.core.classes.rows import Decisions, find_decisions
from foc_ros.core.classes.sides import BranchTimes, compute_branch_times
from foc_ros.core.config import LikelihoodConfig
from foc_ros.core.errors import InputError
from foc_ros.core.likelihood import compute_likelihoods
from foc_ros.core.obstacle_table import make_obstacles
from foc_ros.core.prediction import PredictedCandidate
from foc_ros.core.registry import LIKELIHOOD_RULES
from foc_ros.core.safety_preference import SafetyPreference
from foc_ros.core.solution import LEFT, RIGHT, Candidate, Solution, Status
from foc_ros.core.types import Array, HandState

ANY_COSTS = st.lists(st.floats(0.0, 1.7e308), min_size=1, max_size=12)
BETA = st.floats(0.0, 100.0)


def with_beta(beta: float) -> LikelihoodConfig:
    return LikelihoodConfig(beta=beta)


def test_ratio_of_likelihoods_is_the_power_of_the_ratio_of_costs() -> None:
    p = compute_likelihoods(np.array([1.0, 4.0, 9.0]), with_beta(0.5))
    np.testing.assert_allclose(p, np.array([6.0, 3.0, 2.0]) / 11.0, rtol=1e-14)


@given(ANY_COSTS, BETA)
def test_any_costs_give_a_distribution_in_the_order_of_the_costs(costs: list[float], beta: float) -> None:
    p = compute_likelihoods(np.array(costs), with_beta(beta))
    assert np.all((p >= 0.0) & (p <= 1.0))
    assert p.sum() == pytest.approx(1.0)
    assert np.all(np.diff(p[np.argsort(costs, kind='stable')]) <= 0.0)


@pytest.mark.parametrize('wrong', [-1.0, np.nan, np.inf])
def test_a_negative_or_infinite_cost_is_refused_by_name(wrong: float) -> None:
    with pytest.raises(InputError, match=r'costs\[1\]: expected a finite number >= 0'):
        compute_likelihoods(np.array([1.0, wrong]), with_beta(0.5))


def test_a_rule_may_give_classes_no_weight(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(
        LIKELIHOOD_RULES, '_parts', {'first': lambda costs, _: np.where(np.arange(len(costs)) == 0, 0.0, -np.inf)}
    )
    config, ahead = replace(LikelihoodConfig(), rule='first'), BranchTimes(np.full((3, 3), 0.5), np.arange(3))
    for horizon_s in (0.0, 1000.0):
        found = compute_likelihoods(np.ones(3), replace(config, planning_horizon_s=horizon_s, lookahead_s=0.0), ahead)
        np.testing.assert_allclose(found, [1.0, 0.0, 0.0], atol=1e-250)
    monkeypatch.setattr(LIKELIHOOD_RULES, '_parts', {'first': lambda costs, _: np.full(len(costs), -np.inf)})
    np.testing.assert_allclose(compute_likelihoods(np.ones(3), config, ahead, time_s=1.0), np.ones(3) / 3.0)


STEPS = 40


def outcome(corners: list[tuple[float, float]], goal: int = 0, duration_s: float = 2.0) -> PredictedCandidate:
    """A path through corners at even times."""
    at = np.linspace(0.0, len(corners) - 1.0, STEPS + 1)
    path: Array = np.column_stack([np.interp(at, np.arange(len(corners)), axis) for axis in np.array(corners).T])
    mean = np.hstack([path, np.zeros((STEPS + 1, 4))])
    none = np.zeros((STEPS, 2))
    solution = Solution(
        Status.SOLVED, '', duration_s / STEPS, mean, np.zeros((STEPS + 1, 6, 6)), none, 1.0, {}, tau=0.0, lam=1.0, eta=0.9
    )
    return PredictedCandidate(Candidate('', goal, (), path, 1.0), solution, {}, 1.0, 0.0)


TWO = make_obstacles([(1.0, 0.0), (3.0, 0.0)], 0.1)


def pass_two(first: float, second: float, duration_s: float = 4.0) -> PredictedCandidate:
    return outcome([(0.0, 0.0), (1.0, first), (2.0, 0.0), (3.0, second), (4.0, 0.0)], duration_s=duration_s)


def test_paths_separate_when_the_first_of_them_passes_an_obstacle_on_another_side() -> None:
    found = compute_branch_times([pass_two(0.1, 0.1), pass_two(0.1, -0.1), pass_two(-0.1, -0.1, duration_s=2.0)], TWO)
    np.testing.assert_allclose(found.after_s, [[np.inf, 3.0, 0.5], [3.0, np.inf, 0.5], [0.5, 0.5, np.inf]])
    assert found.path_class.tolist() == [0, 1, 2]


THREE_COSTS = np.array([1.0, 2.0, 5.0])


def make_config(lookahead_s: float) -> LikelihoodConfig:
    return LikelihoodConfig(beta=2.0, planning_horizon_s=0.0, lookahead_s=lookahead_s)


def make_branch_times(after_s: float) -> BranchTimes:
    return BranchTimes(np.where(np.eye(3, dtype=bool), np.inf, after_s), np.arange(3))


@pytest.mark.parametrize('after_s', [0.0, 0.3, 2.0])
def test_the_exponent_of_a_choice_fades_with_the_time_until_the_choice(after_s: float) -> None:
    fading = LikelihoodConfig(beta=2.0 * np.exp(-after_s / 0.7))
    np.testing.assert_allclose(
        compute_likelihoods(THREE_COSTS, make_config(0.7), make_branch_times(after_s)),
        compute_likelihoods(THREE_COSTS, fading),
        rtol=1e-12,
    )


@pytest.mark.parametrize(('horizon_s', 'share'), [(1000.0, 0.0), (4.0, norm.cdf(-math.log(2.0) / 0.5)), (2.0, 0.5), (0.0, 1.0)])
def test_who_needs_longer_than_the_planning_horizon_looks_ahead(horizon_s: float, share: float) -> None:
    planned, ahead = (
        compute_likelihoods(THREE_COSTS, make_config(0.7)),
        compute_likelihoods(THREE_COSTS, make_config(0.7), make_branch_times(1.0)),
    )
    config = replace(make_config(0.7), planning_horizon_s=horizon_s)
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


def make_hand(x: float) -> HandState:
    return HandState(0, np.array([x, 0.0, 0.3, 0.0, 0.0, 0.0]), np.eye(6), onset_ns=0, onset_position=np.zeros(2))


def test_the_next_row_is_the_first_open_one_ahead() -> None:
    found = find_decisions(SIDES, GOAL, OBSTACLES, make_hand(0.0), GOALS)
    gap = found.next_gap
    assert gap[1] == gap[2] and len(set(gap.tolist())) == 4
    assert found.woven.tolist() == [0, 0, 0, 1, 0]
    beyond = find_decisions(SIDES, GOAL, OBSTACLES, make_hand(0.2), GOALS)
    assert len(set(beyond.next_gap[[0, 1, 3]].tolist())) == 1
    assert beyond.next_gap[0] != beyond.next_gap[4] and not beyond.woven.any()


def test_gaps_keep_their_weight_and_share_it_evenly() -> None:
    decisions = Decisions(np.array([0, 1, 1, 2, 3]), np.arange(5), np.zeros(5, dtype=np.intp))
    near, p = compute_likelihoods(FIVE_COSTS, CONFIG), compute_likelihoods(FIVE_COSTS, CONFIG, decisions=decisions)
    np.testing.assert_allclose(np.bincount(decisions.next_gap, p), np.bincount(decisions.next_gap, near))
    assert p[1] == pytest.approx(p[2])


def test_goals_of_one_way_are_compared_in_full_and_its_weight_is_their_number() -> None:
    decisions = Decisions(np.zeros(5, dtype=np.intp), np.array([0, 0, 1, 1, 2]), np.zeros(5, dtype=np.intp))
    p = compute_likelihoods(FIVE_COSTS, CONFIG, decisions=decisions)
    assert p[0] / p[1] == pytest.approx((FIVE_COSTS[1] / FIVE_COSTS[0]) ** CONFIG.beta)
    np.testing.assert_allclose(np.bincount(decisions.way, p), [0.4, 0.4, 0.2])


def test_weaving_costs_a_factor() -> None:
    straight = Decisions(np.arange(5), np.arange(5), np.zeros(5, dtype=np.intp))
    p, woven = (
        compute_likelihoods(FIVE_COSTS, CONFIG, decisions=each) for each in (straight, straight._replace(woven=np.eye(5)[3]))
    )
    assert woven[3] / woven[0] == pytest.approx(p[3] / p[0] * np.exp(-1.5))


CUP = foc_ros.Circle((0.15, 0.01), radius=0.03, radius_stddev=0.003)


def classes(**values):
    given = {'foc.noise_x': 0.3, 'foc.noise_y': 0.3} | {name.replace('__', '.'): value for name, value in values.items()}
    return foc_ros.solve_classes((0, 0), [(0.3, 0)], [CUP], config=foc_ros.Config().with_values(given))


def test_the_loss_is_that_of_the_likelihood():
    """Two classes whose losses differ by x have likelihoods of ratio exp(x)."""
    config = LikelihoodConfig(beta=0.7, shortfall=1.3)
    preference = SafetyPreference(config.beta, config.shortfall, fixed_cost=2.0, dt=0.02)
    efforts, ks = np.array([100.0, 400.0]), np.array([1.5, 2.75])
    losses = [preference.compute_loss(effort, k, 3.0) for effort, k in zip(efforts, ks, strict=True)]
    shares = compute_likelihoods(2.0 + 0.02 * efforts, config, shortfalls=3.0 - ks)
    assert math.log(shares[0] / shares[1]) == pytest.approx(losses[1] - losses[0])


def test_a_class_that_misses_eta_takes_part_with_less_weight():
    found = classes(foc__eta=0.99, likelihood__lookahead_s=0.0)
    assert {each.status for each in found} == {Status.COMPROMISED}
    assert all(each.has_likelihood and not each.is_solved and 0 < each.eta < 0.99 for each in found)
    assert sum(each.likelihood for each in found) == pytest.approx(1.0)
    likelihood = foc_ros.Config().likelihood
    weights = [each.cost**-likelihood.beta * math.exp(-likelihood.shortfall * each.solution.safety_shortfall) for each in found]
    np.testing.assert_allclose([each.likelihood for each in found], np.array(weights) / sum(weights))
