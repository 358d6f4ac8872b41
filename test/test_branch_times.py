"""Branch times of predicted paths, and a likelihood rule whose exponent fades with the time until a choice."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import norm

from foc_ros.core.classes.sides import BranchTimes, compute_branch_times
from foc_ros.core.config import LikelihoodConfig
from foc_ros.core.likelihood import compute_likelihoods
from foc_ros.core.types import Array, Candidate, PredictedCandidate, Solution, Status, make_obstacles

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


def test_an_obstacle_that_moves_is_passed_where_it_then_is() -> None:
    moving = make_obstacles([(1.0, 0.0)], 0.1, velocity=(0.5, 0.0))
    found = compute_branch_times(
        [outcome([(0.0, 0.0), (2.0, 0.1), (4.0, 0.0)]), outcome([(0.0, 0.0), (2.0, -0.1), (4.0, 0.0)])], moving
    )
    assert found.after_s[0, 1] == pytest.approx(2.0 / 3.0, abs=0.05)


def test_obstacles_passed_on_one_side_or_left_behind_separate_nothing() -> None:
    behind = make_obstacles([(-0.1, 0.0), (2.0, 1.0)], 0.05)
    found = compute_branch_times(
        [outcome([(0.0, 0.0), (2.0, 0.5), (4.0, 0.0)]), outcome([(0.0, 0.0), (2.0, -0.5), (4.0, 0.0)])], behind
    )
    assert np.isinf(found.after_s).all()
    assert found.path_class.tolist() == [0, 0]


def test_paths_without_an_obstacle_between_them_never_separate() -> None:
    found = compute_branch_times([outcome([(0.0, 0.0), (1.0, 1.0)], 0), outcome([(0.0, 0.0), (1.0, -1.0)], 1)], make_obstacles())
    assert np.isinf(found.after_s).all()
    assert found.path_class.tolist() == [0, 0]


def test_no_candidates_have_no_branch_times() -> None:
    assert compute_branch_times([], TWO).after_s.shape == (0, 0)


COSTS = np.array([1.0, 2.0, 5.0])


def make_config(lookahead_s: float) -> LikelihoodConfig:
    return LikelihoodConfig(beta=2.0, planning_horizon_s=0.0, lookahead_s=lookahead_s)


def make_branch_times(after_s: float) -> BranchTimes:
    return BranchTimes(np.where(np.eye(3, dtype=bool), np.inf, after_s), np.arange(3))


@pytest.mark.parametrize('after_s', [0.0, 0.3, 2.0])
def test_the_exponent_of_a_choice_fades_with_the_time_until_the_choice(after_s: float) -> None:
    fading = LikelihoodConfig(beta=2.0 * np.exp(-after_s / 0.7))
    np.testing.assert_allclose(
        compute_likelihoods(COSTS, make_config(0.7), make_branch_times(after_s)), compute_likelihoods(COSTS, fading), rtol=1e-12
    )


def test_a_near_choice_follows_the_costs_and_a_far_one_is_open() -> None:
    after_s = np.array([[np.inf, 50.0, 0.0], [50.0, np.inf, 0.0], [0.0, 0.0, np.inf]])
    p = compute_likelihoods(COSTS, make_config(1.0), BranchTimes(after_s, np.arange(3)))
    near = np.array([(1.0 + 0.25) / 2.0, (1.0 + 0.25) / 2.0, 0.04])
    np.testing.assert_allclose(p, near / near.sum(), rtol=1e-12)


def test_goals_of_one_class_share_its_likelihood_by_their_costs() -> None:
    after_s = np.array([[np.inf, np.inf, 1e6], [np.inf, np.inf, 1e6], [1e6, 1e6, np.inf]])
    p = compute_likelihoods(COSTS, make_config(1.0), BranchTimes(after_s, np.array([0, 0, 2])))
    np.testing.assert_allclose(p, [0.5 * 0.8, 0.5 * 0.2, 0.5])


def test_an_infinite_lookahead_is_the_plain_rule() -> None:
    branch_times = BranchTimes(np.array([[np.inf, np.inf, 2.0], [np.inf, np.inf, 2.0], [2.0, 2.0, np.inf]]), np.array([0, 0, 2]))
    np.testing.assert_allclose(
        compute_likelihoods(COSTS, make_config(1e9), branch_times), compute_likelihoods(COSTS, make_config(0.0)), rtol=1e-6
    )


def test_branch_times_have_no_influence_without_a_look_ahead() -> None:
    plain = LikelihoodConfig(beta=2.0, planning_horizon_s=0.0, lookahead_s=0.0)
    np.testing.assert_array_equal(compute_likelihoods(COSTS, plain, make_branch_times(1.0)), compute_likelihoods(COSTS, plain))


@pytest.mark.parametrize(('horizon_s', 'share'), [(1000.0, 0.0), (4.0, norm.cdf(-math.log(2.0) / 0.5)), (2.0, 0.5), (0.0, 1.0)])
def test_who_needs_longer_than_the_planning_horizon_looks_ahead(horizon_s: float, share: float) -> None:
    planned, ahead = (
        compute_likelihoods(COSTS, make_config(0.7)),
        compute_likelihoods(COSTS, make_config(0.7), make_branch_times(1.0)),
    )
    config = replace(make_config(0.7), planning_horizon_s=horizon_s)
    found = compute_likelihoods(COSTS, config, make_branch_times(1.0), time_s=2.0, planning_spread=0.5)
    np.testing.assert_allclose(found, (1.0 - share) * planned + share * ahead, rtol=1e-12)
    at_goal = compute_likelihoods(COSTS, config, make_branch_times(1.0), time_s=0.0)
    np.testing.assert_array_equal(at_goal, ahead if horizon_s == 0.0 else planned)


def test_extreme_costs_do_not_overflow() -> None:
    p = compute_likelihoods(np.array([1e-300, 1e300, 1e300]), replace(make_config(1.0), beta=100.0), make_branch_times(0.1))
    np.testing.assert_allclose(p, [1.0, 0.0, 0.0], atol=1e-250)
