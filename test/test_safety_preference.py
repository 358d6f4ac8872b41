"""Classes that miss the wanted eta: how much less likely they are, and when they do not count at all."""

import math

import numpy as np
import pytest

import foc_ros
from foc_ros.core.config import LikelihoodConfig
from foc_ros.core.likelihood import compute_likelihoods
from foc_ros.core.safety_preference import COST_FLOOR, HARD, SafetyPreference
from foc_ros.core.types import Status

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


def test_the_loss_has_its_limits():
    assert HARD.compute_loss(1.0, 2.999, 3.0) == math.inf
    assert HARD.compute_loss(math.e, 3.0, 3.0) == pytest.approx(1.0)
    assert SafetyPreference(1.0, 1.0).compute_loss(0.0, 4.0, 3.0) == pytest.approx(math.log(COST_FLOOR))


def test_a_class_that_misses_eta_takes_part_with_less_weight():
    found = classes(foc__eta=0.99, likelihood__lookahead_s=0.0)
    assert {each.status for each in found} == {Status.COMPROMISED}
    assert all(each.has_likelihood and not each.is_solved and 0 < each.eta < 0.99 for each in found)
    assert sum(each.likelihood for each in found) == pytest.approx(1.0)
    likelihood = foc_ros.Config().likelihood
    weights = [each.cost**-likelihood.beta * math.exp(-likelihood.shortfall * each.solution.safety_shortfall) for each in found]
    np.testing.assert_allclose([each.likelihood for each in found], np.array(weights) / sum(weights))


def test_with_an_infinite_shortfall_it_does_not():
    found = classes(foc__eta=0.99, likelihood__shortfall=math.inf)
    assert {each.status for each in found} == {Status.ETA_UNREACHABLE}
    assert [each.likelihood for each in found] == [0.0, 0.0]


@pytest.mark.parametrize('name', ['likelihood.beta', 'foc.eta', 'likelihood.shortfall'])
@pytest.mark.parametrize('value', [math.nan, -math.inf, math.inf])
def test_infinity_is_a_shortfall_and_nothing_else(name, value):
    if (name, value) == ('likelihood.shortfall', math.inf):
        assert foc_ros.Config().with_values({name: value}).likelihood.shortfall == value
        return
    with pytest.raises(foc_ros.ParameterError, match=name):
        foc_ros.Config().with_values({name: value})
