"""Moments of the linearised constraint against samples, and the bound that Cantelli's inequality gives."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from foc_ros.core.obstacles.chance_constraint import (
    CERTAIN_K,
    centres_by_obstacle,
    eta_of_k,
    expected_values,
    k_of_eta,
    safety_factors,
    size_moments,
    variances,
)
from foc_ros.core.types import make_obstacles


@given(st.floats(0.0, 0.999))
def test_eta_and_k_are_inverse(eta):
    assert eta_of_k(k_of_eta(eta)) == pytest.approx(eta, abs=1e-12)


def test_a_violated_surrogate_guarantees_nothing():
    assert eta_of_k(-3.0) == 0.0


def test_without_variance_k_is_certain_either_way():
    np.testing.assert_array_equal(safety_factors(np.array([[-1.0, 1.0]]), np.zeros((1, 2))), [[CERTAIN_K, -CERTAIN_K]])


def test_moments_are_those_of_samples_for_correlated_axes_and_uncertain_centres():
    generator = np.random.default_rng(5)
    samples = 400_000
    covariance = np.array([[4e-4, 1.5e-4], [1.5e-4, 2e-4]])
    centre_covariance = np.array([[1e-4, -5e-5], [-5e-5, 9e-5]])
    obstacle = make_obstacles([[0.1, 0.05]], [0.03], [0.004], centre_covariance=centre_covariance)
    mean, guess = np.array([0.16, 0.02]), np.array([0.17, 0.015])
    d = (guess - obstacle.centre[0]).reshape(1, 1, 2)
    size_mean, size_variance = size_moments(obstacle)
    E = expected_values(d, (mean - guess)[None], size_mean)[0, 0]
    V = variances(d, covariance[[0, 1, 0], [0, 1, 1]].reshape(3, 1), size_variance, obstacle.centre_covariance)[0, 0]
    position = generator.multivariate_normal(mean, covariance, samples)
    centre = generator.multivariate_normal(obstacle.centre[0], centre_covariance, samples)
    radius = generator.normal(0.03, 0.004, samples)
    moved = (position - centre) - (guess - obstacle.centre[0])
    C = radius**2 - d[0, 0] @ d[0, 0] - 2 * moved @ d[0, 0]
    assert abs(C.mean() - E) < 4.5 * C.std() / np.sqrt(samples)
    assert C.var() == pytest.approx(V, rel=0.01)
    assert np.mean(C <= 0) >= eta_of_k(-E / np.sqrt(V))


def test_linearisation_is_an_upper_bound_of_the_constraint():
    generator = np.random.default_rng(6)
    guess, position = generator.normal(size=(2, 200, 2))
    linear = expected_values(guess[None], position - guess, np.array([0.5]))[0]
    assert (0.5 - (position**2).sum(axis=1) <= linear + 1e-12).all()


def test_centres_move_on_at_their_velocity():
    moved = centres_by_obstacle(np.array([[1.0, 2.0]]), 0.1 * np.array([[0.5, -1.0]]), 3)
    np.testing.assert_allclose(moved, [[[1.05, 1.9], [1.1, 1.8], [1.15, 1.7]]])
