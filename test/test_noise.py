"""Closed-form covariances against the recursion and against samples."""

import numpy as np
import pytest

from foc_ros.core.plant.covariance import propagate_covariance, scale_noise, stack_noise
from foc_ros.core.plant.plants import (
    PositionNoise,
    condense,
    discretise_damped_mass,
    discretise_triple_integrator,
    position_variances,
    variance_weights,
)

PLANTS = pytest.mark.parametrize(
    'plant', [discretise_triple_integrator(0.03), discretise_damped_mass(0.04, 1.5, 4.0)], ids=['jerk', 'force']
)


def correlated(generator, n, size=1e-3):
    root = size * generator.standard_normal((n, n))
    return root @ root.T


@PLANTS
def test_covariance_is_the_recursion(plant):
    generator = np.random.default_rng(2)
    n, steps, noise = len(plant.A), 20, np.array([0.1, 0.2])
    control, P = generator.standard_normal((steps, 2)), correlated(generator, n)
    stacked = condense(plant, steps)
    free = stacked.powers @ P @ stacked.powers.swapaxes(1, 2)
    closed = propagate_covariance(stacked, free, stack_noise(noise, steps) ** 2, control.T.ravel())
    for t in range(steps):
        np.testing.assert_allclose(closed[t], P, rtol=1e-9, atol=1e-15)
        P = plant.A @ P @ plant.A.T + plant.B @ np.diag((noise * control[t]) ** 2) @ plant.B.T
    np.testing.assert_allclose(closed[-1], P, rtol=1e-9, atol=1e-15)


@PLANTS
def test_position_variance_is_diagonal_in_the_squared_control(plant):
    generator = np.random.default_rng(3)
    stacked, noise = condense(plant, 15), np.array([0.3, 0.1])
    control = generator.standard_normal(30)
    full = propagate_covariance(stacked, np.zeros((16, len(plant.A), len(plant.A))), stack_noise(noise, 15) ** 2, control)[1:]
    position_noise = PositionNoise(stacked.maps, stack_noise(noise, 15) ** 2, np.zeros((3, 15)))
    xx, yy, xy = position_variances(position_noise, control)
    np.testing.assert_allclose([xx, yy, xy], [full[:, 0, 0], full[:, 1, 1], full[:, 0, 1]], atol=1e-15)


@PLANTS
def test_weighted_variances_are_sums_of_squared_responses(plant):
    generator = np.random.default_rng(5)
    stacked, n = condense(plant, 15), len(plant.A)
    terminal, stage = generator.uniform(size=(2, n))
    squared = stacked.response**2
    np.testing.assert_allclose(
        variance_weights(stacked.states, terminal, stage),
        terminal @ squared[-1] + stage @ squared[:-1].sum(axis=0),
        rtol=1e-12,
    )


def test_covariance_is_that_of_noisy_rollouts():
    generator = np.random.default_rng(4)
    plant, steps, samples, noise = discretise_triple_integrator(0.05), 10, 40_000, np.array([0.2, 0.1])
    control, P0 = generator.standard_normal((steps, 2)) * 50, correlated(generator, 6)
    stacked = condense(plant, steps)
    closed = propagate_covariance(
        stacked, stacked.powers @ P0 @ stacked.powers.swapaxes(1, 2), stack_noise(noise, steps) ** 2, control.T.ravel()
    )
    states = generator.multivariate_normal(np.zeros(6), P0, samples, method='eigh')
    for t in range(steps):
        noisy = control[t] * (1 + noise * generator.standard_normal((samples, 2)))
        states = states @ plant.A.T + noisy @ plant.B.T
    sampled = np.cov(states.T)
    scale = np.sqrt(np.outer(np.diag(closed[-1]), np.diag(closed[-1])))
    assert np.abs((sampled - closed[-1]) / scale).max() < 4.5 / np.sqrt(samples / 2)


def test_noise_for_another_step_keeps_the_power_per_second():
    np.testing.assert_allclose(scale_noise(np.array([0.1, 0.2]), 0.02, 0.005), [0.2, 0.4])
