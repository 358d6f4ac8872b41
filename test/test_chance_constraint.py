# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Moments of the linearised constraint against samples, and the bound that Cantelli's inequality gives."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from foc_ros.core.obstacle_table import make_obstacles
from foc_ros.core.obstacles.risk import (
    RiskBound,
    compute_safety_factor,
    eta_of_k,
    k_of_eta,
    size_moments,
)


@given(st.floats(0.0, 0.999))
def test_eta_and_k_are_inverse(eta):
    assert eta_of_k(k_of_eta(eta)) == pytest.approx(eta, abs=1e-12)


@given(st.floats(0.55, 0.999), st.sampled_from(['cantelli', 'gaussian']), st.integers(1, 20_000))
def test_the_safety_factor_of_a_bound_gives_its_probability_back(eta, bound, events):
    risk = RiskBound(bound, events)
    assert risk.find_probability(risk.find_safety_factor(eta)) == pytest.approx(eta, abs=1e-9)


def test_what_bounds_and_events_cost_in_standard_deviations():
    wanted = [RiskBound(bound, events).find_safety_factor(0.9) for bound in ('cantelli', 'gaussian') for events in (1, 150)]
    np.testing.assert_allclose(wanted, [3.0, np.sqrt(1499.0), 1.281552, 3.208707], rtol=1e-6)
    assert RiskBound('gaussian').find_safety_factor(0.3) == 0.0, 'the mean keeps out of a circle whatever eta is'
    assert RiskBound('cantelli', 150).find_probability(2.0) == 0.0, 'a sum of risks above one says nothing'


def test_the_safety_factor_is_that_of_samples_for_correlated_axes_and_uncertain_centres():
    generator = np.random.default_rng(5)
    samples = 400_000
    covariance = np.array([[4e-4, 1.5e-4], [1.5e-4, 2e-4]])
    centre_covariance = np.array([[1e-4, -5e-5], [-5e-5, 9e-5]])
    obstacle = make_obstacles([[0.1, 0.05]], [0.03], [0.004], centre_covariance=centre_covariance)
    d = np.array([0.06, -0.03])
    distance = np.hypot(*d)
    along = d @ (covariance + centre_covariance) @ d / distance**2
    k = float(compute_safety_factor(distance, along, *size_moments(obstacle))[0])
    position = d + generator.multivariate_normal(np.zeros(2), covariance, samples)
    centre = generator.multivariate_normal(np.zeros(2), centre_covariance, samples)
    radius = generator.normal(0.03, 0.004, samples)
    C = radius**2 - d @ d - 2 * (position - centre - d) @ d
    assert k == pytest.approx(-C.mean() / C.std(), rel=0.01)
    assert np.mean(C <= 0) >= eta_of_k(k)
