"""Moments of the linearised constraint against samples, and the bound that Cantelli's inequality gives."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from foc_ros.core.kernels import freeze
from foc_ros.core.obstacles.chance_constraint import (
    CERTAIN_K,
    RiskBound,
    UncertainObstacles,
    centre_trajectories,
    constraint_moments,
    count_events,
    eta_of_k,
    k_of_eta,
    safety_factor,
    size_moments,
)
from foc_ros.core.obstacles.rounded_polygon import tabulate_polygons
from foc_ros.core.types import Obstacles, make_obstacles


def uncertain_obstacles(obstacles: Obstacles, ignored_until: float = 0.0) -> UncertainObstacles:
    n = len(obstacles)
    drift, ignored = np.zeros((n, 2)), np.full(n, ignored_until)
    size, polygons = size_moments(obstacles), tabulate_polygons(obstacles)
    return freeze(UncertainObstacles(obstacles.centre, drift, *size, obstacles.centre_covariance, ignored, polygons))


@given(st.floats(0.0, 0.999))
def test_eta_and_k_are_inverse(eta):
    assert eta_of_k(k_of_eta(eta)) == pytest.approx(eta, abs=1e-12)


def test_a_violated_surrogate_guarantees_nothing():
    assert eta_of_k(-3.0) == 0.0


@given(st.floats(0.55, 0.999), st.sampled_from(['cantelli', 'gaussian']), st.integers(1, 20_000))
def test_the_safety_factor_of_a_bound_gives_its_probability_back(eta, bound, events):
    risk = RiskBound(bound, events)
    assert risk.find_probability(risk.find_safety_factor(eta)) == pytest.approx(eta, abs=1e-9)


def test_what_bounds_and_events_cost_in_standard_deviations():
    wanted = [RiskBound(bound, events).find_safety_factor(0.9) for bound in ('cantelli', 'gaussian') for events in (1, 150)]
    np.testing.assert_allclose(wanted, [3.0, np.sqrt(1499.0), 1.281552, 3.208707], rtol=1e-6)
    assert RiskBound('gaussian').find_safety_factor(0.3) == 0.0, 'the mean keeps out of a circle whatever eta is'
    assert RiskBound('cantelli', 150).find_probability(2.0) == 0.0, 'a sum of risks above one says nothing'


def test_the_risk_of_a_path_counts_every_obstacle_at_every_step():
    assert [count_events(risk, 3, 50) for risk in ('step', 'path')] == [1, 150]
    assert count_events('path', 0, 50) == 1


def test_without_variance_k_is_certain_either_way():
    assert (safety_factor(-1.0, 0.0), safety_factor(1.0, 0.0)) == (CERTAIN_K, -CERTAIN_K)


def test_moments_are_those_of_samples_for_correlated_axes_and_uncertain_centres():
    generator = np.random.default_rng(5)
    samples = 400_000
    covariance = np.array([[4e-4, 1.5e-4], [1.5e-4, 2e-4]])
    centre_covariance = np.array([[1e-4, -5e-5], [-5e-5, 9e-5]])
    obstacle = make_obstacles([[0.1, 0.05]], [0.03], [0.004], centre_covariance=centre_covariance)
    mean = np.array([0.16, 0.02])
    d = mean - obstacle.centre[0]
    E, V = constraint_moments(mean[None], covariance[[0, 1, 0], [0, 1, 1]].reshape(3, 1), uncertain_obstacles(obstacle))
    E, V = E[0, 0], V[0, 0]
    position = generator.multivariate_normal(mean, covariance, samples)
    centre = generator.multivariate_normal(obstacle.centre[0], centre_covariance, samples)
    radius = generator.normal(0.03, 0.004, samples)
    C = radius**2 - d @ d - 2 * (position - centre - d) @ d
    assert abs(C.mean() - E) < 4.5 * C.std() / np.sqrt(samples)
    assert C.var() == pytest.approx(V, rel=0.01)
    assert np.mean(C <= 0) >= eta_of_k(-E / np.sqrt(V))


def test_a_circle_does_not_count_before_the_hand_has_left_its_margin():
    circles = uncertain_obstacles(make_obstacles([[0.0, 0.0]], [0.03], [0.002]), ignored_until=2.5)
    mean, _ = constraint_moments(np.zeros((4, 2)), np.zeros((3, 4)), circles)
    np.testing.assert_array_equal(np.isneginf(mean), [[True, True, False, False]])


def test_centres_move_with_their_velocity():
    moved = centre_trajectories(np.array([[1.0, 2.0]]), 0.1 * np.array([[0.5, -1.0]]), 3)
    np.testing.assert_allclose(moved[:, 0], [[1.0, 2.0], [1.05, 1.9], [1.1, 1.8], [1.15, 1.7]])
