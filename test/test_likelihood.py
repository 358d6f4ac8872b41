"""Likelihoods from cost ratios."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from foc_ros.core.classes.sides import BranchTimes
from foc_ros.core.config import LikelihoodConfig
from foc_ros.core.errors import InputError
from foc_ros.core.likelihood import COST_FLOOR, compute_likelihoods
from foc_ros.core.registry import LIKELIHOOD_RULES

COSTS = st.lists(st.floats(0.0, 1.7e308), min_size=1, max_size=12)
BETA = st.floats(0.0, 100.0)


def with_beta(beta: float) -> LikelihoodConfig:
    return LikelihoodConfig(beta=beta)


def test_ratio_of_likelihoods_is_the_power_of_the_ratio_of_costs() -> None:
    p = compute_likelihoods(np.array([1.0, 4.0, 9.0]), with_beta(0.5))
    np.testing.assert_allclose(p, np.array([6.0, 3.0, 2.0]) / 11.0, rtol=1e-14)


def test_no_class_gives_no_likelihood() -> None:
    assert compute_likelihoods(np.zeros(0), with_beta(0.5)).shape == (0,)


def test_beta_zero_is_uniform_and_large_beta_picks_the_cheapest() -> None:
    costs = np.array([3.0, 2.0, 5.0])
    np.testing.assert_allclose(compute_likelihoods(costs, with_beta(0.0)), 1.0 / 3.0)
    assert compute_likelihoods(costs, with_beta(100.0))[1] == pytest.approx(1.0)


def test_costs_below_the_floor_count_as_the_floor() -> None:
    p = compute_likelihoods(np.array([0.0, COST_FLOOR / 10.0, COST_FLOOR, 4.0 * COST_FLOOR]), with_beta(0.5))
    np.testing.assert_allclose(p, np.array([2.0, 2.0, 2.0, 1.0]) / 7.0, rtol=1e-14)


@given(COSTS, BETA)
def test_any_costs_give_a_distribution_in_the_order_of_the_costs(costs: list[float], beta: float) -> None:
    p = compute_likelihoods(np.array(costs), with_beta(beta))
    assert np.all((p >= 0.0) & (p <= 1.0))
    assert p.sum() == pytest.approx(1.0)
    assert np.all(np.diff(p[np.argsort(costs, kind='stable')]) <= 0.0)


@given(st.lists(st.floats(1e-3, 1e6), min_size=1, max_size=8), BETA, st.floats(1e-3, 1e3))
def test_the_unit_of_effort_does_not_matter(costs: list[float], beta: float, unit: float) -> None:
    np.testing.assert_allclose(
        compute_likelihoods(unit * np.array(costs), with_beta(beta)),
        compute_likelihoods(np.array(costs), with_beta(beta)),
        rtol=1e-9,
        atol=1e-12,
    )


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
