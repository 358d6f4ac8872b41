# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
"""Plants compared with the matrix exponential, horizons with a simulation step by step."""

import numpy as np
import pytest
from scipy.linalg import expm

from foc_ros.core.errors import InputError
from foc_ros.core.plant.plants import (
    Plant,
    condense,
    discretise_damped_mass,
    discretise_triple_integrator,
)


def zero_order_hold(a: np.ndarray, b: np.ndarray, dt: float) -> tuple[np.ndarray, np.ndarray]:
    n, m = b.shape
    block = expm(np.block([[a, b], [np.zeros((m, n + m))]]) * dt)
    return block[:n, :n], block[:n, n:]


def test_triple_integrator_is_the_exact_discretisation():
    chain = np.kron(np.diag([1.0, 1.0], k=1), np.eye(2))
    A, B = zero_order_hold(chain, np.kron([[0.0], [0.0], [1.0]], np.eye(2)), 0.02)
    plant = discretise_triple_integrator(0.02)
    np.testing.assert_allclose(plant.A, A, atol=1e-15)
    np.testing.assert_allclose(plant.B, B, atol=1e-15)


@pytest.mark.parametrize('damping', [0.0, 1e-6, 0.3, 5.0, 80.0])
def test_damped_mass_is_the_exact_discretisation(damping):
    mass, dt = 1.7, 0.03
    A, B = zero_order_hold(
        np.kron([[0.0, 1.0], [0.0, -damping / mass]], np.eye(2)), np.kron([[0.0], [1.0 / mass]], np.eye(2)), dt
    )
    plant = discretise_damped_mass(dt, mass, damping)
    np.testing.assert_allclose(plant.A, A, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(plant.B, B, rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize(
    'plant', [discretise_triple_integrator(0.02), discretise_damped_mass(0.05, 2.0, 3.0)], ids=['jerk', 'force']
)
def test_horizon_is_what_the_plant_does_step_by_step(plant):
    generator = np.random.default_rng(1)
    steps, n = 12, len(plant.A)
    control, state = generator.standard_normal((steps, 2)), generator.standard_normal(n)
    stacked = condense(plant, steps)
    predicted = stacked.powers @ state
    predicted[1:] += stacked.response @ control.T.ravel()
    for t in range(steps):
        np.testing.assert_allclose(predicted[t], state, atol=1e-12)
        state = plant.A @ state + plant.B @ control[t]
    np.testing.assert_allclose(predicted[-1], state, atol=1e-12)


@pytest.mark.parametrize(
    ('A', 'B', 'dt'),
    [
        (np.eye(3), np.ones((3, 2)), 0.1),
        (np.eye(4), np.ones((4, 1)), 0.1),
        (np.eye(4), np.full((4, 2), np.nan), 0.1),
        (np.eye(4), np.ones((4, 2)), 0.0),
    ],
)
def test_a_plant_of_wrong_shape_is_refused(A, B, dt):
    with pytest.raises(InputError, match='plant'):
        Plant(A, B, dt)
